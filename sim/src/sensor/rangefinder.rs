//! Rangefinder: distance to flat ground at height zero along the body's -z axis.

use serde::{Deserialize, Serialize};

use super::converter::Converter;
use super::random::Normal;
use super::schedule::Schedule;
use crate::plant::PlantState;
use glam::DVec3;

/// Parameters of a rangefinder.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RangefinderParameters {
    /// Rate of the samples (Hz).
    pub rate: f64,
    /// Age of a sample when it arrives (s).
    pub delay: f64,
    /// Noise, root mean square (mm).
    pub noise: f64,
    /// Resolution (mm).
    pub resolution: f64,
    /// Nearest distance (m).
    pub nearest: f64,
    /// Farthest distance (m).
    pub farthest: f64,
    /// Share of samples that are lost.
    pub dropout: f64,
}

impl RangefinderParameters {
    /// ST VL53L1X. Data sheet: 4 cm to 4 m, up to 50 Hz, results in mm; errors of ±20 mm (dark) and ±25 mm (ambient light).
    /// 10 mm of noise are assumed, so that two deviations are the sheet's bound, and half a period of delay.
    pub const VL53L1X: Self = Self {
        rate: 50.0,
        delay: 0.01,
        noise: 10.0,
        resolution: 1.0,
        nearest: 0.04,
        farthest: 4.0,
        dropout: 0.0,
    };

    /// Standard deviation of a distance (m).
    #[must_use]
    pub fn deviation(&self) -> f64 {
        1e-3 * (self.noise * self.noise + self.resolution * self.resolution / 12.0).sqrt()
    }
}

/// Distance to flat ground at height zero along the body's -z axis (m); none where that axis does not meet it.
#[must_use]
pub fn distance(truth: &PlantState) -> Option<f64> {
    let cosine = (truth.attitude * DVec3::Z).z;
    (cosine > 0.1 && truth.position_world.z > 0.0).then(|| truth.position_world.z / cosine)
}

/// A rangefinder in flight.
#[derive(Clone, Debug)]
pub struct Rangefinder {
    parameters: RangefinderParameters,
    schedule: Schedule<Option<f64>>,
    normal: Normal,
}

impl Rangefinder {
    /// Of a flight with `seed`, in ticks of `tick` (s).
    #[must_use]
    pub fn new(parameters: &RangefinderParameters, seed: u64, tick: f64) -> Self {
        let p = *parameters;
        let schedule = Schedule::new(p.rate, p.delay, p.dropout, tick, Normal::new(seed, 70));
        Self { parameters: p, schedule, normal: Normal::new(seed, 71) }
    }

    /// A distance when one arrives (m).
    pub fn advance(&mut self, tick: u64, truth: &PlantState) -> Option<f64> {
        let Self { parameters: p, schedule, normal } = self;
        let arrived = schedule.advance(tick, || {
            let noise = 1e-3 * p.noise * normal.number();
            let seen = distance(truth).filter(|x| (p.nearest..=p.farthest).contains(x))? + noise;
            Some(Converter::new(p.farthest, 1e-3 * p.resolution).convert(seen))
        });
        arrived.flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn at(height: f64, tilt: f64) -> PlantState {
        PlantState {
            position_world: DVec3::new(3.0, -2.0, height),
            velocity_world: DVec3::ZERO,
            attitude: DQuat::from_rotation_z(0.4) * DQuat::from_rotation_x(tilt),
            rate_body: DVec3::ZERO,
        }
    }

    #[test]
    fn distances_are_along_the_tilted_axis_and_scatter_by_the_noise() {
        let parameters = RangefinderParameters { rate: 1000.0, ..RangefinderParameters::VL53L1X };
        let mut rangefinder = Rangefinder::new(&parameters, 3, 1e-3);
        let seen: Vec<_> =
            (0..20_000).filter_map(|tick| rangefinder.advance(tick, &at(1.5, 0.5))).collect();
        let n = seen.len() as f64;
        let mean = seen.iter().sum::<f64>() / n;
        let square = seen.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        assert!((mean - 1.5 / libm::cos(0.5)).abs() < 5e-4, "{mean}");
        assert!((square.sqrt() / parameters.deviation() - 1.0).abs() < 0.02);
    }

    #[test]
    fn beyond_its_range_it_sees_nothing() {
        for state in [at(0.03, 0.0), at(4.2, 0.0), at(2.5, 1.0), at(2.0, 3.0)] {
            let mut rangefinder = Rangefinder::new(&RangefinderParameters::VL53L1X, 3, 1e-3);
            assert!((0..200).all(|tick| rangefinder.advance(tick, &state).is_none()), "{state:?}");
        }
    }
}
