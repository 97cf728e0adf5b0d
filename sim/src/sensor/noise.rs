//! White noise by its density: a sample that is the mean over `period` has the variance `density^2 / period`.

use glam::DVec3;

use super::random::Normal;

/// White noise in progress.
#[derive(Clone, Debug)]
pub struct WhiteNoise {
    deviation: f64,
    normal: Normal,
}

impl WhiteNoise {
    /// Of `density` per root hertz, one-sided, in samples each `period` (s).
    #[must_use]
    pub fn of_density(density: f64, period: f64, normal: Normal) -> Self {
        Self { deviation: density / period.sqrt(), normal }
    }

    /// The next sample.
    pub fn advance(&mut self) -> DVec3 {
        self.deviation * self.normal.vector()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    /// Mean over many pieces of the power spectral density at `frequency`, two-sided, by the periodogram.
    fn spectrum(period: f64, frequency: f64) -> f64 {
        let (mut noise, length, pieces) =
            (WhiteNoise::of_density(0.02, period, Normal::new(5, 9)), 256, 1_500);
        let mut mean = 0.0;
        for _ in 0..pieces {
            let (mut re, mut im) = (0.0, 0.0);
            for k in 0..length {
                let angle = TAU * frequency * period * f64::from(k);
                let x = noise.advance().x;
                re += x * libm::cos(angle);
                im += x * libm::sin(angle);
            }
            mean += (re * re + im * im) * period / f64::from(length) / f64::from(pieces);
        }
        mean
    }

    #[test]
    fn the_spectrum_is_flat_at_the_density_whatever_the_rate() {
        for period in [1e-3, 2.5e-4] {
            for frequency in [20.0, 130.0, 400.0] {
                let found = spectrum(period, frequency);
                assert!((found / 4e-4 - 1.0).abs() < 0.1, "{period}, {frequency}: {found}");
            }
        }
    }
}
