//! The plant of flights under commands: on flat ground, disturbed, and seen as the scenario says.

use ctrl_core::vehicle::{VehicleState, Wrench};
use sim::plant::actuation::Actuators;
use sim::plant::disturbance::{DisturbanceProcess, DisturbanceSource};
use sim::plant::ground::GroundedVehicle;
use sim::plant::rigid_body::RigidBody;
use sim::plant::vehicle::Plant;
use sim::plant::{AppliedWrench, Disturbance, PlantParameters, PlantState};
use sim::scenario::Scenario;
use sim::state_source::StateSource;

use super::error::FlyError;

/// See the module's documentation.
#[derive(Debug)]
pub(super) struct FlownPlant {
    grounded: GroundedVehicle,
    disturbance: DisturbanceProcess,
    source: StateSource,
}

impl FlownPlant {
    /// The vehicle of `scenario`, standing below its initial position.
    ///
    /// # Errors
    /// The parameter that sensors or rate filter refuse.
    pub fn new(scenario: &Scenario) -> Result<Self, FlyError> {
        let step_period = scenario.controller.step_period();
        let period = f64::from(step_period);
        let parameters = PlantParameters::from(scenario.vehicle);
        let body = RigidBody::new(&parameters, period, scenario.plant_steps_per_tick);
        let actuators = Actuators::new(&scenario.actuation, &parameters, &body);
        let start = scenario.initial.state();
        let standing = PlantState { position_world: start.position_world.with_z(0.0), ..start };
        Ok(Self {
            grounded: GroundedVehicle::new(body, actuators, standing, 0.0),
            disturbance: DisturbanceProcess::new(&scenario.disturbance, scenario.seed, period),
            source: StateSource::new(scenario, step_period, &standing)?,
        })
    }

    /// The true state now.
    pub fn truth(&self) -> &PlantState {
        self.grounded.truth()
    }

    /// The vehicle on its ground.
    pub fn grounded(&self) -> &GroundedVehicle {
        &self.grounded
    }

    /// The state that the vehicle receives. Called once per tick.
    pub fn measure(&mut self) -> VehicleState {
        self.source.measure(self.grounded.truth())
    }

    /// Takes the command of a tick; what acts from now on.
    pub fn command(&mut self, wrench: &Wrench) -> (AppliedWrench, Disturbance) {
        let disturbance = self.disturbance.advance(self.grounded.truth());
        (self.grounded.command(wrench), disturbance)
    }

    /// Moves on by one tick under `disturbance`.
    pub fn advance(&mut self, disturbance: &Disturbance) {
        self.grounded.advance(disturbance);
    }
}
