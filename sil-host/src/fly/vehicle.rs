//! The vehicle that is flown: the firmware's control group and session before the simulated plant.

use ctrl_core::allocation::{Allocator, BatteryConfig};
use ctrl_core::controller::{AdaptiveController, ControllerConfig, StepOutput, TrackingController};
use ctrl_core::error::ConfigError;
use ctrl_core::mode::Mode;
use ctrl_core::mode::navigation::{NavigationMode, Navigator};
use ctrl_core::mode::safety::SafetyConfig;
use ctrl_core::trajectory::{HoverConfig, TrajectoryConfig};
use ctrl_core::vehicle::VehicleState;
use firmware::exchange::{ControlStatus, shown};
use firmware::flight_control::{FlightControl, Health, Inputs, Outputs};
use firmware::pilot::{Pilot, PilotedVehicle};
use firmware::scenario::{BUILT_IN_MISSION, Tuning};
use firmware::session::{HostSession, SessionConfig, SessionMemory};
use firmware::state_sample::StateSample;
use firmware::vehicle::VEHICLE;
use glam::Vec3;
use link::{ControllerKind, ParametersInForce};
use mavlink_vehicle::{Battery, View};
use sim::plant::ground::GroundedVehicle;
use sim::plant::rotors::RotorsConfig;
use sim::plant::{AppliedWrench, Disturbance, PlantState};
use sim::scenario::Scenario;
use sim::tick::Tick;

use super::error::FlyError;
use super::observed_law::ObservedLaw;
use super::plant::FlownPlant;
use crate::pil::PilError;

/// The name of this vehicle in the session's handshake.
const BOARD: &str = "sil-host fly";

/// One control tick of the vehicle.
#[derive(Clone, Debug)]
pub struct FlownTick {
    /// The tick as observers of a flight receive it; tick and time count from the start of the program.
    pub tick: Tick,
    /// Outputs of the control group.
    pub outputs: Outputs,
    /// Mode of the navigation.
    pub navigation: NavigationMode,
}

/// Faults that act on the vehicle; none by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Interference {
    /// No state sample comes.
    pub sample_lost: bool,
    /// Every control period ends late.
    pub overrun: bool,
    /// The kill switch is on.
    pub kill: bool,
    /// The station is silent since then (s).
    pub link_lost_since: Option<f64>,
    /// The remote control is silent since then (s).
    pub rc_lost_since: Option<f64>,
    /// Measured voltage of the battery (V), in place of the plant's.
    pub voltage: Option<f32>,
    /// The rotor of this index gives nothing.
    pub failed_rotor: Option<usize>,
    /// Something pushes the vehicle until then (s).
    pub push: Option<(Disturbance, f64)>,
}

/// A vehicle on the ground or in flight, commanded by a [`Pilot`].
#[derive(Debug)]
pub struct FlownVehicle<'m> {
    plant: FlownPlant,
    /// The state that the vehicle received at the latest tick.
    measured: VehicleState,
    control: FlightControl,
    session: HostSession<'m>,
    pilot: Pilot,
    /// The law again: what the control group computes must be the same.
    observed: ObservedLaw,
    /// The controller that a station has changed, until it is taken.
    changed: Option<ControllerConfig>,
    status: ControlStatus,
    ticks: u64,
    period: f64,
    thrust_max: f32,
    thrust: f32,
    differs: bool,
    interference: Interference,
    /// What each rotor makes of a newton, by the geometry alone.
    rotors: Allocator,
}

