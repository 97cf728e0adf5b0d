//! Gives a vehicle on the ground the controller, gains and trajectory of a scenario, and arms it.

use ctrl_core::mode::Command;
use ctrl_core::trajectory::{TrajectoryConfig, WaypointPathConfig};
use ctrl_core::vehicle::VehicleState;
use link::{ControllerKind, EstimatorSetting, Parameters, TrajectorySelection, Uplink};

use super::PilError;
use super::session::VehicleSession;
use ctrl_core::controller::ControllerConfig;
use ctrl_core::estimator::SOURCES;
use sim::scenario::Scenario;

/// Ticks of good samples before arming, more than the vehicle asks for.
const FRESH_TICKS: usize = 60;

/// Makes the vehicle ready to fly `scenario` from its initial state: armed, at its first sample.
///
/// # Errors
/// When the vehicle refuses, or steps at another rate.
pub fn set_up(session: &mut VehicleSession, scenario: &Scenario) -> Result<VehicleState, PilError> {
    let state = greet(session, scenario)?;
    // A stream suits every controller, so that no trajectory stands against the gains meanwhile.
    let stream = Uplink::SelectTrajectory(TrajectorySelection::Stream);
    session.expect_ok("to follow a stream", stream, state)?;
    select_controller(session, &scenario.controller, state)?;
    configure_estimator(session, scenario, state)?;
    arm(session, scenario, state)
}

/// As [`set_up`], with the controller and the parameters that are in force on the vehicle.
///
/// # Errors
/// As [`set_up`].
pub fn ready(session: &mut VehicleSession, scenario: &Scenario) -> Result<VehicleState, PilError> {
    let state = greet(session, scenario)?;
    arm(session, scenario, state)
}

/// Gives the vehicle the controller of `scenario` and leaves it on the ground, for a ground station to arm.
///
/// # Errors
/// As [`set_up`].
pub fn stand(session: &mut VehicleSession, scenario: &Scenario) -> Result<(), PilError> {
    let state = greet(session, scenario)?;
    let stream = Uplink::SelectTrajectory(TrajectorySelection::Stream);
    session.expect_ok("to follow a stream", stream, state)?;
    select_controller(session, &scenario.controller, state)
}

/// Begins the conversation; the scenario's initial state.
fn greet(session: &mut VehicleSession, scenario: &Scenario) -> Result<VehicleState, PilError> {
    if scenario.rotors.as_ref().is_some_and(|rotors| rotors.tells_law) {
        return Err(PilError::TellsLaw);
    }
    let state = scenario.initial.state().measured();
    let identity = session.subscribe(state)?;
    let (image, wanted) = (identity.step_period, scenario.controller.step_period());
    if image != wanted {
        return Err(PilError::StepPeriod { image, scenario: wanted });
    }
    Ok(state)
}

fn arm(
    session: &mut VehicleSession,
    scenario: &Scenario,
    state: VehicleState,
) -> Result<VehicleState, PilError> {
    select_trajectory(session, &scenario.trajectory, state)?;
    let sample = session.on_ground(state);
    for _ in 0..FRESH_TICKS {
        session.tick(std::slice::from_ref(&sample))?;
    }
    session.expect_ok("to arm", Uplink::Command(Command::Arm), state)?;
    Ok(state)
}

/// Puts the estimator aboard to use with what the scenario's sensors are known for.
fn configure_estimator(
    session: &mut VehicleSession,
    scenario: &Scenario,
    state: VehicleState,
) -> Result<(), PilError> {
    let Some(sensors) = &scenario.sensors else { return Ok(()) };
    let tick = f64::from(scenario.controller.step_period());
    if sensors.imu().ticks_per_sample(tick) != 1 {
        return Err(PilError::SlowSensors);
    }
    let config = sensors.estimator(tick);
    let mut settings = vec![
        EstimatorSetting::Inertial(config.inertial),
        EstimatorSetting::Initial(config.initial),
        EstimatorSetting::MagneticField(config.magnetic_field_world),
        EstimatorSetting::BarometerBias(config.barometer_bias),
        EstimatorSetting::Faults(config.faults),
    ];
    settings.extend(SOURCES.map(|it| EstimatorSetting::Source(it, *config.source(it))));
    settings.push(EstimatorSetting::Use);
    for setting in settings {
        session.expect_ok("the estimator", Uplink::Estimator(setting), state)?;
    }
    session.fly_by_sensors();
    Ok(())
}

fn select_controller(
    session: &mut VehicleSession,
    controller: &ControllerConfig,
    state: VehicleState,
) -> Result<(), PilError> {
    let kind = ControllerKind::from(controller);
    session.expect_ok("the controller", Uplink::SelectController(kind), state)?;
    match controller {
        ControllerConfig::RobustAdaptive(config) => write_all(session, config, state),
        ControllerConfig::Saturated(config) => write_all(session, config, state),
    }
}

/// Writes every parameter. Each write must leave a valid configuration, so what is refused is tried
/// again after the others, as long as that helps.
fn write_all<C: Parameters>(
    session: &mut VehicleSession,
    config: &C,
    state: VehicleState,
) -> Result<(), PilError> {
    let indices = 0..C::NAMES.len() as u16;
    let mut left: Vec<_> = indices.filter_map(|index| config.parameter_at(index)).collect();
    loop {
        let before = left.len();
        let mut refused = Vec::new();
        let mut reason = None;
        for (name, value) in left {
            let Ok(written) = name.try_into() else { continue }; // every name fits
            let write = Uplink::ParameterWrite { name: written, value };
            if let Err(rejection) = session.ask(write, state)? {
                reason.get_or_insert((format!("{name} = {value}"), rejection));
                refused.push((name, value));
            }
        }
        match reason {
            None => return Ok(()),
            Some((what, why)) if refused.len() == before => {
                return Err(PilError::Refused(what, why));
            }
            Some(_) => left = refused,
        }
    }
}

fn select_trajectory(
    session: &mut VehicleSession,
    trajectory: &TrajectoryConfig,
    state: VehicleState,
) -> Result<(), PilError> {
    let selection = match trajectory {
        TrajectoryConfig::Hover(config) => TrajectorySelection::Hover(*config),
        TrajectoryConfig::RisingCircle(config) => TrajectorySelection::RisingCircle(*config),
        TrajectoryConfig::Circle(config) => TrajectorySelection::Circle(*config),
        TrajectoryConfig::Lemniscate(config) => TrajectorySelection::Lemniscate(*config),
        TrajectoryConfig::WaypointPath(config) => {
            upload(session, config, state)?;
            TrajectorySelection::UploadedPath
        }
    };
    session.expect_ok("the trajectory", Uplink::SelectTrajectory(selection), state)
}

fn upload(
    session: &mut VehicleSession,
    path: &WaypointPathConfig,
    state: VehicleState,
) -> Result<(), PilError> {
    let WaypointPathConfig { start_world, yaw, legs } = path;
    let begin = Uplink::PathBegin { start_world: *start_world, yaw: *yaw, legs: legs.len() as u8 };
    session.expect_ok("a path", begin, state)?;
    for (index, leg) in legs.iter().enumerate() {
        let leg = Uplink::PathLeg { index: index as u8, leg: *leg };
        session.expect_ok("a leg of a path", leg, state)?;
    }
    Ok(())
}
