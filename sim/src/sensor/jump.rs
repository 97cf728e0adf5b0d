//! Jumps of a position source: with a mean rate it steps aside by a vector, and back after a while.

use crate::norm::Norm;
use glam::DVec3;

use super::random::Normal;

/// Jumps in progress.
#[derive(Clone, Debug)]
pub struct Jumps {
    /// Probability per sample that one begins.
    probability: f64,
    size: f64,
    /// Samples that one lasts.
    length: u64,
    left: u64,
    offset: DVec3,
    normal: Normal,
}

impl Jumps {
    /// On average one per `interval` (s), none for an infinite one; `size` (m) in a random direction over
    /// `length` (s), in samples each `period` (s).
    #[must_use]
    pub fn new(interval: f64, size: f64, length: f64, period: f64, normal: Normal) -> Self {
        let length = (length / period).round().max(1.0) as u64;
        Self { probability: period / interval, size, length, left: 0, offset: DVec3::ZERO, normal }
    }

    /// The offset of the next sample.
    pub fn advance(&mut self) -> DVec3 {
        if self.left > 0 {
            self.left -= 1;
        } else if self.probability > 0.0 && self.normal.uniform() < self.probability {
            self.left = self.length - 1;
            self.offset = self.size * direction(self.normal.vector());
        } else {
            self.offset = DVec3::ZERO;
        }
        self.offset
    }
}

/// Unit vector along `vector`; x where that has none.
fn direction(vector: DVec3) -> DVec3 {
    if vector == DVec3::ZERO { DVec3::X } else { vector.unit() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jumps_have_their_size_length_and_rate() {
        let mut jumps = Jumps::new(10.0, 7.0, 0.5, 0.1, Normal::new(1, 3));
        let (mut begun, mut jumped, mut before) = (0, 0, DVec3::ZERO);
        let n = 100_000;
        for _ in 0..n {
            let offset = jumps.advance();
            begun += i32::from(offset != DVec3::ZERO && offset != before);
            if offset != DVec3::ZERO {
                jumped += 1;
                assert!((offset.length() - 7.0).abs() < 1e-12);
            }
            before = offset;
        }
        // Renewals: one per 99 calm samples in the mean and 5 of the jump.
        let expected = f64::from(n) / 104.0;
        assert!((f64::from(begun) / expected - 1.0).abs() < 0.1, "{begun}");
        assert!((f64::from(jumped) / f64::from(begun) - 5.0).abs() < 0.1);
        let mut never = Jumps::new(f64::INFINITY, 7.0, 0.5, 0.1, Normal::new(1, 3));
        assert!((0..10_000).all(|_| never.advance() == DVec3::ZERO));
    }
}
