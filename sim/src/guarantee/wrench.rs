//! Thrust (19), (20), (7) and torque (8): the commands that the plant is given.

use super::verdict::{Extreme, Requirement, Verdict};
use super::{Monitor, ROUNDING};
use crate::guarantee::bounds::ThrustBounds;
use crate::observer::Observer;
use crate::tick::Tick;
use ctrl_core::controller::ControllerConfig;

/// The thrust stays positive, above (19), below (20), and below `M_f` where there is one.
#[derive(Clone, Copy, Debug)]
pub struct Thrust {
    lower: f64,
    upper: f64,
    limit: Option<f64>,
    lowest: Extreme,
    highest: Extreme,
}

impl Thrust {
    /// With the bounds of `law`.
    #[must_use]
    pub fn new(law: &ControllerConfig) -> Self {
        Self {
            lower: law.thrust_lower_bound() * (1.0 - ROUNDING),
            upper: law.thrust_upper_bound() * (1.0 + ROUNDING),
            limit: law.thrust_max().map(f64::from),
            lowest: Extreme::default(),
            highest: Extreme::default(),
        }
    }
}

impl Observer for Thrust {
    fn observe(&mut self, tick: &Tick) {
        let thrust = f64::from(tick.output.wrench.thrust);
        self.lowest.lowest(thrust, tick.time);
        self.highest.highest(thrust, tick.time);
    }
}

impl Monitor for Thrust {
    fn verdicts(&self) -> Vec<Verdict> {
        let at_most = Requirement::AtMost;
        let mut rows = vec![
            Verdict::new(
                ("thrust, lowest", "(19)", "N"),
                Requirement::AtLeast(self.lower.max(f64::MIN_POSITIVE)),
                self.lowest,
            ),
            Verdict::new(("thrust, highest", "(20)", "N"), at_most(self.upper), self.highest),
        ];
        rows.extend(self.limit.map(|limit| {
            Verdict::new(("thrust, highest, against M_f", "(7)", "N"), at_most(limit), self.highest)
        }));
        rows
    }
}

/// The torque about each axis stays inside its `M_tau`; without such a limit the peak is reported.
#[derive(Clone, Copy, Debug)]
pub struct Torque {
    limits: Option<[f64; 3]>,
    peaks: [Extreme; 3],
}

impl Torque {
    /// With the limit of `law`.
    #[must_use]
    pub fn new(law: &ControllerConfig) -> Self {
        let limits = law.torque_max().map(|limits| limits.as_dvec3().to_array());
        Self { limits, peaks: [Extreme::default(); 3] }
    }
}

impl Observer for Torque {
    fn observe(&mut self, tick: &Tick) {
        let torque = tick.output.wrench.torque_body.to_array();
        for (peak, component) in self.peaks.iter_mut().zip(torque) {
            peak.highest(f64::from(component.abs()), tick.time);
        }
    }
}

impl Monitor for Torque {
    fn verdicts(&self) -> Vec<Verdict> {
        let (requirements, equation) = match self.limits {
            Some(limits) => (limits.map(Requirement::AtMost), "(8)"),
            None => ([Requirement::Information; 3], "(34)"),
        };
        let names = ["torque about x, peak", "torque about y, peak", "torque about z, peak"];
        let row =
            |(name, (requirement, peak))| Verdict::new((name, equation, "N m"), requirement, peak);
        names.into_iter().zip(requirements.into_iter().zip(self.peaks)).map(row).collect()
    }
}
