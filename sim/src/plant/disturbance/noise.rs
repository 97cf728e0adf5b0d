//! Uniform noise, drawn anew at every tick: the paper's disturbance.

use glam::DVec3;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::uniform_pair;
use crate::plant::Disturbance;

/// Uniform noise; every component is drawn by itself.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Largest magnitude of each component (m/s^2).
    pub acceleration: f64,
    /// Largest magnitude about each body axis (N m).
    #[serde(with = "crate::per_axis")]
    pub torque: DVec3,
}

/// Noise in progress.
#[derive(Clone, Debug)]
pub(super) struct NoiseProcess {
    config: Noise,
    generator: Xoshiro256PlusPlus,
}

impl NoiseProcess {
    pub(super) fn new(config: &Noise, generator: Xoshiro256PlusPlus) -> Self {
        Self { config: *config, generator }
    }

    #[inline]
    pub(super) fn advance(&mut self) -> Disturbance {
        let (acceleration, torque) = uniform_pair(&mut self.generator);
        Disturbance {
            acceleration_world: self.config.acceleration * acceleration,
            torque_body: self.config.torque * torque,
            ..Disturbance::NONE
        }
    }
}
