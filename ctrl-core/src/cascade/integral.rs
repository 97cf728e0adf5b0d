//! Integral action: estimates of the disturbances that last, for the force and for the torque.
//!
//! ```text
//! d_hat' = Proj[-D_c, D_c]( gamma_d [G_x, G_y, 0] )       subtracted from u (13)
//! t_hat' = Proj[-D_t, D_t]( gamma_t w_e )                 subtracted from tau (34), controller 1
//! s_hat' = Proj[-D_t/J_lo, D_t/J_lo]( gamma_t w_e )       subtracted in the bracket of (50), controller 2
//! ```
//! The vertical axis has the mass instead. `docs/theory.md` has the proof.

use glam::Vec3;

use super::step_rate::{require_integrable, require_integrable_axes};
use crate::adaptation::Estimate;
use crate::config::{CascadeGains, IntegralAction};
use crate::error::Bound::{Inside, NotNegative, Positive};
use crate::error::{ConfigError, Judge, axis_names, require};
use crate::sqrt::sqrt;

/// One estimate's bounds and gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct IntegralLoop {
    /// Bound of each component.
    pub bound: Vec3,
    gain: f32,
}

/// The loops that are switched on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Integral {
    pub force: Option<IntegralLoop>,
    pub torque: Option<IntegralLoop>,
}

/// The estimates: `d_hat`, and `t_hat` or `s_hat`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct IntegralState {
    pub force: Estimate<Vec3>,
    pub torque: Estimate<Vec3>,
}

impl IntegralLoop {
    fn new(bound: Vec3, gain: f32) -> Option<Self> {
        (bound.x > 0.0).then_some(Self { bound, gain })
    }

    /// The rate of an estimate driven by `drive`: zero in components that the projection holds.
    #[inline(always)]
    pub fn rate(&self, estimate: Vec3, drive: Vec3) -> Vec3 {
        Vec3::new(
            self.component(estimate.x, drive.x, self.bound.x),
            self.component(estimate.y, drive.y, self.bound.y),
            self.component(estimate.z, drive.z, self.bound.z),
        )
    }

    #[inline(always)]
    fn component(&self, estimate: f32, drive: f32, bound: f32) -> f32 {
        let border = if drive > 0.0 { bound } else { -bound };
        if estimate == border { 0.0 } else { self.gain * drive }
    }

    /// The derivative of [`rate`](Self::rate), which was `rate`, for a drive with derivative
    /// `drive_dot`.
    #[inline(always)]
    pub fn rate_dot(&self, rate: Vec3, drive_dot: Vec3) -> Vec3 {
        let component = |rate: f32, dot: f32| if rate == 0.0 { 0.0 } else { self.gain * dot };
        Vec3::new(
            component(rate.x, drive_dot.x),
            component(rate.y, drive_dot.y),
            component(rate.z, drive_dot.z),
        )
    }

    /// Adds `increment` to an estimate; `true` if the projection acted.
    #[inline(always)]
    pub fn advance(&self, estimate: &mut Estimate<Vec3>, increment: Vec3) -> bool {
        estimate.advance(increment, -self.bound, self.bound)
    }

    /// A state's estimate from a checkpoint.
    pub fn resume(
        this: Option<&Self>,
        name: &'static str,
        value: Vec3,
    ) -> Result<Estimate<Vec3>, ConfigError> {
        let bound = this.map_or(Vec3::ZERO, |it| it.bound);
        for (component, bound) in value.to_array().into_iter().zip(bound.to_array()) {
            require(name, component, Inside(-bound, bound), "the set of the integral action")?;
        }
        Ok(Estimate::new(value))
    }
}

/// Meaning of a controller's estimate of the lasting torque.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TorqueEstimate {
    /// Quotient of a torque and the estimate: 1, or `J_lo`.
    pub divisor: Vec3,
    /// Largest gain from the estimate to `w_e'`: `1/J_lo`, or `J_hi/J_lo`.
    pub gain_max: Vec3,
}

impl Integral {
    /// `true` if any loop is switched on.
    pub fn is_on(&self) -> bool {
        self.force.is_some() || self.torque.is_some()
    }

    /// Checks `config` and prepares its loops.
    pub fn new(
        config: &IntegralAction,
        torque: TorqueEstimate,
        step_period: f32,
        gains: &CascadeGains,
        judge: &mut impl Judge,
    ) -> Result<Self, ConfigError> {
        let IntegralAction { acceleration_max, gamma_d, torque_max, gamma_t } = *config;
        // A gain without a bound does nothing: so both can be written one after the other.
        let gain = |bound: f32| if bound > 0.0 { Positive } else { NotNegative };
        let name = "integral.acceleration_max";
        judge.require(name, acceleration_max, NotNegative, "D_c")?;
        let set = gain(acceleration_max);
        judge.require("integral.gamma_d", gamma_d, set, "integral.acceleration_max D_c")?;
        judge.require("integral.torque_max", torque_max, NotNegative, "D_t")?;
        let set = gain(torque_max);
        judge.require("integral.gamma_t", gamma_t, set, "integral.torque_max D_t")?;
        let slope = gains.k2 * gains.k2 * (gains.m1 + gains.m2) + gains.k1;
        let name = "step_period * sqrt(gamma_d (k2^2 (M1 + M2) + k1))";
        require_integrable(judge, name, step_period, sqrt(gamma_d * slope))?;
        let names = axis_names!(expression "step_period * sqrt(gamma_t times its gain)");
        let square = gamma_t * torque.gain_max;
        let rate = Vec3::new(sqrt(square.x), sqrt(square.y), sqrt(square.z));
        require_integrable_axes(judge, names, step_period, rate)?;
        Ok(Self {
            force: IntegralLoop::new(Vec3::splat(acceleration_max), gamma_d),
            torque: IntegralLoop::new(torque_max / torque.divisor, gamma_t),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::assert_eq;

    const LOOP: IntegralLoop = IntegralLoop { bound: Vec3::splat(0.3), gain: 2.0 };

    #[test]
    fn the_projection_holds_what_points_outwards_at_the_border() {
        let estimate = Vec3::new(0.3, -0.3, 0.1);
        assert_eq!(LOOP.rate(estimate, Vec3::ONE), Vec3::new(0.0, 2.0, 2.0));
        assert_eq!(LOOP.rate(estimate, -Vec3::ONE), Vec3::new(-2.0, 0.0, -2.0));
        let held = LOOP.rate(estimate, Vec3::ONE);
        assert_eq!(LOOP.rate_dot(held, Vec3::splat(3.0)), Vec3::new(0.0, 6.0, 6.0));
    }

    #[test]
    fn an_estimate_stays_inside_its_bound() {
        let mut estimate = Estimate::new(Vec3::ZERO);
        assert!(!LOOP.advance(&mut estimate, Vec3::new(0.2, -0.2, 0.0)));
        assert!(LOOP.advance(&mut estimate, Vec3::new(0.2, -0.2, 0.1)));
        assert_eq!(estimate.value(), Vec3::new(0.3, -0.3, 0.1));
    }

    #[test]
    fn a_checkpoint_outside_the_set_is_refused_by_name() {
        let name = "checkpoint.lasting.torque_body";
        let value = Vec3::new(0.0, 0.31, 0.0);
        let error = IntegralLoop::resume(Some(&LOOP), name, value).unwrap_err();
        assert_eq!((error.parameter, error.value), (name, 0.31));
        let error = IntegralLoop::resume(None, name, Vec3::splat(1e-6)).unwrap_err();
        assert_eq!(error.bound, Inside(0.0, 0.0));
    }
}
