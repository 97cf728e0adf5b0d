//! From a scenario to a vehicle at the first tick.

use ctrl_core::controller::{AnyController, TrackingController};
use ctrl_core::error::ConfigError;
use ctrl_core::trajectory::AnyTrajectory;

use super::Scenario;
use crate::closed_loop::Flight;
use crate::guarantee::Guarantees;
use crate::guarantee::lyapunov::Evaluator;
use crate::plant::PlantParameters;
use crate::plant::actuation::Actuators;
use crate::plant::disturbance::DisturbanceProcess;
use crate::plant::rigid_body::RigidBody;
use crate::plant::vehicle::Vehicle;
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
    let parameters = PlantParameters::from(scenario.vehicle);
    let body = RigidBody::new(&parameters, period, scenario.plant_steps_per_tick);
    let actuators = Actuators::new(&scenario.actuation, &parameters, &body);
    let disturbance = DisturbanceProcess::new(&scenario.disturbance, scenario.seed, period);
    let start = scenario.initial.state();
    let vehicle = Vehicle::new(body, actuators, start);
    let source = StateSource::new(scenario, controller.step_period(), &start)?;
    Ok(Flight::new(controller, trajectory, vehicle, disturbance).with_state_source(source))
}
