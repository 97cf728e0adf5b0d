//! One control tick of a flight, as observers receive it.

use ctrl_core::controller::{Auxiliary, Estimates, Intermediates, LastingEstimates, StepOutput};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::Wrench;
use glam::{DQuat, DVec3, Vec3};

use crate::evaluation::Evaluation;
use crate::plant::rotors::BatteryState;
use crate::plant::{AppliedWrench, Disturbance, PlantState};

/// One control tick, before the plant moves on: all fields belong to the same instant.
#[derive(Clone, Copy, Debug)]
pub struct Tick {
    /// Control ticks since the start.
    pub tick: u64,
    /// `tick` times the step period (s).
    pub time: f64,
    /// The plant's true state.
    pub truth: PlantState,
    /// The reference.
    pub reference: Reference,
    /// Output of the controller, held until the next tick.
    pub output: StepOutput,
    /// The wrench that acts on the vehicle at this instant: the command, unless the scenario has an
    /// `[actuation]`.
    pub applied: AppliedWrench,
    /// `true` under a law of the paper. Otherwise intermediate quantities, estimates and auxiliary system
    /// are at rest, and the evaluation holds the position error alone.
    pub law: bool,
    /// Every quantity of the law's evaluation; all zero when the output was held.
    pub intermediates: Intermediates,
    /// The estimates of the law before this step's update.
    pub estimates: Estimates,
    /// The auxiliary system of the law before this step's update.
    pub auxiliary: Auxiliary,
    /// The estimates of the law's integral action before this step's update.
    pub lasting: LastingEstimates,
    /// The battery, if the plant has one.
    pub battery: Option<BatteryState>,
    /// The disturbance until the next tick.
    pub disturbance: Disturbance,
    /// The Lyapunov function from the truth.
    pub evaluation: Evaluation,
}

impl Tick {
    /// No tick yet: everything at rest.
    pub(crate) fn none() -> Self {
        let output = StepOutput::from(Wrench { thrust: 0.0, torque_body: Vec3::ZERO });
        Self {
            tick: 0,
            time: 0.0,
            truth: PlantState {
                position_world: DVec3::ZERO,
                velocity_world: DVec3::ZERO,
                attitude: DQuat::IDENTITY,
                rate_body: DVec3::ZERO,
            },
            reference: Reference::hover(Vec3::ZERO),
            output,
            applied: AppliedWrench::default(),
            law: false,
            intermediates: Intermediates::default(),
            estimates: Estimates::NONE,
            auxiliary: Auxiliary::REST,
            lasting: LastingEstimates::default(),
            battery: None,
            disturbance: Disturbance::NONE,
            evaluation: Evaluation::default(),
        }
    }

    /// True position less the reference's (m).
    #[must_use]
    pub fn position_error(&self) -> DVec3 {
        self.truth.position_world - self.reference.position_world.as_dvec3()
    }
}
