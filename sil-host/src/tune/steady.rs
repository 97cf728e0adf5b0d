//! Disturbances that last, and the bounds of the integral action against them.

use ctrl_core::config::IntegralAction;
use ctrl_core::vehicle::{GRAVITY, Uncertainty};
use serde::Serialize;

use super::digits::rounded_up;

const G: f64 = GRAVITY as f64;

/// Disturbances that last, on top of `D1` and `D2`: what integral action is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Steady {
    /// Acceleration along each horizontal axis (m/s^2); zero for no estimate of it.
    pub acceleration: f64,
    /// Torque about each axis (N m); zero for no estimate of it.
    pub torque: f64,
}

/// A gain that the constructor accepts, until the one to propose is found.
const PROVISIONAL: f64 = 1e-6;

impl Steady {
    /// What a law with this integral action bears, where `D1` and `M_p` are `bounds`.
    #[must_use]
    pub fn borne(integral: &IntegralAction, bounds: &HorizontalBounds) -> Self {
        let acceleration = bounds.borne(integral.acceleration_max.into());
        Self { acceleration, torque: integral.torque_max.into() }
    }

    /// `true` if nothing lasts.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Integral action with the bounds for it, where `D1` and `M_p` are `bounds`.
    pub(super) fn bounded(&self, bounds: &HorizontalBounds) -> IntegralAction {
        let gain = |on: f64| if on > 0.0 { PROVISIONAL as f32 } else { 0.0 };
        IntegralAction {
            acceleration_max: rounded_up(bounds.needed(self.acceleration)) as f32,
            gamma_d: gain(self.acceleration),
            torque_max: self.torque as f32,
            gamma_t: gain(self.torque),
        }
    }
}

/// Bounds that say how far the estimate of a lasting push goes beyond the push itself (`docs/theory.md`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HorizontalBounds {
    /// `D1` (m/s^2).
    pub disturbance: f64,
    /// `M_p` (m/s^2).
    pub reference: f64,
}

impl HorizontalBounds {
    /// The bounds of a vehicle that follows references within `reference_acceleration_max` (m/s^2).
    #[must_use]
    pub fn new(known: &Uncertainty, reference_acceleration_max: f32) -> Self {
        let disturbance = known.disturbance_acceleration.into();
        Self { disturbance, reference: reference_acceleration_max.into() }
    }

    /// `D1/(g - M_p - D1)`: a vertical push within `D1` moves the mass estimate by so much at most.
    fn mass_error(&self) -> f64 {
        self.disturbance / (G - self.reference - self.disturbance)
    }

    /// `D_c` for a push (m/s^2); zero for none.
    fn needed(&self, push: f64) -> f64 {
        if push > 0.0 { push + self.mass_error() * (push + self.reference) } else { 0.0 }
    }

    /// The push that `D_c` (m/s^2) has room for.
    fn borne(&self, bound: f64) -> f64 {
        let error = self.mass_error();
        ((bound - error * self.reference) / (1.0 + error)).max(0.0)
    }
}