impl<'m> FlownVehicle<'m> {
    /// The vehicle of `scenario`, standing on the ground below its initial position.
    ///
    /// # Errors
    /// The parameter that controller, supervisor, navigation, sensors or rate filter refuse; or damage of the program.
    pub fn new(scenario: &Scenario, memory: &'m mut SessionMemory) -> Result<Self, FlyError> {
        let law = scenario.controller.build()?;
        let tuning = tuning(&scenario.controller);
        let config = SessionConfig::new(BOARD, 1, &VEHICLE);
        let hover = TrajectoryConfig::Hover(HoverConfig { position_world: Vec3::ZERO, yaw: 0.0 });
        let in_force = ParametersInForce::default();
        let session = HostSession::new(memory, config, &tuning, &hover, in_force, None)?;
        let pilot = Pilot::new(&Pilot::moderate(&law), &law)?;
        let mut control = FlightControl::new(&law, &VEHICLE.supervisor, &VEHICLE.geometry)?;
        control.set_safety(&VEHICLE.safety)?;
        if let Some(rotors) = &scenario.rotors {
            check_rotors(rotors)?;
            if let Some(battery) = rotors.battery.and_then(|battery| battery.compensation()) {
                control.set_battery(&battery)?;
            }
        }
        let plant = FlownPlant::new(scenario)?;
        Ok(Self {
            measured: plant.truth().measured(),
            plant,
            control,
            session,
            pilot,
            observed: ObservedLaw::new(scenario)?,
            changed: None,
            thrust_max: law.bounds().thrust_max,
            status: ControlStatus::default(),
            ticks: 0,
            period: law.step_period().into(),
            thrust: 0.0,
            differs: false,
            interference: Interference::default(),
            rotors: Allocator::new(&VEHICLE.geometry)?,
        })
    }

    /// One control tick: sample, reference, control group, plant.
    pub fn tick(&mut self) -> FlownTick {
        let measured = self.plant.measure();
        let Interference { sample_lost, overrun, kill, .. } = self.interference;
        // What is lost leaves the one before: the law holds it, too.
        self.measured = if sample_lost { self.measured } else { measured };
        let sample = (!sample_lost).then_some(measured);
        let reference = self.pilot.step(self.status.mode, sample.as_ref()).reference;
        self.follow_law();
        let inputs = Inputs {
            sample: sample.map(|state| StateSample { state, age_ticks: 0 }),
            reference,
            command: self.pilot.next_command(false),
            overrun,
            fault: self.session.fault_pending(),
            outputs_off: false,
            kill,
            health: self.health(),
        };
        let outputs = self.control.tick(&inputs);
        if let Some(answer) = outputs.answer {
            self.pilot.answered(answer);
        }
        self.pilot.react(outputs.mode, &outputs.safety);
        let acting = self.act(&outputs);
        let output = StepOutput { wrench: outputs.wrench, ..outputs.step };
        let seen = self.plant.seen(self.ticks, self.period, (reference, output), acting);
        let mut tick = Tick { law: true, ..seen };
        let observed = self.observed.observe(&mut tick, outputs.mode, &self.measured);
        self.differs |= observed.is_some_and(|step| step.output != outputs.step);
        self.plant.advance(&tick.disturbance);
        self.ticks += 1;
        self.thrust = outputs.wrench.thrust;
        self.status = ControlStatus {
            mode: outputs.mode,
            flight_tick: outputs.flight_tick,
            uptime: self.ticks as u32, // wraps, as the firmware's
        };
        FlownTick { tick, outputs, navigation: self.pilot.navigator().mode() }
    }

    /// Takes a law that has replaced the one before.
    fn follow_law(&mut self) {
        let Some(law) = self.session.take_law() else { return };
        self.control.replace_law(law);
        self.thrust_max = law.bounds().thrust_max;
        let config = self.session.tuning().config();
        // The session has built the same law.
        self.differs |= self.observed.follow(&config).is_err();
        self.changed = Some(config);
    }

    /// The controller that a station has changed since it was last asked for.
    pub fn take_changed(&mut self) -> Option<ControllerConfig> {
        self.changed.take()
    }

    fn health(&self) -> Health {
        let Interference { link_lost_since, rc_lost_since, voltage, .. } = self.interference;
        let voltage = voltage.or_else(|| self.battery().map(|battery| battery.voltage));
        let silence = |since: Option<f64>| since.map_or(0.0, |since| self.time() - since) as f32;
        let Health { link_silence, .. } = self.pilot.health(&self.session, self.status);
        let link_silence = link_silence.max(silence(link_lost_since));
        Health { link_silence, rc_silence: silence(rc_lost_since), voltage }
    }

