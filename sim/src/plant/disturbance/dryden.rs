//! Wind: a mean and Dryden turbulence at low altitude (MIL-F-8785C, below 1000 ft), felt through linear drag.
//!
//! With the height `h` and the lengths in feet, `W20` the wind at 20 ft:
//!
//! ```text
//! L_w = h    L_u = L_v = h/(0.177 + 0.000823 h)^1.2    s_w = 0.1 W20    s_u = s_v = s_w/(0.177 + 0.000823 h)^0.4
//! ```
//!
//! The air passes a vehicle that hovers with the mean wind `V`, so each component is white noise through a
//! filter with `T = L/V`: `1/(1 + T s)` along the wind, `(1 + sqrt(3) T s)/(1 + T s)^2` across and upwards. Both are
//! advanced exactly over a step. The disturbance acceleration is `drag (wind - v)`.

use crate::norm::power;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::plant::{Disturbance, PlantState};
use crate::sensor::random::Normal;

/// Feet per metre.
const FEET: f64 = 1.0 / 0.3048;

/// Mean wind with turbulence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dryden {
    /// Mean wind, at 20 ft and at the vehicle (m/s).
    pub wind_speed: f64,
    /// Direction to which it blows, from world x about world z (deg).
    pub direction_deg: f64,
    /// Height above ground for the turbulence's scales, 3 to 300 (m).
    pub height: f64,
    /// Deceleration per speed through the air (1/s).
    pub drag: f64,
}

impl Dryden {
    /// Standard deviations along and across the wind, and upwards (m/s).
    #[must_use]
    pub fn deviations(&self) -> DVec3 {
        let up = 0.1 * self.wind_speed;
        let level = up / power(0.177 + 0.000823 * self.height * FEET, 0.4);
        DVec3::new(level, level, up)
    }

    /// Time constants of the three filters (s).
    #[must_use]
    pub fn time_constants(&self) -> DVec3 {
        let level = self.height / power(0.177 + 0.000823 * self.height * FEET, 1.2);
        DVec3::new(level, level, self.height) / self.wind_speed
    }
}

/// First-order filter of white noise: `s sqrt(2 T)/(1 + T s)`.
#[derive(Clone, Copy, Debug)]
struct Along {
    keep: f64,
    noise: f64,
    now: f64,
}

impl Along {
    fn new(deviation: f64, constant: f64, h: f64, normal: &mut Normal) -> Self {
        let keep = (-h / constant).exp();
        let noise = deviation * (1.0 - keep * keep).sqrt();
        Self { keep, noise, now: deviation * normal.number() }
    }

    fn advance(&mut self, normal: &mut Normal) -> f64 {
        let now = self.now;
        self.now = self.keep * now + self.noise * normal.number();
        now
    }
}

/// Second-order filter: two lags in a row, `x1` of white noise and `x2` of `x1`; the output is
/// `sqrt(3) x1 + (1 - sqrt(3)) x2`.
#[derive(Clone, Copy, Debug)]
struct Across {
    keep: f64,
    /// Step in units of the time constant.
    x: f64,
    /// Cholesky factor of the step's noise.
    noise: [f64; 3],
    now: [f64; 2],
}

impl Across {
    fn new(deviation: f64, constant: f64, h: f64, normal: &mut Normal) -> Self {
        let x = h / constant;
        let (keep, gone) = ((-x).exp(), (-2.0 * x).exp());
        // Covariances per squared deviation: over a step, and for x without end.
        let over = |gone: f64, x: f64| {
            let first = 0.5 * (1.0 - gone);
            let both = 0.25 * (1.0 - gone * (1.0 + 2.0 * x));
            let second = 0.25 * (1.0 - gone * (1.0 + 2.0 * x + 2.0 * x * x));
            let root = first.sqrt();
            let left = (second - both * both / first).max(0.0);
            [deviation * root, deviation * both / root, deviation * left.sqrt()]
        };
        let [a, b, c] = over(0.0, 0.0);
        let (n, m) = (normal.number(), normal.number());
        Self { keep, x, noise: over(gone, x), now: [a * n, b * n + c * m] }
    }

    fn advance(&mut self, normal: &mut Normal) -> f64 {
        let [first, second] = self.now;
        let [a, b, c] = self.noise;
        let (n, m) = (normal.number(), normal.number());
        self.now =
            [self.keep * first + a * n, self.keep * (second + self.x * first) + b * n + c * m];
        let root = 3f64.sqrt();
        root * first + (1.0 - root) * second
    }
}

/// Wind in progress.
#[derive(Clone, Debug)]
pub(super) struct DrydenProcess {
    drag: f64,
    mean: f64,
    /// Unit vectors along and across the wind.
    axes: [DVec3; 2],
    along: Along,
    across: Across,
    upwards: Across,
    normal: Normal,
}

