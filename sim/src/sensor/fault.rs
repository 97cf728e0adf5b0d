//! Faults of sensors in flight: nothing, the same again and again, or a step aside.

use ctrl_core::estimator::{Measurement, SOURCES};
use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// Sensor that a fault belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FaultySensor {
    /// Barometer.
    Barometer,
    /// Magnetometer.
    Magnetometer,
    /// GNSS receiver: position and velocity.
    Gnss,
    /// Motion capture: position and attitude.
    Capture,
    /// Rangefinder.
    Rangefinder,
    /// Optical flow.
    Flow,
}

/// Kind of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FaultKind {
    /// No samples.
    Missing,
    /// The last sample again and again, at the sensor's rate.
    Stuck,
    /// Positions and heights step aside by this distance along x and z (m); other quantities by it in their unit.
    Jumping(f64),
    /// Not a number.
    NotFinite,
}

/// A fault over a part of the flight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorFault {
    /// Sensor.
    pub sensor: FaultySensor,
    /// Kind.
    pub kind: FaultKind,
    /// Begin (s).
    pub start: f64,
    /// Duration (s).
    pub duration: f64,
}

/// Faults in progress.
#[derive(Clone, Debug)]
pub struct Faults {
    faults: Vec<SensorFault>,
    last: [Option<Measurement>; SOURCES.len()],
}

fn sensor(measurement: &Measurement) -> FaultySensor {
    match measurement {
        Measurement::Barometer(_) => FaultySensor::Barometer,
        Measurement::Magnetometer(_) => FaultySensor::Magnetometer,
        Measurement::GnssPosition(_) | Measurement::GnssVelocity(_) => FaultySensor::Gnss,
        Measurement::CapturePosition(_) | Measurement::CaptureAttitude(_) => FaultySensor::Capture,
        Measurement::Rangefinder(_) => FaultySensor::Rangefinder,
        Measurement::OpticalFlow(_) => FaultySensor::Flow,
    }
}

/// The measurement with `step` added to its first number and its third.
fn aside(measurement: Measurement, step: f32) -> Measurement {
    let vector = Vec3::new(step, 0.0, step);
    match measurement {
        Measurement::Barometer(x) => Measurement::Barometer(x + step),
        Measurement::Rangefinder(x) => Measurement::Rangefinder(x + step),
        Measurement::Magnetometer(x) => Measurement::Magnetometer(x + vector),
        Measurement::GnssPosition(x) => Measurement::GnssPosition(x + vector),
        Measurement::GnssVelocity(x) => Measurement::GnssVelocity(x + vector),
        Measurement::CapturePosition(x) => Measurement::CapturePosition(x + vector),
        Measurement::OpticalFlow(x) => Measurement::OpticalFlow(x + Vec2::X * step),
        Measurement::CaptureAttitude(_) => measurement,
    }
}

/// The measurement with its first number not a number.
fn broken(measurement: Measurement) -> Measurement {
    match measurement {
        Measurement::CaptureAttitude(q) => Measurement::CaptureAttitude(q * f32::NAN),
        _ => aside(measurement, f32::NAN),
    }
}

impl Faults {
    /// Of one flight.
    #[must_use]
    pub fn new(faults: &[SensorFault]) -> Self {
        Self { faults: faults.to_vec(), last: Default::default() }
    }

    /// What arrives at `time` (s) in place of `measurement`.
    pub fn apply(&mut self, time: f64, measurement: Measurement) -> Option<Measurement> {
        let sensor = sensor(&measurement);
        let fault = self.faults.iter().find(|fault| {
            fault.sensor == sensor && (fault.start..fault.start + fault.duration).contains(&time)
        });
        let last = &mut self.last[measurement.source() as usize];
        match fault.map(|fault| fault.kind) {
            None => {
                *last = Some(measurement);
                Some(measurement)
            }
            Some(FaultKind::Missing) => None,
            Some(FaultKind::Stuck) => Some(*last.get_or_insert(measurement)),
            Some(FaultKind::Jumping(step)) => Some(aside(measurement, step as f32)),
            Some(FaultKind::NotFinite) => Some(broken(measurement)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_acts_on_its_sensor_over_its_time() {
        let fault = |kind| {
            Faults::new(&[SensorFault {
                sensor: FaultySensor::Barometer,
                kind,
                start: 1.0,
                duration: 2.0,
            }])
        };
        let height = |faults: &mut Faults, time, x| faults.apply(time, Measurement::Barometer(x));
        let mut missing = fault(FaultKind::Missing);
        assert!(
            height(&mut missing, 0.9, 1.0).is_some() && height(&mut missing, 3.0, 1.0).is_some()
        );
        assert!(
            height(&mut missing, 1.0, 1.0).is_none() && height(&mut missing, 2.9, 1.0).is_none()
        );
        let mut stuck = fault(FaultKind::Stuck);
        height(&mut stuck, 0.5, 4.0);
        assert_eq!(height(&mut stuck, 1.5, 5.0), Some(Measurement::Barometer(4.0)));
        let mut jumping = fault(FaultKind::Jumping(3.0));
        assert_eq!(height(&mut jumping, 1.5, 5.0), Some(Measurement::Barometer(8.0)));
        let other = Measurement::Rangefinder(1.0);
        assert_eq!(jumping.apply(1.5, other), Some(other));
        let mut broken = fault(FaultKind::NotFinite);
        assert!(
            matches!(height(&mut broken, 1.5, 5.0), Some(Measurement::Barometer(x)) if x.is_nan())
        );
    }
}
