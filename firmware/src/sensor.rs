//! Sensors of the vehicle: one trait for each, behind which a driver or the host of a simulation stands.
//!
//! [`collect`] asks every sensor once and gives a [`SensorFrame`], one for each control tick. The host's sensors are [`HostSensors`], which hold the samples of the link's frames. Drivers of parts
//! on a board implement the same traits; none is here yet.

use ctrl_core::estimator::{InertialSample, Measurement};
use ctrl_core::vehicle::VehicleState;
use glam::{Quat, Vec2, Vec3};

/// Measurements that one tick takes at most: one of each source.
pub const MEASUREMENTS: usize = 8;

/// Gyro and accelerometer: means over the control period that ends now.
pub trait InertialSensor {
    /// The sample of this period, once.
    fn inertial(&mut self) -> Option<InertialSample>;
}

/// Height by pressure.
pub trait Barometer {
    /// Height above the world's origin (m), once.
    fn height(&mut self) -> Option<f32>;
}

/// The Earth's magnetic field.
pub trait Magnetometer {
    /// Field in body axes, in any unit, once.
    fn field(&mut self) -> Option<Vec3>;
}

/// Satellite navigation.
pub trait Gnss {
    /// Position in the world frame (m), once.
    fn gnss_position(&mut self) -> Option<Vec3>;
    /// Velocity in the world frame (m/s), once.
    fn gnss_velocity(&mut self) -> Option<Vec3>;
}

/// Motion capture.
pub trait Capture {
    /// Position in the world frame (m), once.
    fn capture_position(&mut self) -> Option<Vec3>;
    /// Attitude, body to world, once.
    fn capture_attitude(&mut self) -> Option<Quat>;
}

/// Distance to the ground.
pub trait Rangefinder {
    /// Distance along the body's -z axis (m), once.
    fn distance(&mut self) -> Option<f32>;
}

/// Optical flow.
pub trait FlowSensor {
    /// Flow without rotation as the gyro measured it (rad/s), once.
    fn flow(&mut self) -> Option<Vec2>;
}

/// What the sensors have given since the last tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorFrame {
    /// The estimate begins anew at this state.
    pub start: Option<VehicleState>,
    /// The inertial sample.
    pub inertial: Option<InertialSample>,
    /// Control periods before it of which no sample has come.
    pub missed: u64,
    /// Measurements, in the order in which they are taken in.
    pub measurements: [Option<Measurement>; MEASUREMENTS],
}

/// Asks every sensor once.
pub fn collect<S>(sensors: &mut S) -> SensorFrame
where
    S: InertialSensor + Barometer + Magnetometer + Gnss + Capture + Rangefinder + FlowSensor,
{
    SensorFrame {
        start: None,
        inertial: sensors.inertial(),
        missed: 0,
        measurements: [
            sensors.height().map(Measurement::Barometer),
            sensors.field().map(Measurement::Magnetometer),
            sensors.gnss_position().map(Measurement::GnssPosition),
            sensors.gnss_velocity().map(Measurement::GnssVelocity),
            sensors.capture_position().map(Measurement::CapturePosition),
            sensors.capture_attitude().map(Measurement::CaptureAttitude),
            sensors.distance().map(Measurement::Rangefinder),
            sensors.flow().map(Measurement::OpticalFlow),
        ],
    }
}

/// Sensors of a simulated vehicle, whose samples come over the link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HostSensors {
    start: Option<VehicleState>,
    inertial: Option<InertialSample>,
    missed: u64,
    height: Option<f32>,
    field: Option<Vec3>,
    gnss_position: Option<Vec3>,
    gnss_velocity: Option<Vec3>,
    capture_position: Option<Vec3>,
    capture_attitude: Option<Quat>,
    distance: Option<f32>,
    flow: Option<Vec2>,
}

impl HostSensors {
    /// Sensors that have given nothing.
    pub const NONE: Self = Self {
        start: None,
        inertial: None,
        missed: 0,
        height: None,
        field: None,
        gnss_position: None,
        gnss_velocity: None,
        capture_position: None,
        capture_attitude: None,
        distance: None,
        flow: None,
    };

    /// The estimate begins anew at `state`.
    pub fn start(&mut self, state: VehicleState) {
        self.start = Some(state);
    }