    /// Gives the plant what the rotors are commanded: their thrusts, if the scenario has rotors, otherwise the
    /// wrench that the allocation achieved; without the one that interference has made fail.
    fn act(&mut self, outputs: &Outputs) -> (AppliedWrench, Disturbance) {
        let failed = self.interference.failed_rotor;
        let thrusts = outputs.thrusts.map(|mut thrusts| {
            thrusts.iter_mut().skip(failed.unwrap_or(usize::MAX)).take(1).for_each(|it| *it = 0.0);
            thrusts
        });
        let wrench = match (&thrusts, failed) {
            (Some(thrusts), Some(_)) => self.rotors.wrench(thrusts),
            _ => outputs.achieved,
        };
        let push = self.interference.push.filter(|(_, end)| self.time() < *end);
        let push = push.map_or(Disturbance::NONE, |(push, _)| push);
        self.plant.command_rotors(thrusts.as_ref(), &wrench, &push)
    }

    /// The battery of the plant, if the scenario has one.
    #[must_use]
    pub fn battery(&self) -> Option<Battery> {
        self.plant.battery()
    }

    /// Takes note of a message of a station.
    pub fn hear(&mut self) {
        self.pilot.hear(self.status.uptime);
    }

    /// Watches for other hazards than those of the firmware's vehicle.
    ///
    /// # Errors
    /// Names a number that is out of its range.
    pub fn set_safety(&mut self, config: &SafetyConfig) -> Result<(), ConfigError> {
        self.control.set_safety(config)
    }

    /// Scales the limits of the rotors, and what they give, by the measured voltage.
    ///
    /// # Errors
    /// Names a number that is out of its range.
    pub fn set_battery(&mut self, config: &BatteryConfig) -> Result<(), ConfigError> {
        self.control.set_battery(config)
    }

    /// Faults from the next tick on.
    pub fn interfere(&mut self, interference: Interference) {
        self.interference = interference;
    }

    /// The vehicle as the protocol handles it.
    pub fn piloted(&mut self) -> PilotedVehicle<'_, '_, 'm> {
        let view = self.view();
        let Self { pilot, session, status, .. } = self;
        PilotedVehicle { pilot, session, status: *status, view }
    }

    fn view(&self) -> View {
        let estimates = self.control.estimates();
        let lasting = self.control.lasting().map(|lasting| shown(&lasting, &estimates));
        View {
            time: (self.time() * 1e6) as u64,
            mode: self.status.mode,
            cause: self.control.cause(),
            state: Some(self.measured),
            ready: self.control.readiness(),
            thrust: self.thrust / self.thrust_max,
            load: 0.0, // it is not the host's that matters
            battery: self.battery(),
            lasting,
        }
    }

    /// The modes of the flight.
    #[must_use]
    pub fn navigator(&self) -> &Navigator {
        self.pilot.navigator()
    }

    /// The commands of the flight.
    pub fn pilot(&mut self) -> &mut Pilot {
        &mut self.pilot
    }

    /// Mode of the supervisor.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.status.mode
    }

    /// Time since the start of the program (s).
    #[must_use]
    pub fn time(&self) -> f64 {
        self.ticks as f64 * self.period
    }

    /// Time between two ticks (s).
    #[must_use]
    pub fn step_period(&self) -> f64 {
        self.period
    }

    /// The plant's state now.
    #[must_use]
    pub fn truth(&self) -> &PlantState {
        self.plant.truth()
    }

    /// The plant.
    #[must_use]
    pub fn plant(&self) -> &GroundedVehicle {
        self.plant.grounded()
    }

    /// `true` if the control group's step ever differed from the law's, to the bit.
    #[must_use]
    pub fn differs(&self) -> bool {
        self.differs
    }
}

/// Refuses rotors that the firmware's allocation does not command.
fn check_rotors(rotors: &RotorsConfig) -> Result<(), FlyError> {
    let (given, needed) = (rotors.frame.geometry().rotors.len(), VEHICLE.geometry.rotors.len());
    if rotors.tells_law {
        return Err(PilError::TellsLaw.into());
    }
    if given == needed { Ok(()) } else { Err(FlyError::Frame { given, needed }) }
}

/// The scenario's controller with the paper's numbers for the other one.
fn tuning(controller: &ControllerConfig) -> Tuning {
    let built_in = BUILT_IN_MISSION.tuning;
    match *controller {
        ControllerConfig::RobustAdaptive(robust_adaptive) => {
            Tuning { kind: ControllerKind::RobustAdaptive, robust_adaptive, ..built_in }
        }
        ControllerConfig::Saturated(saturated) => {
            Tuning { kind: ControllerKind::Saturated, saturated, ..built_in }
        }
    }
}
