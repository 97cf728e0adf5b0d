//! Normal random numbers of one sensor: a stream of the scenario's seed of its own.

use core::f64::consts::TAU;

use glam::DVec3;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Streams of sensors begin here; the disturbances' end before.
const FIRST_STREAM: u64 = 0x5E45_0000_0000_0000;

/// A seeded source of normal random numbers, by Box and Muller.
#[derive(Clone, Debug)]
pub struct Normal {
    generator: Xoshiro256PlusPlus,
    spare: Option<f64>,
}

impl Normal {
    /// The stream of `effect` for a flight's `seed`.
    #[must_use]
    pub fn new(seed: u64, effect: u64) -> Self {
        // splitmix64 inside `seed_from_u64` keeps near seeds apart.
        let mixed = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (FIRST_STREAM + effect);
        Self { generator: Xoshiro256PlusPlus::seed_from_u64(mixed), spare: None }
    }

    /// Uniform in `[0, 1)`.
    pub fn uniform(&mut self) -> f64 {
        (self.generator.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Mean zero, standard deviation one.
    pub fn number(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let radius = (-2.0 * libm::log(1.0 - self.uniform())).sqrt();
        let angle = TAU * self.uniform();
        self.spare = Some(radius * libm::sin(angle));
        radius * libm::cos(angle)
    }

    /// Three of them.
    pub fn vector(&mut self) -> DVec3 {
        DVec3::new(self.number(), self.number(), self.number())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_moments_and_the_tail_of_the_normal_distribution() {
        let mut normal = Normal::new(3, 1);
        let n = 200_000;
        let (mut sums, mut beyond) = ([0.0; 4], 0);
        for _ in 0..n {
            let x = normal.number();
            (1..=4).for_each(|k| sums[k - 1] += libm::pow(x, k as f64) / f64::from(n));
            beyond += i32::from(x.abs() > 1.959_964);
        }
        for (moment, (expected, bound)) in
            sums.into_iter().zip([(0.0, 0.01), (1.0, 0.015), (0.0, 0.04), (3.0, 0.12)])
        {
            assert!((moment - expected).abs() < bound, "{sums:?}");
        }
        assert!((f64::from(beyond) / f64::from(n) - 0.05).abs() < 0.002);
    }

    #[test]
    fn streams_differ_by_effect_and_seed() {
        let first = |seed, effect| Normal::new(seed, effect).number().to_bits();
        assert_eq!(first(1, 2), first(1, 2));
        assert!(first(1, 2) != first(1, 3) && first(1, 2) != first(2, 2));
    }
}
