//! Disturbances that last, and the bounds of the integral action against them.

use ctrl_core::config::IntegralAction;
use ctrl_core::vehicle::GRAVITY;
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
    /// What a law with this integral action bears, where `D1` is `disturbance` (m/s^2).
    #[must_use]
    pub fn borne(integral: &IntegralAction, disturbance: f64) -> Self {
        Self {
            acceleration: f64::from(integral.acceleration_max) / room(disturbance),
            torque: integral.torque_max.into(),
        }
    }

    /// `true` if nothing lasts.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Integral action with the bounds for it, where `D1` is `disturbance` (m/s^2).
    pub(super) fn bounded(&self, disturbance: f64) -> IntegralAction {
        let gain = |on: f64| if on > 0.0 { PROVISIONAL as f32 } else { 0.0 };
        IntegralAction {
            acceleration_max: rounded_up(self.acceleration * room(disturbance)) as f32,
            gamma_d: gain(self.acceleration),
            torque_max: self.torque as f32,
            gamma_t: gain(self.torque),
        }
    }
}

/// `1 + D1/g`: a vertical push within `D1` moves the mass estimate by so much, and the estimate of the horizontal one
/// with it (`docs/theory.md`).
fn room(disturbance: f64) -> f64 {
    1.0 + disturbance / G
}
