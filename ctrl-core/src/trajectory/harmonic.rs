//! Uniform rotation and the harmonic motion that it makes, exact at any tick.
//!
//! The phase is an integer in units of `2^-64` turns and wraps like an angle does:
//!
//! ```text
//! phase = tick * turns_per_tick  (mod 2^64),   turns_per_tick = round(2^64 w dt/(2 pi))
//! A cos(phi)' = -A w sin(phi),  A sin(phi)' = A w cos(phi),  and so on to the fourth
//! ```
//!
//! Only the constructors calculate in f64. The error of the phase after `n` ticks is below
//! `n w dt * 4e-16` rad: 2e-11 rad after 10^9 ticks of the paper's circle.

use super::Coordinate;
use crate::error::{Bound, ConfigError, require};
use crate::trigonometry::{rotated, sin_cos_small};

/// `2^64`, the phase of a full turn.
const TURN: f64 = 18_446_744_073_709_551_616.0;

/// Radians a unit of the upper 32 bits of a phase: `2 pi/2^32`.
const RADIANS: f32 = core::f32::consts::TAU / 4_294_967_296.0;

/// Rotation at a constant rate, from angle zero at tick zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rotation {
    /// Turns between two ticks [2^-64], modulo one.
    turns_per_tick: u64,
}

/// Cosine and sine of a phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Phasor {
    pub cos: f32,
    pub sin: f32,
}

impl Rotation {
    /// Rotation at `rate` (rad/s), either way, sampled every `step_period` (s).
    ///
    /// # Errors
    /// Names `parameter` when a step turns by more than half a radian.
    pub fn new(parameter: &'static str, rate: f32, step_period: f32) -> Result<Self, ConfigError> {
        let limit = 0.5 / step_period;
        require(parameter, rate, Bound::Inside(-limit, limit), "at most 0.5 rad a step")?;
        let turns = f64::from(rate) * f64::from(step_period) / core::f64::consts::TAU;
        Ok(Self { turns_per_tick: (turns * TURN) as i64 as u64 })
    }

    /// The same rotation at twice the rate.
    pub fn doubled(self) -> Self {
        Self { turns_per_tick: self.turns_per_tick.wrapping_mul(2) }
    }

    /// Cosine and sine at `tick`, together accurate to 1.2e-7.
    ///
    /// The nearest quarter turn is split off first: the rest is small enough for f32 to hold it
    /// to 3e-8 rad.
    pub fn at(self, tick: u64) -> Phasor {
        let phase = tick.wrapping_mul(self.turns_per_tick);
        let quarter = phase.wrapping_add(1 << 61) >> 62;
        let rest = phase.wrapping_sub(quarter << 62) as i64;
        let small = sin_cos_small((rest >> 32) as i32 as f32 * RADIANS);
        let (sin, cos) = rotated(quarter as u32, small);
        Phasor { cos, sin }
    }
}

/// Amplitudes of a harmonic motion and of its first four derivatives: `A w^k` (m/s^k).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Harmonic(Coordinate);

impl Harmonic {
    /// Amplitude (m) at an angular rate (rad/s).
    pub fn new(amplitude: f32, rate: f32) -> Self {
        let (a, w) = (f64::from(amplitude), f64::from(rate));
        Self([a, a * w, a * w * w, a * w * w * w, a * w * w * w * w].map(|x| x as f32))
    }

    /// Largest acceleration `A w^2` (m/s^2); no sample exceeds it, in f32 either.
    pub fn acceleration(&self) -> f32 {
        let Self([_, _, acceleration, _, _]) = *self;
        acceleration.abs()
    }

    /// `A w^k` for `k` from 0 to 4 (m/s^k).
    pub fn amplitudes(&self) -> Coordinate {
        self.0
    }

    /// `A cos(phi)` with its derivatives.
    pub fn cosine(&self, Phasor { cos, sin }: Phasor) -> Coordinate {
        let Self([a0, a1, a2, a3, a4]) = *self;
        [a0 * cos, -a1 * sin, -a2 * cos, a3 * sin, a4 * cos]
    }

    /// `A sin(phi)` with its derivatives.
    pub fn sine(&self, Phasor { cos, sin }: Phasor) -> Coordinate {
        let Self([a0, a1, a2, a3, a4]) = *self;
        [a0 * sin, a1 * cos, -a2 * sin, -a3 * cos, a4 * sin]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Error of the phasor against f64, at a phase of `rate * step_period * tick`.
    fn error(rate: f32, step_period: f32, tick: u64) -> f64 {
        let phasor = Rotation::new("rate", rate, step_period).unwrap().at(tick);
        // Whole turns are taken off before the product rounds.
        let turns = f64::from(rate) * f64::from(step_period) / TAU;
        let exact = (turns * (tick >> 20) as f64 * 1_048_576.0).rem_euclid(1.0)
            + turns * (tick & 0xF_FFFF) as f64;
        let (sin, cos) = (exact * TAU).sin_cos();
        (f64::from(phasor.cos) - cos).hypot(f64::from(phasor.sin) - sin)
    }

    #[test]
    fn phasor_is_accurate_to_f32_over_the_turn() {
        let mut worst = 0.0f64;
        for tick in 0..200_000 {
            worst = worst.max(error(0.731, 1e-3, tick));
        }
        assert!(worst < 1.2e-7, "{worst:e}");
    }

    #[test]
    fn phasor_stays_accurate_after_a_billion_ticks() {
        for tick in [999_999_937, 1_000_000_000, 1_000_000_007] {
            for rate in [0.05, -0.05, 7.3, -19.0] {
                let bound = 1.2e-7 + 4e-16 * 1e6 * f64::from(rate).abs();
                assert!(
                    error(rate, 1e-3, tick) < bound,
                    "{rate} {tick} {}",
                    error(rate, 1e-3, tick)
                );
            }
        }
    }

    #[test]
    fn any_tick_gives_a_unit_phasor() {
        let rotation = Rotation::new("rate", 3.3, 1e-3).unwrap();
        for tick in [0, 1, u64::MAX / 3, u64::MAX - 1, u64::MAX] {
            let Phasor { cos, sin } = rotation.at(tick);
            assert!((cos * cos + sin * sin - 1.0).abs() < 2e-7);
        }
    }

    #[test]
    fn turning_back_mirrors_the_sine() {
        let ahead = Rotation::new("rate", 0.4, 2e-3).unwrap();
        let back = Rotation::new("rate", -0.4, 2e-3).unwrap();
        for tick in (0..100_000).step_by(997) {
            let (a, b) = (ahead.at(tick), back.at(tick));
            assert!((a.cos - b.cos).abs() < 1e-7 && (a.sin + b.sin).abs() < 1e-7);
        }
    }

    #[test]
    fn refuses_more_than_half_a_radian_a_step() {
        let error = Rotation::new("circle.angular_rate", 501.0, 1e-3).unwrap_err();
        assert_eq!(error.parameter, "circle.angular_rate");
        assert!(Rotation::new("rate", f32::NAN, 1e-3).is_err());
        assert!(Rotation::new("rate", -499.0, 1e-3).is_ok());
    }
}
