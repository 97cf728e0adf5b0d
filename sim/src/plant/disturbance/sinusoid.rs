//! A sinusoidal push, as of a rotor out of balance or a slow swell of the wind.

use core::f64::consts::TAU;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::plant::Disturbance;

/// `amplitude * sin(2 pi frequency t)`, in phase in all components.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sinusoid {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Amplitude in the world frame (m/s^2).
    pub acceleration: DVec3,
    /// Amplitude in body axes (N m).
    pub torque: DVec3,
}

/// A sinusoid in progress.
#[derive(Clone, Debug)]
pub(super) struct SinusoidProcess {
    config: Sinusoid,
    cycles_per_tick: f64,
    tick: u64,
}

impl SinusoidProcess {
    pub(super) fn new(config: &Sinusoid, step_period: f64) -> Self {
        Self { config: *config, cycles_per_tick: config.frequency * step_period, tick: 0 }
    }

    #[inline]
    pub(super) fn advance(&mut self) -> Disturbance {
        let cycles = self.tick as f64 * self.cycles_per_tick;
        let sine = libm::sin(TAU * (cycles - cycles.floor()));
        self.tick += 1;
        Disturbance {
            acceleration_world: self.config.acceleration * sine,
            torque_body: self.config.torque * sine,
            ..Disturbance::NONE
        }
    }
}
