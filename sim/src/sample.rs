//! Everything about one tick of a flight, as observers see it.

use ctrl_core::controller::{Auxiliary, Estimates, Intermediates, StepOutput};
use ctrl_core::reference::Reference;

use crate::plant::{AppliedWrench, Disturbance, PlantState};

/// One control tick, before the plant moves on: all fields belong to the same instant.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Control ticks since the start.
    pub tick: u64,
    /// `tick` times the step period (s).
    pub time: f64,
    /// The plant's state.
    pub truth: PlantState,
    /// What the vehicle should do.
    pub reference: Reference,
    /// What the controller commands until the next tick.
    pub output: StepOutput,
    /// What really acts on the vehicle at this instant: the command, unless the scenario has an
    /// `[actuation]`.
    pub applied: AppliedWrench,
    /// Every quantity of the law's evaluation; all zero when the controller held its output.
    pub intermediates: Intermediates,
    /// The estimates that the law used, before this step's update.
    pub estimates: Estimates,
    /// The auxiliary system that the law used, before this step's update.
    pub auxiliary: Auxiliary,
    /// What disturbs the plant until the next tick.
    pub disturbance: Disturbance,
}
