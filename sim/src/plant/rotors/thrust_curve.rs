//! Static thrust curve of the rotors, as it is and as the mixer takes it to be.
//!
//! ```text
//! T/T_max = (1 - q) u + q u^2
//! ```
//!
//! The mixer inverts the curve that it assumes; the rotors give the thrust of the true one.

use ctrl_core::allocation::ThrustCurve;
use ctrl_core::error::ConfigError;
use serde::{Deserialize, Serialize};

/// Thrust over throttle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThrustCurveConfig {
    /// `q` of the rotors: the part of `u^2`, in [0, 1].
    pub quadratic: f64,
    /// `q` that the mixer assumes, in [0, 1]; the same as the rotors' where it is absent.
    pub assumed: Option<f64>,
}

impl ThrustCurveConfig {
    /// Speed follows the throttle, and the mixer knows it.
    pub const SQUARE: Self = Self { quadratic: 1.0, assumed: None };

    /// `true` if the mixer's curve is that of the rotors.
    #[must_use]
    pub fn is_known(&self) -> bool {
        self.assumed.is_none_or(|assumed| assumed == self.quadratic)
    }

    /// The curve of the mixer.
    ///
    /// # Errors
    /// When its quadratic part is outside [0, 1].
    pub fn assumed(&self) -> Result<ThrustCurve, ConfigError> {
        ThrustCurve::new(self.assumed.unwrap_or(self.quadratic) as f32)
    }

    /// Part of the largest thrust at a throttle in [0, 1].
    #[must_use]
    pub fn share(&self, throttle: f64) -> f64 {
        throttle * (1.0 - self.quadratic + self.quadratic * throttle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thrust_is_the_assumed_one_for_the_true_curve_and_the_closed_form_for_another() {
        for quadratic in [0.0, 0.4, 1.0] {
            let known = ThrustCurveConfig { quadratic, assumed: None };
            let square = ThrustCurveConfig { quadratic, assumed: Some(1.0) };
            let (own, root) = (known.assumed().unwrap(), square.assumed().unwrap());
            for i in 0..=100u8 {
                let asked = f32::from(i) / 100.0;
                let made = known.share(own.throttle(asked).into());
                assert!((made - f64::from(asked)).abs() < 3e-7, "{quadratic} {asked} {made}");
                // u = sqrt(s), so (1 - q) sqrt(s) + q s.
                let s = f64::from(asked);
                let expected = (1.0 - quadratic) * s.sqrt() + quadratic * s;
                let made = square.share(root.throttle(asked).into());
                assert!((made - expected).abs() < 3e-7, "{quadratic} {asked} {made} {expected}");
            }
            assert!(known.is_known());
            assert_eq!(square.is_known(), quadratic == 1.0);
        }
        let bad = ThrustCurveConfig { quadratic: 0.5, assumed: Some(1.5) };
        assert_eq!(bad.assumed().unwrap_err().parameter, "thrust_curve.quadratic");
    }
}
