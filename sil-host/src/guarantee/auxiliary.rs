//! Where the auxiliary system of controller 2 went and where it is now (38), (39).

use glam::Quat;

use super::Monitor;
use super::lyapunov::Evaluation;
use super::verdict::{Extreme, Requirement, Verdict};
use crate::sample::Sample;
use crate::scenario::ControllerConfig;

/// Information: peak and latest angle of `q_a` and length of `w_a`; rest is zero for both.
#[derive(Clone, Copy, Debug)]
pub struct AuxiliaryRest {
    shown: bool,
    peak_angle: Extreme,
    latest_angle: Extreme,
    latest_rate: Extreme,
}

impl AuxiliaryRest {
    /// Rows only for controller 2.
    #[must_use]
    pub fn new(law: &ControllerConfig) -> Self {
        let none = Extreme::default();
        let shown = matches!(law, ControllerConfig::Saturated(_));
        Self { shown, peak_angle: none, latest_angle: none, latest_rate: none }
    }
}

/// Rotation angle of the auxiliary attitude [rad].
fn angle(attitude: Quat) -> f64 {
    super::tracking::rotation_angle(attitude.as_dquat())
}

impl Monitor for AuxiliaryRest {
    fn observe(&mut self, sample: &Sample, _: &Evaluation) {
        if !self.shown {
            return;
        }
        let (angle, rate) = (angle(sample.auxiliary.attitude), sample.auxiliary.rate.as_dvec3());
        self.peak_angle.highest(angle, sample.time);
        self.latest_angle = Extreme::at(angle, sample.time);
        self.latest_rate = Extreme::at(rate.length(), sample.time);
    }

    fn verdicts(&self) -> Vec<Verdict> {
        if !self.shown {
            return Vec::new();
        }
        let row = |name, equation, unit, extreme| {
            Verdict::new((name, equation, unit), Requirement::Information, extreme)
        };
        vec![
            row("auxiliary attitude, peak angle", "(38)", "rad", self.peak_angle),
            row("auxiliary attitude at the end", "(38)", "rad", self.latest_angle),
            row("auxiliary rate at the end", "(39)", "rad/s", self.latest_rate),
        ]
    }
}
