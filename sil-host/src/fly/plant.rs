//! The plant of flights under commands: on flat ground, disturbed, and seen as the scenario says.

use ctrl_core::allocation::RotorThrusts;
use ctrl_core::controller::{Auxiliary, Estimates, Intermediates, LastingEstimates, StepOutput};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::{VehicleState, Wrench};
use mavlink_vehicle::Battery;
use sim::evaluation::Evaluation;
use sim::plant::contact::{Contact, QUADROTOR};
use sim::plant::disturbance::{DisturbanceProcess, DisturbanceSource};
use sim::plant::ground::GroundedVehicle;
use sim::plant::vehicle::Plant;
use sim::plant::{AppliedWrench, Disturbance, PlantState};
use sim::scenario::Scenario;
use sim::state_source::StateSource;
use sim::tick::Tick;

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
    /// The parameter that rotors, sensors or rate filter refuse.
    pub fn new(scenario: &Scenario) -> Result<Self, FlyError> {
        let step_period = scenario.controller.step_period();
        let period = f64::from(step_period);
        let start = scenario.initial.state();
        let standing = PlantState { position_world: start.position_world.with_z(0.0), ..start };
        let contact = Contact::new(&QUADROTOR, scenario.vehicle.mass, 0.0, period);
        Ok(Self {
            grounded: GroundedVehicle::new(scenario.vehicle(standing, period)?, contact),
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

    /// Takes the wrench that is commanded at a tick; what acts from now on.
    pub fn command(&mut self, wrench: &Wrench) -> (AppliedWrench, Disturbance) {
        let applied = self.grounded.command(wrench);
        (applied, self.disturb())
    }

    /// Takes what the rotors are commanded at a tick: their thrusts, if the scenario has rotors, otherwise the wrench
    /// that these make. `push` acts beside the scenario's disturbance.
    pub fn command_rotors(
        &mut self,
        thrusts: Option<&RotorThrusts>,
        wrench: &Wrench,
        push: &Disturbance,
    ) -> (AppliedWrench, Disturbance) {
        let by_rotors = self.grounded.vehicle_mut().command_thrusts(thrusts);
        let applied = by_rotors.unwrap_or_else(|| self.grounded.command(wrench));
        let mut disturbance = self.disturb();
        disturbance.acceleration_world += push.acceleration_world;
        disturbance.torque_body += push.torque_body;
        (applied, disturbance)
    }

    fn disturb(&mut self) -> Disturbance {
        let mut disturbance = self.disturbance.advance(self.grounded.truth());
        self.grounded.add_drag(&mut disturbance);
        disturbance
    }

    /// The battery, if the scenario has one.
    pub fn battery(&self) -> Option<Battery> {
        self.grounded.battery().map(|state| Battery {
            voltage: state.voltage as f32,
            current: state.current as f32,
            remaining: state.charge as f32,
        })
    }

    /// The tick of this instant as observers receive it, before the law has told anything; `tick` and its time count from the
    /// start of the program.
    pub fn seen(
        &self,
        tick: u64,
        period: f64,
        (reference, output): (Reference, StepOutput),
        (applied, disturbance): (AppliedWrench, Disturbance),
    ) -> Tick {
        Tick {
            tick,
            time: tick as f64 * period,
            truth: *self.truth(),
            reference,
            output,
            applied,
            law: false,
            intermediates: Intermediates::default(),
            estimates: Estimates::NONE,
            auxiliary: Auxiliary::REST,
            lasting: LastingEstimates::default(),
            battery: self.grounded.battery(),
            disturbance,
            evaluation: Evaluation::default(),
        }
    }

    /// Moves on by one tick under `disturbance`.
    pub fn advance(&mut self, disturbance: &Disturbance) {
        self.grounded.advance(disturbance);
    }
}
