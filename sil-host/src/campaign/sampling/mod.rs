//! Points in the unit cube: every coordinate is a function of definition and seed alone, so that any
//! run can be repeated without those before it.

mod permutation;

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

use super::definition::Sampling;
use permutation::permuted;

/// Largest number of runs that [`sobol_burley`] supports.
pub const SOBOL_RUNS_MAX: u32 = 1 << 16;
/// Largest number of dimensions that [`sobol_burley`] supports.
pub const SOBOL_DIMENSIONS_MAX: u32 = sobol_burley::NUM_DIMENSIONS;

/// Coordinates of one run.
#[derive(Clone, Debug)]
pub struct Point {
    sampling: Sampling,
    /// Number of this run, from zero.
    index: u32,
    runs: u32,
    /// Seed of the first run: chooses permutations and scrambling.
    first_seed: u32,
    random: Xoshiro256PlusPlus,
    dimension: u32,
}

impl Point {
    /// The point of run `index` of `runs`.
    #[must_use]
    pub fn new(sampling: Sampling, index: u32, runs: u32, first_seed: u32) -> Self {
        let seed = u64::from(first_seed) + u64::from(index);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        // 2^192 numbers away from those that disturb the flight with this seed.
        random.long_jump();
        Self { sampling, index, runs, first_seed, random, dimension: 0 }
    }

    /// The next coordinate, in `[0, 1)`.
    pub fn coordinate(&mut self) -> f64 {
        let dimension = self.dimension;
        self.dimension += 1;
        let random = (self.random.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64);
        match self.sampling {
            Sampling::MonteCarlo | Sampling::Grid => random,
            Sampling::LatinHypercube => {
                let key = u64::from(dimension) << 32 | u64::from(self.first_seed);
                let stratum = permuted(self.index, self.runs, hash(key));
                below_one((f64::from(stratum) + random) / f64::from(self.runs))
            }
            Sampling::Sobol => {
                let scramble = hash(u64::from(self.first_seed)) as u32;
                f64::from(sobol_burley::sample(self.index, dimension, scramble))
            }
        }
    }
}

/// Rounding may carry the last stratum to one.
fn below_one(x: f64) -> f64 {
    x.min(1.0f64.next_down())
}

/// Spreads a number over all bits (the finaliser of SplitMix64).
fn hash(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Sampling; 3] = [Sampling::MonteCarlo, Sampling::LatinHypercube, Sampling::Sobol];

    fn points(sampling: Sampling, runs: u32, dimensions: usize, first_seed: u32) -> Vec<Vec<f64>> {
        let point = |index| {
            let mut point = Point::new(sampling, index, runs, first_seed);
            (0..dimensions).map(|_| point.coordinate()).collect()
        };
        (0..runs).map(point).collect()
    }

    /// Share of `strata` equal intervals that a coordinate of the points meets.
    fn strata_met(points: &[Vec<f64>], dimension: usize, strata: usize) -> usize {
        let mut met = vec![false; strata];
        for point in points {
            met[(point[dimension] * strata as f64) as usize] = true;
        }
        met.into_iter().filter(|&met| met).count()
    }

    #[test]
    fn a_latin_hypercube_meets_every_stratum_once() {
        for runs in [1, 2, 7, 100, 1000] {
            let points = points(Sampling::LatinHypercube, runs, 5, 42);
            for dimension in 0..5 {
                assert_eq!(strata_met(&points, dimension, runs as usize), runs as usize);
            }
        }
        // Points at random leave a share of 1/e of the strata empty.
        let points = points(Sampling::MonteCarlo, 1000, 1, 42);
        assert!((600..670).contains(&strata_met(&points, 0, 1000)));
    }

    #[test]
    fn sobol_points_meet_every_stratum_and_every_cell() {
        let points = points(Sampling::Sobol, 1024, 4, 3);
        for dimension in 0..4 {
            assert_eq!(strata_met(&points, dimension, 1024), 1024);
        }
        // Elementary intervals of the first two dimensions, 32 by 32: each holds one point.
        let mut cells = vec![0; 1024];
        for point in &points {
            cells[(point[0] * 32.0) as usize * 32 + (point[1] * 32.0) as usize] += 1;
        }
        assert!(cells.iter().all(|&count| count == 1));
    }

    /// Largest difference between the share of points in a box at the origin and its volume, over
    /// boxes of two dimensions with corners on a grid.
    fn star_discrepancy(points: &[Vec<f64>]) -> f64 {
        let corners = || (1..=20).map(|i| f64::from(i) / 20.0);
        let mut worst: f64 = 0.0;
        for x in corners() {
            for y in corners() {
                let inside = points.iter().filter(|p| p[0] < x && p[1] < y).count();
                worst = worst.max((inside as f64 / points.len() as f64 - x * y).abs());
            }
        }
        worst
    }

    #[test]
    fn sobol_points_are_more_even_than_random_ones() {
        for seed in [1, 1000, 77_777] {
            let sobol = star_discrepancy(&points(Sampling::Sobol, 1024, 2, seed));
            let random = star_discrepancy(&points(Sampling::MonteCarlo, 1024, 2, seed));
            assert!(sobol < 0.006 && random > 2.0 * sobol, "{sobol} {random}");
        }
    }

    #[test]
    fn a_run_repeats_and_neighbours_differ() {
        for sampling in ALL {
            let both = points(sampling, 50, 3, 9);
            assert_eq!(both, points(sampling, 50, 3, 9));
            assert_ne!(both, points(sampling, 50, 3, 10));
            assert_ne!(both[0], both[1]);
        }
        // Random values depend on the seed only, not on where the campaign starts.
        let all = points(Sampling::MonteCarlo, 50, 3, 9);
        assert_eq!(all[7..], points(Sampling::MonteCarlo, 43, 3, 16));
    }

    #[test]
    fn coordinates_have_the_moments_of_a_uniform_distribution_and_no_correlation() {
        let n = 4096;
        for sampling in ALL {
            let points = points(sampling, n, 6, 1);
            let mean = |value: &dyn Fn(&Vec<f64>) -> f64| {
                points.iter().map(value).sum::<f64>() / f64::from(n)
            };
            for i in 0..6 {
                assert!((mean(&|p| p[i]) - 0.5).abs() < 3.0 * 0.29 / 64.0, "{sampling:?}");
                for j in 0..i {
                    let product = mean(&|p| (p[i] - 0.5) * (p[j] - 0.5)) * 12.0;
                    assert!(product.abs() < 4.0 / 64.0, "{sampling:?} {i} {j} {product}");
                }
            }
            assert!(points.iter().flatten().all(|x| (0.0..1.0).contains(x)));
        }
    }
}
