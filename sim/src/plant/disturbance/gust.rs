//! Gusts: steps to a new random push that holds for a while.

use glam::DVec3;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::uniform_pair;
use crate::plant::Disturbance;

/// Random steps: every component of every gust is uniform within its magnitude.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gust {
    /// Duration of each gust; the first starts with the flight (s).
    pub hold: f64,
    /// Largest magnitude of each component (m/s^2).
    pub acceleration: f64,
    /// Largest magnitude about each body axis (N m).
    #[serde(with = "crate::per_axis")]
    pub torque: DVec3,
}

/// Gusts in progress.
#[derive(Clone, Debug)]
pub(super) struct GustProcess {
    config: Gust,
    generator: Xoshiro256PlusPlus,
    ticks_per_gust: u64,
    ticks_left: u64,
    current: Disturbance,
}

impl GustProcess {
    pub(super) fn new(config: &Gust, step_period: f64, generator: Xoshiro256PlusPlus) -> Self {
        Self {
            config: *config,
            generator,
            ticks_per_gust: ((config.hold / step_period).round() as u64).max(1),
            ticks_left: 0,
            current: Disturbance::default(),
        }
    }

    #[inline]
    pub(super) fn advance(&mut self) -> Disturbance {
        if self.ticks_left == 0 {
            let (acceleration, torque) = uniform_pair(&mut self.generator);
            self.current = Disturbance {
                acceleration_world: self.config.acceleration * acceleration,
                torque_body: self.config.torque * torque,
                ..Disturbance::NONE
            };
            self.ticks_left = self.ticks_per_gust;
        }
        self.ticks_left -= 1;
        self.current
    }
}
