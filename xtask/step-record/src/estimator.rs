//! The flight through which the estimator is measured: the same on host and target, from a seed.

use ctrl_core::estimator::{BarometerBias, EstimatorConfig, InertialSample, Measurement};
use ctrl_core::vehicle::{GRAVITY, VehicleState};
use glam::{Quat, Vec2, Vec3};

use super::Record;

/// Predictions in the flight.
pub const STEPS: u32 = 3_000;
/// Predictions per measurement of each kind.
const SPACING: u32 = 20;
/// Kinds of measurements.
pub const KINDS: usize = 8;

/// Configuration of the flight.
pub const CONFIG: EstimatorConfig = EstimatorConfig {
    barometer_bias: BarometerBias { deviation: 0.5, walk: 0.02 },
    ..EstimatorConfig::EXAMPLE
};

/// The state that the flight starts from.
#[must_use]
pub fn start() -> VehicleState {
    VehicleState::at_rest(Vec3::new(1.0, -2.0, 3.0))
}

/// One call of the estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// A prediction.
    Predict(InertialSample),
    /// A correction.
    Correct(Measurement),
}

/// The events of the flight: hovering, with uniform noise.
#[derive(Clone, Debug)]
pub struct Events {
    bits: u64,
    step: u32,
    kind: Option<usize>,
}

impl Events {
    /// From the first on.
    #[must_use]
    pub fn new() -> Self {
        Self { bits: 0x9E37_79B9_7F4A_7C15, step: 0, kind: None }
    }

    /// Uniform in `[-1, 1)`.
    fn number(&mut self) -> f32 {
        self.bits ^= self.bits << 13;
        self.bits ^= self.bits >> 7;
        self.bits ^= self.bits << 17;
        (self.bits >> 40) as f32 * (1.0 / 8_388_608.0) - 1.0
    }

    fn vector(&mut self, scale: f32) -> Vec3 {
        Vec3::new(self.number(), self.number(), self.number()) * scale
    }

    fn measurement(&mut self, kind: usize) -> Measurement {
        let position = start().position_world;
        match kind {
            0 => Measurement::Barometer(position.z + 0.3 * self.number()),
            1 => Measurement::Magnetometer(Vec3::new(0.0, 20.0, -40.0) + self.vector(0.4)),
            2 => Measurement::GnssPosition(position + self.vector(2.0)),
            3 => Measurement::GnssVelocity(self.vector(0.05)),
            4 => Measurement::CapturePosition(position + self.vector(1e-3)),
            5 => {
                let x = self.vector(2e-3);
                Measurement::CaptureAttitude(Quat::from_xyzw(x.x, x.y, x.z, 1.0))
            }
            6 => Measurement::Rangefinder(position.z + 0.02 * self.number()),
            _ => Measurement::OpticalFlow(0.05 * Vec2::new(self.number(), self.number())),
        }
    }
}

impl Default for Events {
    fn default() -> Self {
        Self::new()
    }
}

impl Iterator for Events {
    type Item = Event;

    fn next(&mut self) -> Option<Event> {
        if let Some(kind) = self.kind {
            self.kind = (kind + 1 < KINDS).then_some(kind + 1);
            return Some(Event::Correct(self.measurement(kind)));
        }
        if self.step == STEPS {
            return None;
        }
        self.step += 1;
        self.kind = self.step.is_multiple_of(SPACING).then_some(0);
        let sample = InertialSample {
            rate_body: self.vector(0.01),
            specific_force_body: GRAVITY * Vec3::Z + self.vector(0.05),
        };
        Some(Event::Predict(sample))
    }
}

/// State after an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EstimatorAnswer(pub [u32; 14]);

impl EstimatorAnswer {
    /// Bits of the estimate and of a biases' component.
    #[must_use]
    pub fn new(vehicle: &VehicleState, gyro_bias: Vec3) -> Self {
        let (p, v, q, w) =
            (vehicle.position_world, vehicle.velocity_world, vehicle.attitude, vehicle.rate_body);
        let numbers =
            [p.x, p.y, p.z, v.x, v.y, v.z, q.x, q.y, q.z, q.w, w.x, w.y, w.z, gyro_bias.x];
        Self(numbers.map(f32::to_bits))
    }
}

impl Record for EstimatorAnswer {
    fn zero() -> Self {
        Self([0; 14])
    }

    fn visit(&mut self, word: &mut impl FnMut(&mut u32)) {
        self.0.iter_mut().for_each(word);
    }
}
