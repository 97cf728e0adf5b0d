//! Configuration of the estimator: noise of the sensors in the units of data sheets' densities, what is
//! known at the start, and the limits of faults.

use glam::Vec3;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use super::history::SLOTS;
use super::measurement::{SOURCES, Source};
use crate::error::{Bound, ConfigError, require};

/// Noise of the inertial sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct InertialNoise {
    /// Noise density of the gyro (rad/s/√Hz).
    pub gyro: f32,
    /// Noise density of the accelerometer (m/s^2/√Hz).
    pub accelerometer: f32,
    /// Random walk of the gyro's bias (rad/s/√s).
    pub gyro_bias: f32,
    /// Random walk of the accelerometer's bias (m/s^2/√s).
    pub accelerometer_bias: f32,
    /// Standard deviation of scale errors and couplings between axes after calibration, of both sensors (1).
    ///
    /// They have no states: what they add in motion counts as noise, see `docs/estimator.md`.
    pub distortion: f32,
    /// Time (s) to which `distortion` adds up: in motion that lasts longer. What is faster averages out.
    pub motion_time: f32,
}

/// Bias of the barometer, by the weather and the flow around the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct BarometerBias {
    /// Standard deviation at the start; zero for a barometer without bias (m).
    pub deviation: f32,
    /// Random walk (m/√s).
    pub walk: f32,
}

/// Standard deviations at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct InitialDeviation {
    /// Of each component of the position (m).
    pub position: f32,
    /// Of each component of the velocity (m/s).
    pub velocity: f32,
    /// Of roll and pitch (rad).
    pub tilt: f32,
    /// Of the heading (rad).
    pub heading: f32,
    /// Of each component of the gyro's bias (rad/s).
    pub gyro_bias: f32,
    /// Of each component of the accelerometer's bias (m/s^2).
    pub accelerometer_bias: f32,
}

/// One source of measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct SourceConfig {
    /// Standard deviation of each component along the horizontal axes, or of the only component: m, m/s
    /// or rad as the source measures.
    pub deviation: f32,
    /// Standard deviation of the vertical component; for a source with one component the same again.
    pub deviation_vertical: f32,
    /// Age of a measurement when it arrives (s).
    pub delay: f32,
    /// Time without an accepted measurement after which the source is missing (s).
    pub timeout: f32,
}

/// Limits beyond which a sensor is at fault.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct FaultLimits {
    /// Bound of an innovation's square in units of its variance: a chi-square value with one degree of freedom.
    pub gate: f32,
    /// Rejected measurements in a row after which the source jumps.
    pub rejections: u16,
    /// Equal samples in a row after which the sensor is stuck.
    pub repetitions: u16,
    /// Standard deviation of the position beyond which it is not valid (m).
    pub position: f32,
    /// Standard deviation of the velocity beyond which it is not valid (m/s).
    pub velocity: f32,
    /// Standard deviation of roll and pitch beyond which the attitude is not valid (rad).
    pub tilt: f32,
    /// Standard deviation of the heading beyond which it is not valid (rad).
    pub heading: f32,
}

/// Configuration of the [`Estimator`](super::Estimator).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct EstimatorConfig {
    /// `dt`: fixed time between two inertial samples (s).
    pub step_period: f32,
    /// Noise of the inertial sensors.
    pub inertial: InertialNoise,
    /// Standard deviations at the start.
    pub initial: InitialDeviation,
    /// The Earth's magnetic field, world axes, in any unit: heading from its horizontal direction, weight of
    /// the tilt from its inclination.
    pub magnetic_field_world: Vec3,
    /// Barometer: height (m).
    pub barometer: SourceConfig,
    /// Its bias.
    pub barometer_bias: BarometerBias,
    /// Magnetometer: heading (rad).
    pub magnetometer: SourceConfig,
    /// GNSS position (m).
    pub gnss_position: SourceConfig,
    /// GNSS velocity (m/s).
    pub gnss_velocity: SourceConfig,
    /// Motion-capture position (m).
    pub capture_position: SourceConfig,
    /// Motion-capture attitude (rad).
    pub capture_attitude: SourceConfig,
    /// Rangefinder: distance (m).
    pub rangefinder: SourceConfig,
    /// Optical flow: velocity per distance (rad/s).
    pub optical_flow: SourceConfig,
    /// Limits of faults.
    pub faults: FaultLimits,
}

impl EstimatorConfig {
    /// The configuration of one source.
    #[must_use]
    pub const fn source(&self, source: Source) -> &SourceConfig {
        match source {
            Source::Barometer => &self.barometer,
            Source::Magnetometer => &self.magnetometer,
            Source::GnssPosition => &self.gnss_position,
            Source::GnssVelocity => &self.gnss_velocity,
            Source::CapturePosition => &self.capture_position,
            Source::CaptureAttitude => &self.capture_attitude,
            Source::Rangefinder => &self.rangefinder,
            Source::OpticalFlow => &self.optical_flow,
        }
    }

    /// The configuration of one source, to change.
    pub fn source_mut(&mut self, source: Source) -> &mut SourceConfig {
        match source {
            Source::Barometer => &mut self.barometer,
            Source::Magnetometer => &mut self.magnetometer,
            Source::GnssPosition => &mut self.gnss_position,
            Source::GnssVelocity => &mut self.gnss_velocity,
            Source::CapturePosition => &mut self.capture_position,
            Source::CaptureAttitude => &mut self.capture_attitude,
            Source::Rangefinder => &mut self.rangefinder,
            Source::OpticalFlow => &mut self.optical_flow,
        }
    }

