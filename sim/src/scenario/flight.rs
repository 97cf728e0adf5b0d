//! From a scenario to a vehicle at the first tick.

use ctrl_core::controller::{AnyController, TrackingController};
use ctrl_core::error::ConfigError;
use ctrl_core::trajectory::AnyTrajectory;

use super::Scenario;
use crate::closed_loop::Flight;
use crate::guarantee::Guarantees;
use crate::guarantee::lyapunov::Evaluator;
use crate::plant::actuation::Actuators;
use crate::plant::disturbance::DisturbanceProcess;
use crate::plant::rigid_body::RigidBody;
use crate::plant::rotors::Rotors;
use crate::plant::vehicle::Vehicle;
use crate::plant::{PlantParameters, PlantState};
use crate::state_source::StateSource;

/// The flight of a scenario with the controller that it configures.
pub type ScenarioFlight = Flight<AnyController, AnyTrajectory>;

impl Scenario {
    /// The vehicle at the first tick.
    ///
    /// # Errors
    /// The parameter that the controller, the trajectory, the estimator or the rate filter refuses.
    pub fn flight(&self) -> Result<ScenarioFlight, ConfigError> {
        use ctrl_core::controller::AdaptiveController;
        let controller = self.controller.build()?;
        controller.accept(&self.trajectory.build(controller.step_period())?)?;
        Ok(flight_with(controller, self)?.with_evaluator(self.evaluator()))
    }

    /// The vehicle in the state `start`, at control ticks of `step_period` (s): a rigid body, by its rotors or its
    /// actuators if the scenario has any.
    ///
    /// # Errors
    /// The parameter of the rotors that is refused.
    pub fn vehicle(&self, start: PlantState, step_period: f64) -> Result<Vehicle, ConfigError> {
        let parameters = PlantParameters::from(self.vehicle);
        let body = RigidBody::new(&parameters, step_period, self.plant_steps_per_tick);
        Ok(match &self.rotors {
            None => Vehicle::new(body, Actuators::new(&self.actuation, &parameters, &body), start),
            Some(rotors) => Vehicle::new(body, None, start).by_rotors(Rotors::new(
                rotors,
                &self.actuation,
                &parameters,
                &body,
            )?),
        })
    }

    /// The evaluator of the Lyapunov function for the configured controller on the true vehicle.
    #[must_use]
    pub fn evaluator(&self) -> Evaluator {
        Evaluator::new(&self.controller, &self.plant_parameters())
    }

    /// The monitors of a flight with the configured controller.
    #[must_use]
    pub fn monitors(&self) -> Guarantees {
        let Self { guarantees, controller, .. } = self;
        let parameters = self.plant_parameters();
        let monitors =
            Guarantees::new(guarantees, controller, &parameters, &self.effective_actuation());
        let monitors = if self.rotors.is_some() { monitors.by_rotors() } else { monitors };
        if self.receives_the_truth() { monitors } else { monitors.by_estimate() }
    }
}

/// The vehicle of `scenario` at the first tick, under a controller in place of the configured one.
///
/// # Errors
/// The parameter that the trajectory, the estimator or the rate filter refuses.
pub fn flight_with<C: TrackingController>(
    controller: C,
    scenario: &Scenario,
) -> Result<Flight<C, AnyTrajectory>, ConfigError> {
    let trajectory = scenario.trajectory.build(controller.step_period())?;
    let period = f64::from(controller.step_period());
    let disturbance = DisturbanceProcess::new(&scenario.disturbance, scenario.seed, period);
    let start = scenario.initial.state();
    let vehicle = scenario.vehicle(start, period)?;
    let source = StateSource::new(scenario, controller.step_period(), &start)?;
    Ok(Flight::new(controller, trajectory, vehicle, disturbance).with_state_source(source))
}
