//! Measurements, their sources and their verdicts.

use glam::{Quat, Vec2, Vec3};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

/// One inertial sample: means over the step that ends now, as sensors with a matched filter give them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct InertialSample {
    /// Angular velocity in body axes (rad/s).
    pub rate_body: Vec3,
    /// Specific force in body axes (m/s^2): at rest, gravity's magnitude along the axis that points up.
    pub specific_force_body: Vec3,
}

/// One measurement beside the inertial ones.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub enum Measurement {
    /// Height above the world frame's origin (m).
    Barometer(f32),
    /// Magnetic field in body axes, in any unit; its horizontal direction is the heading.
    Magnetometer(Vec3),
    /// Position in the world frame (m).
    GnssPosition(Vec3),
    /// Velocity in the world frame (m/s).
    GnssVelocity(Vec3),
    /// Position in the world frame (m).
    CapturePosition(Vec3),
    /// Attitude, body to world.
    CaptureAttitude(Quat),
    /// Distance to flat ground at height zero along the body's -z axis (m).
    Rangefinder(f32),
    /// Flow of the ground below: velocities along body x and y per distance along the body's -z axis (rad/s).
    ///
    /// The image's rotation is taken out by the gyro as it measures, its bias included: the estimator takes out
    /// the bias that it knows.
    OpticalFlow(Vec2),
}

/// Origin of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub enum Source {
    /// Barometer.
    Barometer,
    /// Magnetometer.
    Magnetometer,
    /// Position from GNSS.
    GnssPosition,
    /// Velocity from GNSS.
    GnssVelocity,
    /// Position from motion capture.
    CapturePosition,
    /// Attitude from motion capture.
    CaptureAttitude,
    /// Rangefinder.
    Rangefinder,
    /// Optical flow.
    OpticalFlow,
}

/// Every source.
pub const SOURCES: [Source; 8] = [
    Source::Barometer,
    Source::Magnetometer,
    Source::GnssPosition,
    Source::GnssVelocity,
    Source::CapturePosition,
    Source::CaptureAttitude,
    Source::Rangefinder,
    Source::OpticalFlow,
];

impl Source {
    /// Name, as the field of the configuration.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Barometer => "barometer",
            Self::Magnetometer => "magnetometer",
            Self::GnssPosition => "gnss_position",
            Self::GnssVelocity => "gnss_velocity",
            Self::CapturePosition => "capture_position",
            Self::CaptureAttitude => "capture_attitude",
            Self::Rangefinder => "rangefinder",
            Self::OpticalFlow => "optical_flow",
        }
    }
}

impl Measurement {
    /// Its source.
    #[must_use]
    pub const fn source(&self) -> Source {
        match self {
            Self::Barometer(_) => Source::Barometer,
            Self::Magnetometer(_) => Source::Magnetometer,
            Self::GnssPosition(_) => Source::GnssPosition,
            Self::GnssVelocity(_) => Source::GnssVelocity,
            Self::CapturePosition(_) => Source::CapturePosition,
            Self::CaptureAttitude(_) => Source::CaptureAttitude,
            Self::Rangefinder(_) => Source::Rangefinder,
            Self::OpticalFlow(_) => Source::OpticalFlow,
        }
    }

    /// Its numbers, zeros where it has fewer than four.
    #[must_use]
    pub fn numbers(&self) -> [f32; 4] {
        match *self {
            Self::Barometer(x) | Self::Rangefinder(x) => [x, 0.0, 0.0, 0.0],
            Self::OpticalFlow(x) => [x.x, x.y, 0.0, 0.0],
            Self::Magnetometer(x)
            | Self::GnssPosition(x)
            | Self::GnssVelocity(x)
            | Self::CapturePosition(x) => [x.x, x.y, x.z, 0.0],
            Self::CaptureAttitude(q) => [q.x, q.y, q.z, q.w],
        }
    }
}

/// Outcome of one measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// Taken in: squared innovations in units of their variances, and how many there are.
    Accepted {
        /// Sum over the components, each after the correction by those before it (NIS).
        normalised: f32,
        /// Components.
        components: u8,
    },
    /// An innovation lies outside the gate; nothing was taken in.
    Rejected,
    /// Not finite, out of every range, or of no direction.
    Unusable,
    /// Nothing that the measurement could be compared with: tilted beyond 60 degrees, or too near to the ground.
    Inapplicable,
    /// The sensor repeats itself.
    Stuck,
    /// Position and velocity were started anew from the measurement.
    Restarted,
}