    /// Longest delay that a measurement may have, for slots of the history at every step up to every
    /// 255th (s).
    fn delay_max(&self) -> f32 {
        self.step_period * (255 * (SLOTS - 1)) as f32
    }

    /// Checks every field.
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        const RATE: &str = "step rates from 50 Hz to 10 kHz";
        require("step_period", self.step_period, Bound::Inside(1e-4, 0.02), RATE)?;
        const NOISE: &str = "a sensor without noise leaves no room for rounding";
        let noise = &self.inertial;
        require("inertial.gyro", noise.gyro, Bound::Inside(1e-7, 1.0), NOISE)?;
        require("inertial.accelerometer", noise.accelerometer, Bound::Inside(1e-6, 100.0), NOISE)?;
        require("inertial.gyro_bias", noise.gyro_bias, Bound::Inside(0.0, 1.0), "a random walk")?;
        require(
            "inertial.accelerometer_bias",
            noise.accelerometer_bias,
            Bound::Inside(0.0, 10.0),
            "a random walk",
        )?;
        let small = Bound::Inside(0.0, 0.1);
        require("inertial.distortion", noise.distortion, small, "scale and coupling")?;
        let time = Bound::Inside(0.0, 60.0);
        require("inertial.motion_time", noise.motion_time, time, "a correlation time")?;
        let bias = &self.barometer_bias;
        require("barometer_bias.deviation", bias.deviation, Bound::Inside(0.0, 1e3), "a bias")?;
        require("barometer_bias.walk", bias.walk, Bound::Inside(0.0, 10.0), "a random walk")?;
        let start = &self.initial;
        const START: &str = "a standard deviation";
        for (name, value, most) in [
            ("initial.position", start.position, 1e4),
            ("initial.velocity", start.velocity, 1e3),
            ("initial.tilt", start.tilt, 1.0),
            ("initial.heading", start.heading, 4.0),
            ("initial.gyro_bias", start.gyro_bias, 1.0),
            ("initial.accelerometer_bias", start.accelerometer_bias, 10.0),
        ] {
            require(name, value, Bound::Inside(1e-7, most), START)?;
        }
        let field = self.magnetic_field_world;
        let north = field.truncate().length_squared();
        const HORIZONTAL: &str = "the squared length of its horizontal part";
        require("magnetic_field_world", north, Bound::Inside(1e-6, 1e6), HORIZONTAL)?;
        let dip = field.z * field.z / north;
        const DIP: &str =
            "at the poles there is no heading: squared ratio of vertical to horizontal";
        require("magnetic_field_world", dip, Bound::Inside(0.0, 400.0), DIP)?;
        SOURCES.into_iter().try_for_each(|source| self.check_source(source))?;
        self.check_faults()
    }

    fn check_source(&self, source: Source) -> Result<(), ConfigError> {
        let SourceConfig { deviation, deviation_vertical, delay, timeout } = *self.source(source);
        let name = source.name();
        let bound = Bound::Inside(1e-5, 1e4);
        require(name, deviation, bound, "deviation")?;
        require(name, deviation_vertical, bound, "deviation_vertical")?;
        require(name, delay, Bound::Inside(0.0, self.delay_max().min(1.0)), "delay")?;
        require(name, timeout, Bound::Inside(self.step_period, 1e3), "timeout")
    }

    fn check_faults(&self) -> Result<(), ConfigError> {
        let limits = &self.faults;
        require("faults.gate", limits.gate, Bound::Inside(1.0, 1e3), "chi-square of one number")?;
        let counts = Bound::Inside(2.0, 60_000.0);
        require("faults.rejections", limits.rejections.into(), counts, "in a row")?;
        require("faults.repetitions", limits.repetitions.into(), counts, "in a row")?;
        for (name, value) in [
            ("faults.position", limits.position),
            ("faults.velocity", limits.velocity),
            ("faults.tilt", limits.tilt),
            ("faults.heading", limits.heading),
        ] {
            require(name, value, Bound::Inside(1e-4, 1e4), "a standard deviation")?;
        }
        Ok(())
    }

    /// Steps between two slots of the history, so that it covers the longest delay.
    pub(super) fn slot_spacing(&self) -> u16 {
        let longest = SOURCES
            .into_iter()
            .fold(0.0f32, |longest, source| longest.max(self.source(source).delay));
        let spacing = longest / (self.step_period * (SLOTS - 2) as f32);
        (spacing as u16).saturating_add(1)
    }

    /// Variances at the start, in the order of the states.
    pub(super) fn initial_variances(&self) -> [f32; super::covariance::STATES] {
        let s = &self.initial;
        let [p, v, g, a] =
            [s.position, s.velocity, s.gyro_bias, s.accelerometer_bias].map(|x| x * x);
        let (t, h) = (s.tilt * s.tilt, s.heading * s.heading);
        let b = self.barometer_bias.deviation * self.barometer_bias.deviation;
        [b, p, p, p, v, v, v, t, t, h, g, g, g, a, a, a]
    }

    /// Variances of position and velocity after a restart at a measurement of `source`.
    pub(super) fn restart_variances(&self, source: Source) -> (Vec3, Vec3) {
        let SourceConfig { deviation, deviation_vertical, .. } = *self.source(source);
        let (p, z) = (deviation * deviation, deviation_vertical * deviation_vertical);
        (Vec3::new(p, p, z), Vec3::splat(self.initial.velocity * self.initial.velocity))
    }
}
