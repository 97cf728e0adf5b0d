//! Excursion of the auxiliary system of controller 2 (38), (39).

use ctrl_core::controller::Auxiliary;

use super::Monitor;
use super::verdict::{Extreme, Requirement, Verdict};
use crate::norm::Norm;
use crate::observer::Observer;
use crate::tick::Tick;
use ctrl_core::controller::ControllerConfig;

/// Information: peak and latest angle of `q_a` and length of `w_a`; rest is zero for both.
#[derive(Clone, Copy, Debug)]
pub struct AuxiliaryRest {
    shown: bool,
    /// The auxiliary system when its attitude was furthest from rest, and the time (s).
    peak: Option<(Auxiliary, f64)>,
    latest: (Auxiliary, f64),
}

impl AuxiliaryRest {
    /// Rows only for controller 2.
    #[must_use]
    pub fn new(law: &ControllerConfig) -> Self {
        let shown = matches!(law, ControllerConfig::Saturated(_));
        Self { shown, peak: None, latest: (Auxiliary::REST, 0.0) }
    }
}

impl Observer for AuxiliaryRest {
    fn observe(&mut self, tick: &Tick) {
        if !self.shown {
            return;
        }
        self.latest = (tick.auxiliary, tick.time);
        let sine = tick.auxiliary.attitude.xyz().length_squared();
        let beyond = |(peak, _): (Auxiliary, f64)| sine > peak.attitude.xyz().length_squared();
        if self.peak.is_none_or(beyond) {
            self.peak = Some(self.latest);
        }
    }
}

impl Monitor for AuxiliaryRest {
    fn verdicts(&self) -> Vec<Verdict> {
        if !self.shown {
            return Vec::new();
        }
        let row = |name, equation, unit, extreme| {
            Verdict::new((name, equation, unit), Requirement::Information, extreme)
        };
        let turn = |(auxiliary, time): (Auxiliary, f64)| {
            let attitude = auxiliary.attitude.as_dquat();
            Extreme::at(super::tracking::rotation_angle(attitude), time)
        };
        let rate = self.latest.0.rate.as_dvec3().norm();
        let peak = self.peak.map(turn).unwrap_or_default();
        vec![
            row("auxiliary attitude, peak angle", "(38)", "rad", peak),
            row("auxiliary attitude at the end", "(38)", "rad", turn(self.latest)),
            row("auxiliary rate at the end", "(39)", "rad/s", Extreme::at(rate, self.latest.1)),
        ]
    }
}