impl DrydenProcess {
    pub(super) fn new(config: &Dryden, step_period: f64, seed: u64) -> Self {
        let mut normal = Normal::new(seed, 60);
        let (s, t) = (config.deviations(), config.time_constants());
        let angle = config.direction_deg.to_radians();
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        Self {
            drag: config.drag,
            mean: config.wind_speed,
            axes: [DVec3::new(cosine, sine, 0.0), DVec3::new(-sine, cosine, 0.0)],
            along: Along::new(s.x, t.x, step_period, &mut normal),
            across: Across::new(s.y, t.y, step_period, &mut normal),
            upwards: Across::new(s.z, t.z, step_period, &mut normal),
            normal,
        }
    }

    /// Turbulence along and across the wind, and upwards (m/s).
    fn turbulence(&mut self) -> DVec3 {
        let Self { along, across, upwards, normal, .. } = self;
        DVec3::new(along.advance(normal), across.advance(normal), upwards.advance(normal))
    }

    pub(super) fn advance(&mut self, truth: &PlantState) -> Disturbance {
        let turbulence = self.turbulence();
        let wind = (self.mean + turbulence.x) * self.axes[0]
            + turbulence.y * self.axes[1]
            + turbulence.z * DVec3::Z;
        Disturbance {
            acceleration_world: self.drag * (wind - truth.velocity_world),
            torque_body: DVec3::ZERO,
            wind_world: wind,
        }
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::{PI, TAU};

    use super::*;

    const WIND: Dryden = Dryden { wind_speed: 8.0, direction_deg: 0.0, height: 20.0, drag: 0.3 };

    #[test]
    fn scales_are_those_of_the_standard() {
        // At 100 ft: 100/(0.2593)^1.2 = 505.3 ft; 1/(0.2593)^0.4 = 1.716.
        let wind = Dryden { wind_speed: 1.0, height: 30.48, ..WIND };
        assert!((wind.time_constants().x * FEET - 505.2).abs() < 1.0, "{}", wind.time_constants());
        assert!((wind.deviations().x / 0.1 - 1.716).abs() < 2e-3);
        assert_eq!(wind.time_constants().z, 30.48);
    }

    /// Mean of the periodogram, two-sided, per hertz, of all three components at `frequency` (Hz).
    fn spectrum(frequency: f64) -> DVec3 {
        let (period, length, pieces) = (0.05, 4_000, 250);
        let mut process = DrydenProcess::new(&WIND, period, 7);
        let mut mean = DVec3::ZERO;
        for _ in 0..pieces {
            let (mut re, mut im, mut weights) = (DVec3::ZERO, DVec3::ZERO, 0.0);
            for k in 0..length {
                // Hann's window, against leakage from the low frequencies.
                let weight = 0.5 - 0.5 * libm::cos(TAU * f64::from(k) / f64::from(length));
                let angle = TAU * frequency * period * f64::from(k);
                let x = weight * process.turbulence();
                re += x * libm::cos(angle);
                im += x * libm::sin(angle);
                weights += weight * weight;
            }
            mean += (re * re + im * im) * period / weights / f64::from(pieces);
        }
        mean
    }

    #[test]
    fn spectra_are_those_of_dryden() {
        let (s, t) = (WIND.deviations(), WIND.time_constants());
        for frequency in [0.02, 0.1, 0.5] {
            let omega = 2.0 * PI * frequency;
            let x = (omega * omega) * t * t;
            let one = DVec3::ONE;
            let along = 2.0 * s * s * t / (one + x);
            let across = s * s * t * (one + 3.0 * x) / ((one + x) * (one + x));
            let expected = DVec3::new(along.x, across.y, across.z);
            let ratio = spectrum(frequency) / expected;
            // 250 pieces: the standard deviation of each ratio is 6 %.
            assert!((ratio - one).abs().max_element() < 0.2, "{frequency} Hz: {ratio}");
        }
    }

    #[test]
    fn variances_are_stationary_from_the_start_whatever_the_step() {
        for step in [1e-3, 0.5] {
            let mut square = DVec3::ZERO;
            let runs = 3_000;
            for seed in 0..runs {
                let mut process = DrydenProcess::new(&WIND, step, seed);
                (0..5).for_each(|_| _ = process.turbulence());
                let x = process.turbulence();
                square += x * x / runs as f64;
            }
            let ratio = square / (WIND.deviations() * WIND.deviations());
            assert!((ratio - DVec3::ONE).abs().max_element() < 0.1, "{step} s: {ratio}");
        }
    }

    #[test]
    fn the_mean_wind_pushes_along_its_direction() {
        let wind = Dryden { direction_deg: 90.0, ..WIND };
        let mut process = DrydenProcess::new(&wind, 1.0, 1);
        let still = PlantState {
            position_world: DVec3::ZERO,
            velocity_world: DVec3::Y,
            attitude: glam::DQuat::IDENTITY,
            rate_body: DVec3::ZERO,
        };
        let n = 40_000;
        let sum: DVec3 = (0..n).map(|_| process.advance(&still).acceleration_world).sum();
        let mean = sum / f64::from(n);
        assert!((mean - DVec3::new(0.0, 0.3 * 7.0, 0.0)).length() < 0.03, "{mean}");
    }
}
