//! Barometer: pressure by the standard atmosphere near the ground, noise and steps in pressure, height back.

use crate::norm::power;
use serde::{Deserialize, Serialize};

use super::bias::Bias;
use super::converter::Converter;
use super::random::Normal;
use super::schedule::Schedule;

/// Pressure at the world's origin (Pa).
const PRESSURE: f64 = 101_325.0;
/// Density of the air there times gravity (Pa/m).
const GRADIENT: f64 = 1.225 * 9.806_65;
/// Scale of the standard atmosphere: `T0 / lapse` (m), and its exponent.
const SCALE: f64 = 288.15 / 0.0065;
const EXPONENT: f64 = 5.255_88;

/// Parameters of a barometer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BarometerParameters {
    /// Rate of the samples (Hz).
    pub rate: f64,
    /// Age of a sample when it arrives (s).
    pub delay: f64,
    /// Noise, root mean square (Pa).
    pub noise: f64,
    /// Resolution (Pa).
    pub resolution: f64,
    /// Share of samples that are lost.
    pub dropout: f64,
    /// Standard deviation of an offset at the start, from temperature and weather (Pa).
    #[serde(default)]
    pub offset: f64,
    /// Random walk of the offset (Pa/√s).
    #[serde(default)]
    pub walk: f64,
}

impl BarometerParameters {
    /// Bosch BMP388. Data sheet: output rate up to 200 Hz, 50 Hz with the oversampling for drones; resolution
    /// down to 0.016 Pa. Noise: 0.03 Pa are given for the strongest filter; without filter 1.2 Pa are assumed,
    /// which is 0.1 m.
    pub const BMP388: Self = Self {
        rate: 50.0,
        delay: 0.01,
        noise: 1.2,
        resolution: 0.016,
        dropout: 0.0,
        offset: 0.0,
        walk: 0.0,
    };

    /// The BMP388 with a drift, which the estimator follows: an offset of 6 Pa (0.5 m) against the height that the flight
    /// began at, and a walk of 0.25 Pa/√s, 15 Pa in an hour, as of a front that passes. Both are assumed.
    pub const BMP388_DRIFTING: Self = Self { offset: 6.0, walk: 0.25, ..Self::BMP388 };

    /// Bias of the height at the start (m), and its random walk (m/√s).
    #[must_use]
    pub fn height_bias(&self) -> (f64, f64) {
        (self.offset / GRADIENT, self.walk / GRADIENT)
    }

    /// Standard deviation of a height (m).
    #[must_use]
    pub fn deviation(&self) -> f64 {
        (self.noise * self.noise + self.resolution * self.resolution / 12.0).sqrt() / GRADIENT
    }
}

/// Pressure at a height (Pa).
#[must_use]
pub fn pressure(height: f64) -> f64 {
    PRESSURE * power(1.0 - height / SCALE, EXPONENT)
}

/// Height of a pressure (m).
#[must_use]
pub fn height(pressure: f64) -> f64 {
    SCALE * (1.0 - power(pressure / PRESSURE, 1.0 / EXPONENT))
}

/// A barometer in flight.
#[derive(Clone, Debug)]
pub struct Barometer {
    parameters: BarometerParameters,
    schedule: Schedule<f64>,
    normal: Normal,
    /// Offset of the pressure in its first component (Pa).
    drift: Bias,
}

impl Barometer {
    /// Of a flight with `seed`, in ticks of `tick` (s).
    #[must_use]
    pub fn new(parameters: &BarometerParameters, seed: u64, tick: f64) -> Self {
        let BarometerParameters { rate, delay, dropout, offset, walk, .. } = *parameters;
        let schedule = Schedule::new(rate, delay, dropout, tick, Normal::new(seed, 10));
        let drift = Bias::new(offset, walk, tick, Normal::new(seed, 12));
        Self { parameters: *parameters, schedule, normal: Normal::new(seed, 11), drift }
    }

    /// Height that it shows too much (m).
    #[must_use]
    pub fn bias(&self) -> f64 {
        -self.drift.now().x / GRADIENT
    }

    /// A height when one arrives (m).
    pub fn advance(&mut self, tick: u64, true_height: f64) -> Option<f64> {
        let Self { parameters, schedule, normal, drift } = self;
        let offset = drift.advance().x;
        schedule.advance(tick, || {
            let seen = pressure(true_height) + offset + parameters.noise * normal.number();
            height(Converter::new(2.0 * PRESSURE, parameters.resolution).convert(seen))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_atmosphere_is_the_standard_one() {
        // ICAO standard atmosphere, from its table.
        for (at, expected) in [(0.0, 101_325.0), (1000.0, 89_874.6), (2000.0, 79_495.2)] {
            assert!((pressure(at) - expected).abs() < 2.0, "{}", pressure(at));
            assert!((height(pressure(at)) - at).abs() < 1e-6);
        }
    }

    #[test]
    fn a_drifting_barometer_is_off_by_its_bias() {
        let parameters = BarometerParameters {
            rate: 1000.0,
            noise: 0.0,
            resolution: 0.0,
            delay: 0.0,
            ..BarometerParameters::BMP388_DRIFTING
        };
        let (mut start, mut walked) = (0.0, 0.0);
        for seed in 0..500 {
            let mut barometer = Barometer::new(&parameters, seed, 1e-3);
            let first = barometer.bias();
            for tick in 0..200 {
                let expected = 4.0 + barometer.bias();
                let height = barometer.advance(tick, 4.0).unwrap();
                assert!((height - expected).abs() < 2e-3, "{height} {expected}");
            }
            start += first * first / 500.0;
            walked += (barometer.bias() - first).powi(2) / 500.0;
        }
        let (offset, walk) = parameters.height_bias();
        assert!((start.sqrt() / offset - 1.0).abs() < 0.08);
        assert!((walked.sqrt() / (walk * 0.2f64.sqrt()) - 1.0).abs() < 0.08);
    }

    #[test]
    fn heights_scatter_by_the_noise() {
        let parameters = BarometerParameters { rate: 1000.0, ..BarometerParameters::BMP388 };
        let mut barometer = Barometer::new(&parameters, 3, 1e-3);
        let heights: Vec<_> = (0..20_000).filter_map(|tick| barometer.advance(tick, 4.0)).collect();
        let mean = heights.iter().sum::<f64>() / heights.len() as f64;
        let square =
            heights.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / heights.len() as f64;
        assert!((mean - 4.0).abs() < 0.005, "{mean}");
        assert!((square.sqrt() / parameters.deviation() - 1.0).abs() < 0.02);
    }
}