    /// Puts an inertial sample in, behind `missed` periods without one.
    pub fn put_inertial(&mut self, sample: InertialSample, missed: u64) {
        self.missed = self.missed.saturating_add(missed);
        self.inertial = Some(sample);
    }

    /// Puts a measurement in; a later one of the same source replaces it.
    pub fn put(&mut self, measurement: Measurement) {
        match measurement {
            Measurement::Barometer(height) => self.height = Some(height),
            Measurement::Magnetometer(field) => self.field = Some(field),
            Measurement::GnssPosition(position) => self.gnss_position = Some(position),
            Measurement::GnssVelocity(velocity) => self.gnss_velocity = Some(velocity),
            Measurement::CapturePosition(position) => self.capture_position = Some(position),
            Measurement::CaptureAttitude(attitude) => self.capture_attitude = Some(attitude),
            Measurement::Rangefinder(distance) => self.distance = Some(distance),
            Measurement::OpticalFlow(flow) => self.flow = Some(flow),
        }
    }

    /// What has come since it was last taken, once a start or an inertial sample has: measurements wait for it.
    pub fn take(&mut self) -> Option<SensorFrame> {
        let start = self.start.take();
        let missed = core::mem::take(&mut self.missed);
        let due = start.is_some() || self.inertial.is_some();
        due.then(|| SensorFrame { start, missed, ..collect(self) })
    }
}

impl InertialSensor for HostSensors {
    fn inertial(&mut self) -> Option<InertialSample> {
        self.inertial.take()
    }
}

impl Barometer for HostSensors {
    fn height(&mut self) -> Option<f32> {
        self.height.take()
    }
}

impl Magnetometer for HostSensors {
    fn field(&mut self) -> Option<Vec3> {
        self.field.take()
    }
}

impl Gnss for HostSensors {
    fn gnss_position(&mut self) -> Option<Vec3> {
        self.gnss_position.take()
    }

    fn gnss_velocity(&mut self) -> Option<Vec3> {
        self.gnss_velocity.take()
    }
}

impl Capture for HostSensors {
    fn capture_position(&mut self) -> Option<Vec3> {
        self.capture_position.take()
    }

    fn capture_attitude(&mut self) -> Option<Quat> {
        self.capture_attitude.take()
    }
}

impl Rangefinder for HostSensors {
    fn distance(&mut self) -> Option<f32> {
        self.distance.take()
    }
}

impl FlowSensor for HostSensors {
    fn flow(&mut self) -> Option<Vec2> {
        self.flow.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_holds_the_latest_of_each_source_once_in_the_order_of_the_sources() {
        let mut sensors = HostSensors::NONE;
        let sample = InertialSample { rate_body: Vec3::X, specific_force_body: Vec3::Z };
        sensors.put(Measurement::CapturePosition(Vec3::X));
        sensors.put(Measurement::Barometer(1.0));
        sensors.put(Measurement::Barometer(2.0));
        assert_eq!(sensors.take(), None, "measurements wait for the inertial sample");
        sensors.put_inertial(sample, 2);
        let frame = sensors.take().unwrap();
        assert_eq!((frame.start, frame.inertial, frame.missed), (None, Some(sample), 2));
        let taken: std::vec::Vec<_> = frame.measurements.into_iter().flatten().collect();
        let expected = [Measurement::Barometer(2.0), Measurement::CapturePosition(Vec3::X)];
        assert_eq!(taken, expected);
        assert_eq!(sensors.take(), None);
    }

    #[test]
    fn every_source_has_its_place() {
        use ctrl_core::estimator::SOURCES;
        let all = [
            Measurement::Barometer(1.0),
            Measurement::Magnetometer(Vec3::X),
            Measurement::GnssPosition(Vec3::X),
            Measurement::GnssVelocity(Vec3::Y),
            Measurement::CapturePosition(Vec3::Z),
            Measurement::CaptureAttitude(Quat::IDENTITY),
            Measurement::Rangefinder(2.0),
            Measurement::OpticalFlow(Vec2::X),
        ];
        let mut sensors = HostSensors::NONE;
        all.into_iter().rev().for_each(|measurement| sensors.put(measurement));
        sensors.put_inertial(InertialSample::default(), 0);
        assert_eq!(sensors.take().unwrap().measurements, all.map(Some));
        assert_eq!(all.map(|measurement| measurement.source()), SOURCES);
    }
}
