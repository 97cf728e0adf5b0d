//! Lengths in `f64` by the processor's own square root.
//!
//! glam takes its roots from `libm`, as the core needs it to for `f32`. On x86-64 that is the
//! processor's instruction in the legacy encoding; amid AVX code each one costs two switches of about
//! 70 cycles. `f64::sqrt` is the same instruction in the encoding of the code around it: the same
//! bits, half the time of a monitored tick.

use glam::{DQuat, DVec3};

/// Euclidean length and direction.
pub trait Norm {
    /// Length; the bits of glam's `length`.
    fn norm(self) -> f64;
    /// Unit vector; the bits of glam's `normalize`.
    fn unit(self) -> Self;
}

impl Norm for DVec3 {
    #[inline(always)]
    fn norm(self) -> f64 {
        self.length_squared().sqrt()
    }

    #[inline(always)]
    fn unit(self) -> Self {
        self * self.norm().recip()
    }
}

impl Norm for DQuat {
    #[inline(always)]
    fn norm(self) -> f64 {
        self.length_squared().sqrt()
    }

    #[inline(always)]
    fn unit(self) -> Self {
        self * self.norm().recip()
    }
}

/// The rotation about `axis` by its length (rad); as glam's `from_scaled_axis`.
pub fn rotation_about(axis: DVec3) -> DQuat {
    let angle = axis.norm();
    if angle == 0.0 { DQuat::IDENTITY } else { DQuat::from_axis_angle(axis / angle, angle) }
}

/// `base^exponent` of a positive base: `libm::pow` takes a root in the legacy encoding.
pub fn power(base: f64, exponent: f64) -> f64 {
    libm::exp(exponent * libm::log(base))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bits_are_those_of_glam() {
        for x in [1e-300, 1e-3, 0.7, 3.0, 1e200] {
            let vector = DVec3::new(x, -0.3 * x, 1.7 * x);
            assert_eq!(vector.norm().to_bits(), vector.length().to_bits());
            assert!((power(x, 0.4) / libm::pow(x, 0.4) - 1.0).abs() < 1e-13);
            let bits = |v: DVec3| v.to_array().map(f64::to_bits);
            assert_eq!(bits(vector.unit()), bits(vector.normalize()));
        }
    }
}
