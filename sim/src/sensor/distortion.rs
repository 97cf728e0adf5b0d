//! Scale errors and misalignment of three axes: `y = (I + S) M x`, both drawn once per flight.

use glam::{DMat3, DVec3};

use super::random::Normal;

/// A fixed linear distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion(DMat3);

impl Distortion {
    /// Scale errors of standard deviation `scale` (1) and cross-axis couplings of `misalignment` (rad).
    #[must_use]
    pub fn new(scale: f64, misalignment: f64, mut normal: Normal) -> Self {
        let scales = DVec3::ONE + scale * normal.vector();
        let (a, b) = (misalignment * normal.vector(), misalignment * normal.vector());
        let couplings = DMat3::from_cols(
            DVec3::new(1.0, a.x, a.y),
            DVec3::new(b.x, 1.0, a.z),
            DVec3::new(b.y, b.z, 1.0),
        );
        Self(DMat3::from_diagonal(scales) * couplings)
    }

    /// The distorted vector.
    #[must_use]
    pub fn apply(&self, x: DVec3) -> DVec3 {
        self.0 * x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_and_misalignment_have_their_deviations() {
        let (mut along, mut across) = (0.0, 0.0);
        let runs = 3_000;
        for seed in 0..runs {
            let seen = Distortion::new(0.01, 0.003, Normal::new(seed, 4)).apply(DVec3::X);
            along += (seen.x - 1.0) * (seen.x - 1.0);
            across += (seen.y * seen.y + seen.z * seen.z) / 2.0;
        }
        let deviation = |sum: f64| (sum / runs as f64).sqrt();
        assert!((deviation(along) / 0.01 - 1.0).abs() < 0.05);
        assert!((deviation(across) / 0.003 - 1.0).abs() < 0.05);
        let exact = Distortion::new(0.0, 0.0, Normal::new(1, 4));
        assert_eq!(exact.apply(DVec3::new(1.0, -2.0, 3.0)), DVec3::new(1.0, -2.0, 3.0));
    }
}
