//! Conditions at every tick: finite numbers, thrust, torque, estimates, no fault.

use ctrl_core::controller::ControllerConfig;
use ctrl_core::controller::{Estimates, StepStatus};
use ctrl_core::vehicle::{Interval, VectorInterval, Wrench};
use glam::{DVec3, Vec3};
use sim::guarantee::bounds::ThrustBounds;
use sim::plant::PlantState;
use sim::tick::Tick;

/// Relative difference that rounding to `f32`, and taking a reciprocal, may make.
const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

/// The bounds of one controller's configuration, in `f64` from the inequalities themselves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    thrust: (f64, f64),
    torque: Vec3,
    mass: Interval,
    inertia: VectorInterval,
    saturated: bool,
}

/// A bound that did not hold at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breach {
    /// The condition.
    pub what: &'static str,
    /// Its time (s).
    pub time: f64,
}

impl Limits {
    pub(super) fn new(law: &ControllerConfig) -> Self {
        let upper = law.thrust_upper_bound() * (1.0 + ROUNDING);
        let lower = law.thrust_lower_bound() * (1.0 - ROUNDING);
        let known = law.uncertainty();
        Self {
            // (19); the lesser of (20) and M_f (7)
            thrust: (
                lower,
                law.thrust_max().map(f64::from).map_or(upper, |limit| limit.min(upper)),
            ),
            torque: law.torque_max().unwrap_or(Vec3::MAX), // (8)
            mass: known.mass,
            inertia: known.inertia,
            saturated: matches!(law, ControllerConfig::Saturated(_)),
        }
    }

    /// The first bound that `tick` does not keep.
    pub(super) fn breach(&self, tick: &Tick) -> Option<Breach> {
        let Tick { truth, output, estimates, .. } = tick;
        let checks = [
            ("finite truth", finite(truth)),
            ("thrust", self.holds_thrust(&output.wrench)),
            ("torque", self.holds_torque(&output.wrench)),
            ("mass estimate", inside(1.0 / f64::from(estimates.inverse_mass), self.mass)),
            ("inertia estimate", self.holds_inertia(estimates)),
            ("no fault", !output.status.intersects(StepStatus::FAULT)),
        ];
        let (what, _) = checks.into_iter().find(|&(_, holds)| !holds)?;
        Some(Breach { what, time: tick.time })
    }

    fn holds_thrust(&self, wrench: &Wrench) -> bool {
        let thrust = f64::from(wrench.thrust);
        thrust > 0.0 && self.thrust.0 <= thrust && thrust <= self.thrust.1
    }

    fn holds_torque(&self, wrench: &Wrench) -> bool {
        wrench.torque_body.abs().cmple(self.torque).all()
    }

    /// `a_hat` (35), or `theta_hat` (51) and `Pi_hat` (52).
    fn holds_inertia(&self, estimates: &Estimates) -> bool {
        if !self.saturated {
            return self.inside_each(estimates.inertia.as_dvec3());
        }
        let ratio = estimates.gyroscopic_ratio.to_array();
        self.inside_each(estimates.inverse_inertia.as_dvec3().recip())
            && ratio.into_iter().all(|pi| pi.abs() <= 1.0)
    }

    fn inside_each(&self, inertia: DVec3) -> bool {
        let axes = inertia.to_array().into_iter().zip(self.inertia.axes());
        axes.into_iter().all(|(j, set)| inside(j, set))
    }
}

/// `true` if `x` is in `set`, up to rounding; NaN is not.
fn inside(x: f64, set: Interval) -> bool {
    f64::from(set.lower) * (1.0 - ROUNDING) <= x && x <= f64::from(set.upper) * (1.0 + ROUNDING)
}

fn finite(truth: &PlantState) -> bool {
    let PlantState { position_world, velocity_world, attitude, rate_body } = truth;
    position_world.is_finite()
        && velocity_world.is_finite()
        && attitude.is_finite()
        && rate_body.is_finite()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Case;
    use sim::observer::Observer;

    struct Last(Option<Tick>);

    impl Observer for Last {
        fn observe(&mut self, tick: &Tick) {
            self.0 = Some(*tick);
        }
    }

    /// Condition that the first tick of a built-in scenario violates after it was tampered with.
    fn found(name: &str, tamper: impl FnOnce(&mut Tick)) -> Option<&'static str> {
        let scenario = Case::built_in(name).scenario;
        let mut last = Last(None);
        scenario.flight().unwrap().observe(1, &mut last);
        let mut tick = last.0.unwrap();
        tamper(&mut tick);
        Limits::new(&scenario.controller).breach(&tick).map(|breach| breach.what)
    }

    #[test]
    fn each_broken_bound_is_found() {
        for name in ["paper-robust-adaptive", "paper-saturated"] {
            assert_eq!(found(name, |_| {}), None);
            let nan = found(name, |tick| tick.truth.rate_body.y = f64::NAN);
            assert_eq!(nan, Some("finite truth"));
            for thrust in [0.0, -1.0, 60.0, f32::NAN] {
                let seen = found(name, |tick| tick.output.wrench.thrust = thrust);
                assert_eq!(seen, Some("thrust"), "{thrust}");
            }
            for inverse_mass in [0.99, 1.43, f32::NAN] {
                let seen = found(name, |tick| tick.estimates.inverse_mass = inverse_mass);
                assert_eq!(seen, Some("mass estimate"), "{inverse_mass}");
            }
            let fault = found(name, |tick| tick.output.status |= StepStatus::OUTPUT_HELD);
            assert_eq!(fault, Some("no fault"));
        }
        let first = found("paper-robust-adaptive", |tick| tick.estimates.inertia.z = 0.121);
        assert_eq!(first, Some("inertia estimate"));
        let second = |tamper: fn(&mut Tick)| found("paper-saturated", tamper);
        let estimate = Some("inertia estimate");
        assert_eq!(second(|tick| tick.estimates.inverse_inertia.x = 34.0), estimate);
        assert_eq!(second(|tick| tick.estimates.gyroscopic_ratio.y = -1.01), estimate);
        assert_eq!(second(|tick| tick.output.wrench.torque_body.z = -0.0501), Some("torque"));
        assert_eq!(second(|tick| tick.output.wrench.torque_body.x = f32::NAN), Some("torque"));
    }
}
