//! Random walk of a particle among the runs above a level.
//!
//! In the space where every coordinate is a standard normal variable, a step proposes `z' = sqrt(1 - s^2) z + s xi`
//! with `xi` normal (the preconditioned Crank-Nicolson step), and every second time another seed. It is reversible with
//! respect to the campaign's own distribution, so that a proposal which is accepted whenever it lies above the
//! level leaves that distribution, restricted to the runs above the level, as it is. The order among equal scores is then
//! drawn anew from what the level leaves of it.

use core::f64::consts::{FRAC_1_SQRT_2, TAU};

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Share of proposals that the length of a step aims at being accepted.
const ACCEPTED: f64 = 0.3;
/// Shortest step.
const SHORTEST: f64 = 0.02;

/// A run as the walk sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// Coordinates, each a standard normal variable.
    pub z: Vec<f64>,
    /// Seed of the flight.
    pub seed: u32,
    /// Order among equal scores, in `[0, 1)`.
    pub order: f64,
}

impl Place {
    /// Its coordinates in the unit cube, as the distributions take them.
    pub fn unit(&self) -> Vec<f64> {
        let below = |z: &f64| (0.5 * libm::erfc(-z * FRAC_1_SQRT_2)).clamp(0.0, 1.0f64.next_down());
        self.z.iter().map(below).collect()
    }
}

/// Random numbers of one replica, and the length of its steps.
#[derive(Clone, Debug)]
pub struct Walk {
    random: Xoshiro256PlusPlus,
    step: f64,
}

impl Walk {
    /// Of replica `number`, in `[0, 10000)`: streams 2^128 apart, far from those of flights with this seed.
    pub fn new(seed: u64, number: u32) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        random.long_jump();
        random.long_jump();
        (0..number).for_each(|_| random.jump());
        Self { random, step: 0.6 }
    }

    fn uniform(&mut self) -> f64 {
        (self.random.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    fn normal(&mut self) -> f64 {
        // Box and Muller, with libm's bits on every machine.
        let radius = (-2.0 * libm::log(1.0 - self.uniform())).sqrt();
        radius * libm::cos(TAU * self.uniform())
    }

    fn seed(&mut self) -> u32 {
        self.random.next_u64() as u32
    }

    /// A number below `count`, which is positive.
    pub fn choice(&mut self, count: usize) -> usize {
        ((self.uniform() * count as f64) as usize).min(count - 1)
    }

    /// A run of the campaign's distribution.
    pub fn anywhere(&mut self, dimensions: usize) -> Place {
        let z = (0..dimensions).map(|_| self.normal()).collect();
        Place { z, seed: self.seed(), order: self.uniform() }
    }

    /// A proposal from `here`.
    pub fn proposal(&mut self, here: &Place) -> Place {
        let stay = (1.0 - self.step * self.step).sqrt();
        let z = here.z.iter().map(|z| stay * z + self.step * self.normal()).collect();
        let seed = if self.uniform() < 0.5 { self.seed() } else { here.seed };
        Place { z, seed, order: here.order }
    }

    /// Order among equal scores, above `least`.
    pub fn order(&mut self, least: f64) -> f64 {
        least + (1.0 - least) * self.uniform()
    }

    /// Adapts the length of the steps to a walk of which this share was accepted.
    pub fn adapt(&mut self, accepted: f64) {
        let factor = libm::exp(0.1 * (accepted - ACCEPTED));
        self.step = (self.step * factor).clamp(SHORTEST, 1.0);
    }
}
