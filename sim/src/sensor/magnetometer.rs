//! Magnetometer: the Earth's field in body axes, with offset, noise and steps.

use crate::norm::Norm;
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::converter::Converter;
use super::random::Normal;
use super::schedule::Schedule;

/// Parameters of a magnetometer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MagnetometerParameters {
    /// Rate of the samples (Hz).
    pub rate: f64,
    /// Age of a sample when it arrives (s).
    pub delay: f64,
    /// Noise of each axis, root mean square (µT).
    pub noise: f64,
    /// Resolution (µT).
    pub resolution: f64,
    /// Full scale (µT).
    pub range: f64,
    /// Offset that calibration left of iron aboard, standard deviation of each axis (µT).
    pub offset: f64,
    /// The Earth's field in the world frame: east, north, up (µT).
    pub field_world: DVec3,
}

impl MagnetometerParameters {
    /// ST LIS3MDL. Data sheet: noise of 3.2 mgauss (x, y) and full scale of 4 gauss with 6842 LSB/gauss; 80 Hz at
    /// most in the best mode. The field is that of central Europe: 20 µT to the north and 44 µT down.
    pub const LIS3MDL: Self = Self {
        rate: 50.0,
        delay: 0.0,
        noise: 0.32,
        resolution: 100.0 / 6842.0,
        range: 400.0,
        offset: 0.0,
        field_world: DVec3::new(0.0, 20.0, -44.0),
    };

    /// Standard deviation of a heading (rad).
    #[must_use]
    pub fn deviation(&self) -> f64 {
        let square = self.noise * self.noise
            + self.offset * self.offset
            + self.resolution * self.resolution / 12.0;
        square.sqrt() / self.field_world.with_z(0.0).norm()
    }
}

/// A magnetometer in flight.
#[derive(Clone, Debug)]
pub struct Magnetometer {
    parameters: MagnetometerParameters,
    offset: DVec3,
    schedule: Schedule<DVec3>,
    normal: Normal,
}

impl Magnetometer {
    /// Of a flight with `seed`, in ticks of `tick` (s).
    #[must_use]
    pub fn new(parameters: &MagnetometerParameters, seed: u64, tick: f64) -> Self {
        let MagnetometerParameters { rate, delay, offset, .. } = *parameters;
        let schedule = Schedule::new(rate, delay, 0.0, tick, Normal::new(seed, 20));
        let mut normal = Normal::new(seed, 21);
        let offset = offset * normal.vector();
        Self { parameters: *parameters, offset, schedule, normal }
    }

    /// A field when one arrives, body axes (µT).
    pub fn advance(&mut self, tick: u64, attitude: DQuat) -> Option<DVec3> {
        let Self { parameters, offset, schedule, normal } = self;
        schedule.advance(tick, || {
            let seen = attitude.inverse() * parameters.field_world
                + *offset
                + parameters.noise * normal.vector();
            Converter::new(parameters.range, parameters.resolution).convert_each(seen)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_scatter_by_the_deviation() {
        let parameters = MagnetometerParameters { rate: 1000.0, ..MagnetometerParameters::LIS3MDL };
        let mut magnetometer = Magnetometer::new(&parameters, 3, 1e-3);
        let attitude = DQuat::from_rotation_z(0.7) * DQuat::from_rotation_x(0.2);
        let (mut square, mut n) = (0.0, 0.0);
        for tick in 0..20_000 {
            if let Some(field) = magnetometer.advance(tick, attitude) {
                let world = attitude * field;
                // The angle from north, east positive.
                square += libm::atan2(world.x, world.y).powi(2);
                n += 1.0;
            }
        }
        let found = libm::sqrt(square / n);
        assert!((found / parameters.deviation() - 1.0).abs() < 0.02, "{found}");
    }
}
