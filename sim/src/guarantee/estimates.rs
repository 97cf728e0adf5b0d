//! Every estimate stays inside its set: (14), (35), (51), (52), and those of the integral action.

use ctrl_core::vehicle::Interval;
use glam::Vec3;

use super::ROUNDING;
use super::block::Block;
use super::verdict::{AxisExtremes, Extreme, Requirement, Verdict};
use crate::lanes::Scalars;
use ctrl_core::controller::ControllerConfig;

/// The projections hold: mass, inertia (both laws report it) and gyroscopic ratios (controller 2).
#[derive(Clone, Copy, Debug)]
pub(crate) struct EstimateSets {
    mass: (Requirement, Extreme),
    inertia: AxisExtremes,
    ratio: Option<(Requirement, Extreme)>,
    lasting: [Option<AxisExtremes>; 2],
    equations: [&'static str; 2],
}

impl EstimateSets {
    /// With the sets of `law`.
    #[must_use]
    pub fn new(law: &ControllerConfig) -> Self {
        let ratio = (Requirement::Inside(-1.0, 1.0), Extreme::default());
        let (ratio, inertia_equation) = match law {
            ControllerConfig::RobustAdaptive(_) => (None, "(35)"),
            ControllerConfig::Saturated(_) => (Some(ratio), "(51)"),
        };
        let uncertainty = law.uncertainty();
        Self {
            mass: (set(uncertainty.mass), Extreme::default()),
            inertia: AxisExtremes::new(uncertainty.inertia.axes().map(set)),
            ratio,
            lasting: lasting_sets(law),
            equations: ["(14)", inertia_equation],
        }
    }
}

/// The sets of the integral action that are switched on: of `d_hat`, and of `t_hat` or `s_hat`.
fn lasting_sets(law: &ControllerConfig) -> [Option<AxisExtremes>; 2] {
    let integral = law.integral();
    let set = |bounds: Vec3| {
        let inside = |bound: f32| {
            let bound = f64::from(bound) * (1.0 + ROUNDING);
            Requirement::Inside(-bound, bound)
        };
        (bounds.x > 0.0).then(|| AxisExtremes::new(bounds.to_array().map(inside)))
    };
    let divisor = match law {
        ControllerConfig::RobustAdaptive(_) => Vec3::ONE,
        ControllerConfig::Saturated(_) => law.uncertainty().inertia.lower,
    };
    [set(Vec3::splat(integral.acceleration_max)), set(integral.torque_max / divisor)]
}

/// The interval, widened by what rounding to `f32` and taking a reciprocal may do.
fn set(interval: Interval) -> Requirement {
    Requirement::Inside(
        f64::from(interval.lower) * (1.0 - ROUNDING),
        f64::from(interval.upper) * (1.0 + ROUNDING),
    )
}

impl EstimateSets {
    /// Observes the estimates of a block.
    pub fn observe(&mut self, block: &Block) {
        let law = &block.law;
        let mass = law.inverse_mass.recip();
        let (requirement, extreme) = &mut self.mass;
        extreme.tightest_of(&[mass], block, *requirement);
        let (inertia, torque) = match self.ratio {
            None => (law.inertia, law.lasting_torque),
            Some(_) => (law.inverse_inertia.map(Scalars::recip), law.lasting_angular_acceleration),
        };
        self.inertia.observe_block(inertia, block);
        if let Some((requirement, extreme)) = &mut self.ratio {
            extreme.tightest_of(&law.gyroscopic_ratio.to_array(), block, *requirement);
        }
        for (set, estimate) in self.lasting.iter_mut().zip([law.lasting_acceleration, torque]) {
            if let Some(extremes) = set {
                extremes.observe_block(estimate, block);
            }
        }
    }

    /// The rows of the table so far.
    #[must_use]
    pub fn verdicts(&self) -> Vec<Verdict> {
        let [mass, inertia] = self.equations;
        let row = |name, equation, unit, (requirement, extreme)| {
            Verdict::new((name, equation, unit), requirement, extreme)
        };
        let mut rows = vec![
            row("mass estimate", mass, "kg", self.mass),
            row("inertia estimate", inertia, "kg m^2", self.inertia.tightest()),
        ];
        rows.extend(self.ratio.map(|ratio| row("gyroscopic ratio estimate", "(52)", "-", ratio)));
        let [acceleration, torque] = self.lasting;
        let name = "lasting acceleration estimate";
        rows.extend(acceleration.map(|it| row(name, "integral action", "m/s^2", it.tightest())));
        let (name, unit) = match self.ratio {
            None => ("lasting torque estimate", "N m"),
            Some(_) => ("lasting torque estimate by inertia", "rad/s^2"),
        };
        rows.extend(torque.map(|it| row(name, "integral action", unit, it.tightest())));
        rows
    }
}
