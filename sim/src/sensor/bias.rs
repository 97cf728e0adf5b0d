//! Bias of a sensor: an offset drawn at the start, and a random walk from there.

use glam::DVec3;

use super::random::Normal;

/// A bias in progress.
#[derive(Clone, Debug)]
pub struct Bias {
    now: DVec3,
    /// Standard deviation of a step of the walk.
    step: f64,
    normal: Normal,
}

impl Bias {
    /// With an offset of standard deviation `offset`, and a walk of `walk` per square root of a second, in
    /// steps of `period` (s).
    #[must_use]
    pub fn new(offset: f64, walk: f64, period: f64, mut normal: Normal) -> Self {
        Self { now: offset * normal.vector(), step: walk * period.sqrt(), normal }
    }

    /// The bias now.
    #[must_use]
    pub fn now(&self) -> DVec3 {
        self.now
    }

    /// Moves on by one step; returns the bias before it.
    pub fn advance(&mut self) -> DVec3 {
        let now = self.now;
        self.now += self.step * self.normal.vector();
        now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offset_and_walk_have_their_variances() {
        let (mut start, mut walked) = (0.0, 0.0);
        let runs = 2_000;
        for seed in 0..runs {
            let mut bias = Bias::new(0.2, 0.05, 0.01, Normal::new(seed, 0));
            let first = bias.now();
            start += first.length_squared() / 3.0;
            (0..400).for_each(|_| _ = bias.advance());
            walked += (bias.now() - first).length_squared() / 3.0;
        }
        let n = runs as f64;
        // 4 s of 0.05 per root second; each mean of 6,000 squares is good to 5 %.
        assert!((start / n / 0.04 - 1.0).abs() < 0.06, "{}", start / n);
        assert!((walked / n / 0.01 - 1.0).abs() < 0.06, "{}", walked / n);
    }
}
