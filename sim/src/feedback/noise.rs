//! Noise within a band: the real part of a complex Gauss-Markov process
//!
//! ```text
//! z_(k+1) = e^((-a + i omega) dt) z_k + sqrt(1 - e^(-2 a dt)) n_k      a = 2 pi bandwidth, omega = 2 pi center
//! x_k = deviation Re z_k
//! ```
//!
//! with independent standard normal parts of `n_k` and of `z_0`, so it is stationary from the first tick. This is the exact
//! sampling of `dz = (-a + i omega) z dt + sqrt(2 a) dW` at any `dt`: its autocorrelation at the lag `t` is
//! `deviation^2 e^(-a |t|) cos(omega t)`, and its one-sided power density, aliasing apart,
//!
//! ```text
//! S(f) = deviation^2/(pi b) [ 1/(1 + ((f - center)/b)^2) + 1/(1 + ((f + center)/b)^2) ]     b = bandwidth
//! ```
//!
//! With `center = 0` it is the first-order Gauss-Markov process, each of whose values is a low-passed white noise.

use core::f64::consts::TAU;

use glam::DVec3;

use super::config::BandLimitedNoise;
use crate::sensor::random::Normal;

/// Noise within a band in progress, three independent components.
#[derive(Clone, Debug)]
pub(super) struct BandLimitedProcess {
    deviation: f64,
    /// `e^(-a dt) [cos, sin](omega dt)`.
    turn: [f64; 2],
    /// `sqrt(1 - e^(-2 a dt))`.
    fresh: f64,
    real: DVec3,
    imaginary: DVec3,
    normal: Normal,
}

impl BandLimitedProcess {
    /// With values each `step_period` (s).
    pub fn new(config: &BandLimitedNoise, step_period: f64, mut normal: Normal) -> Self {
        let BandLimitedNoise { deviation, center, bandwidth } = *config;
        let (left, angle) = (-TAU * bandwidth * step_period, TAU * center * step_period);
        let kept = libm::exp(left);
        Self {
            deviation,
            turn: [kept * libm::cos(angle), kept * libm::sin(angle)],
            fresh: (-libm::expm1(2.0 * left)).sqrt(),
            real: normal.vector(),
            imaginary: normal.vector(),
            normal,
        }
    }

    /// The value of this tick; moves on by one.
    pub fn advance(&mut self) -> DVec3 {
        let (now, [cos, sin]) = (self.deviation * self.real, self.turn);
        let (real, imaginary) = (self.real, self.imaginary);
        self.real = cos * real - sin * imaginary + self.fresh * self.normal.vector();
        self.imaginary = sin * real + cos * imaginary + self.fresh * self.normal.vector();
        now
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;

    const DT: f64 = 1e-3;

    fn values(center: f64, bandwidth: f64, n: usize) -> Vec<DVec3> {
        let config = BandLimitedNoise { deviation: 0.3, center, bandwidth };
        let mut process = BandLimitedProcess::new(&config, DT, Normal::new(7, 900));
        (0..n).map(|_| process.advance()).collect()
    }

    #[test]
    fn the_autocorrelation_is_the_closed_form() {
        for (center, bandwidth) in [(0.0, 5.0), (0.0, 60.0), (80.0, 8.0)] {
            let values = values(center, bandwidth, 400_000);
            for lag in [0usize, 1, 3, 7, 15, 40] {
                let pairs = values.iter().zip(&values[lag..]);
                let sum: f64 = pairs.map(|(a, b)| a.dot(*b) / 3.0).sum();
                let found = sum / (values.len() - lag) as f64 / 0.09;
                let t = lag as f64 * DT;
                let expected = (-TAU * bandwidth * t).exp() * (TAU * center * t).cos();
                // Three components of 400 s: the deviation of the estimate is about 1/sqrt(3 * 400 s * a/2).
                let tolerance = 4.0 / (3.0 * 400.0 * PI * bandwidth).sqrt();
                assert!(
                    (found - expected).abs() < tolerance,
                    "{center} Hz, {bandwidth} Hz, lag {lag}: {found} against {expected}"
                );
            }
        }
    }

    #[test]
    fn the_spectrum_is_that_of_the_band() {
        let (center, b, length) = (90.0, 12.0, 2_000);
        let values = values(center, b, length * 400);
        for frequency in [40.0, 78.0, 90.0, 102.0, 130.0] {
            let mut mean = 0.0;
            for piece in values.chunks_exact(length) {
                let (mut re, mut im) = (DVec3::ZERO, DVec3::ZERO);
                for (k, x) in piece.iter().enumerate() {
                    let angle = TAU * frequency * DT * k as f64;
                    // Hann's window keeps the peak's power out of the flanks.
                    let window = 1.0 - (TAU * k as f64 / length as f64).cos();
                    re += *x * window * angle.cos();
                    im += *x * window * angle.sin();
                }
                mean += 2.0 * DT * (re.length_squared() + im.length_squared());
            }
            // The window's mean square is 3/2.
            let found = mean / (3.0 * 1.5 * values.len() as f64);
            let lobe = |f: f64| 1.0 / (1.0 + (f / b).powi(2));
            let expected = 0.09 / (PI * b) * (lobe(frequency - center) + lobe(frequency + center));
            assert!((found / expected - 1.0).abs() < 0.12, "{frequency} Hz: {found}, {expected}");
        }
    }
}
