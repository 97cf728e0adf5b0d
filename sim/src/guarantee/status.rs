//! No step of the controller reports a fault.

use ctrl_core::controller::StepStatus;

use super::Monitor;
use super::verdict::{Extreme, Requirement, Verdict};
use crate::observer::Observer;
use crate::tick::Tick;

/// Counts the steps with a flag of [`StepStatus::FAULT`]; none is allowed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Faults {
    count: u64,
    latest: Extreme,
}

impl Observer for Faults {
    fn observe(&mut self, tick: &Tick) {
        self.count += u64::from(tick.output.status.intersects(StepStatus::FAULT));
        self.latest.highest(self.count as f64, tick.time);
    }
}

impl Monitor for Faults {
    fn verdicts(&self) -> Vec<Verdict> {
        let row = ("steps with a fault", "-", "steps");
        vec![Verdict::new(row, Requirement::AtMost(0.0), self.latest)]
    }
}
