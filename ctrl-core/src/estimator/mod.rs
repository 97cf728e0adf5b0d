//! Estimate of the vehicle's state from its sensors: an error-state Kalman filter with 16 states.
//!
//! Position, velocity and attitude follow the inertial samples; their errors and the biases of gyro and
//! accelerometer, and the barometer's bias, are 16 error states with a covariance, which barometer, magnetometer,
//! GNSS, motion capture, rangefinder and optical flow correct, one number after the other. `docs/estimator.md` has the equations.
//!
//! - The attitude error is a rotation in *world* axes. The order barometer bias, position, velocity, attitude, biases then
//!   makes the transition matrix unit upper triangular, and a covariance in the factors `U D U^T` is
//!   propagated exactly: see [`covariance`].
//! - Every measurement passes a chi-square gate; stuck, jumping and missing sensors are named in the
//!   [`Estimate`] and do no harm. A position source that keeps disagreeing when no other is left restarts
//!   position and velocity, and the restart is announced.
//! - Delayed measurements are compared with the past through a bounded [`history`].
//!
//! Configuration and state are separate; both steps are total, allocate nothing and loop over fixed sizes.
//!
//! ```
//! use ctrl_core::estimator::{Estimator, EstimatorConfig, InertialSample, Measurement};
//! use ctrl_core::vehicle::{GRAVITY, VehicleState};
//! use glam::Vec3;
//!
//! let estimator = Estimator::new(&EstimatorConfig::EXAMPLE)?;
//! let mut state = estimator.start(&VehicleState::at_rest(Vec3::ZERO));
//! let resting =
//!     InertialSample { rate_body: Vec3::ZERO, specific_force_body: GRAVITY * Vec3::Z };
//! for step in 0..2_000 {
//!     estimator.predict(&mut state, &resting);
//!     if step % 10 == 0 {
//!         let seen = Vec3::new(0.5, 0.0, 0.001 * (step % 3) as f32);
//!         estimator.correct(&mut state, &Measurement::CapturePosition(seen));
//!     }
//! }
//! assert!((estimator.estimate(&state).vehicle.position_world.x - 0.5).abs() < 1e-2);
//! # Ok::<(), ctrl_core::error::ConfigError>(())
//! ```

pub mod alignment;
mod config;
mod correction;
pub mod covariance;
mod health;
pub mod history;
mod measurement;
mod prediction;
mod shift;
mod state;
#[cfg(test)]
mod tests;

pub use config::{
    BarometerBias, EstimatorConfig, FaultLimits, InertialNoise, InitialDeviation, SourceConfig,
};
pub use health::{Fault, Health};
pub use measurement::{InertialSample, Measurement, SOURCES, Source, Verdict};
pub use shift::{RESTART_SHARE, ReferenceShift};
pub use state::{Estimate, EstimatorState, Restart, Validity};

use glam::{Quat, Vec2, Vec3};

use crate::error::ConfigError;
use crate::rotation::renormalised;
use crate::sqrt::sqrt;
use crate::vehicle::VehicleState;
use covariance::{ATTITUDE, POSITION, VELOCITY};

/// Time without a usable inertial sample after which rates are no longer valid (s).
const INERTIAL_TIMEOUT: f32 = 0.02;

/// A validated configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimator {
    config: EstimatorConfig,
    /// Variances that one prediction adds when it is their turn: velocity, attitude, a bias state of either
    /// kind; and the barometer's bias, at each.
    noise: [f32; 5],
    /// Variance per square of rate or of specific force beside gravity, added like the first two.
    distortion: f32,
    /// Share of a new sample in the slow motion.
    motion_share: f32,
    /// Unit vector along the magnetic field's horizontal part.
    north: Vec2,
    /// Vertical part of the field per horizontal part.
    dip: f32,
    slot_spacing: u16,
}

impl Estimator {
    /// Checks the configuration.
    ///
    /// # Errors
    /// Names the field and its bound.
    pub fn new(config: &EstimatorConfig) -> Result<Self, ConfigError> {
        config.check()?;
        let (dt, noise) = (config.step_period, &config.inertial);
        // Velocity and attitude have their noise in turn, and so do the six bias states.
        let square = |density: f32| 2.0 * density * density * dt;
        let walk = |density: f32| f32::from(prediction::TURNS) * density * density * dt;
        let field = config.magnetic_field_world;
        let (north, horizontal) = (field.truncate(), sqrt(field.truncate().length_squared()));
        let walk_height = config.barometer_bias.walk;
        Ok(Self {
            config: *config,
            noise: [
                square(noise.accelerometer),
                square(noise.gyro),
                walk(noise.gyro_bias),
                walk(noise.accelerometer_bias),
                walk_height * walk_height * dt,
            ],
            // An error that lasts over a time to either side has the density of white noise with this variance.
            motion_share: dt / (dt + noise.motion_time),
            distortion: 2.0 * noise.motion_time * square(noise.distortion),
            north: north / horizontal,
            dip: field.z / horizontal,
            slot_spacing: config.slot_spacing(),
        })
    }

    /// The configuration.
    #[must_use]
    pub fn config(&self) -> &EstimatorConfig {
        &self.config
    }

    /// The state of a vehicle that is known up to the configured deviations; biases zero. A vector that is
    /// not finite or out of range is taken as zero.
    #[must_use]
    pub fn start(&self, vehicle: &VehicleState) -> EstimatorState {
        let mut state = EstimatorState::BLANK;
        self.start_in(&mut state, vehicle);
        state
    }

    /// As [`start`](Self::start), in place: a state is kilobytes.
    pub fn start_in(&self, state: &mut EstimatorState, vehicle: &VehicleState) {
        let within = |x: Vec3, limit: f32| {
            let good = x.to_array().iter().all(|x| x.abs() <= limit);
            if good { x } else { Vec3::ZERO }
        };
        let rate_body = within(vehicle.rate_body, prediction::RATE_MAX);
        state.position_world = within(vehicle.position_world, prediction::STATE_MAX);
        state.velocity_world = within(vehicle.velocity_world, prediction::STATE_MAX);
        state.attitude = renormalised(vehicle.attitude).unwrap_or(Quat::IDENTITY);
        (state.gyro_bias, state.accelerometer_bias) = (Vec3::ZERO, Vec3::ZERO);
        state.barometer_bias = 0.0;
        state.rate_body = rate_body;
        state.motion = [Vec3::ZERO; 2];
        let specific_force_body = crate::vehicle::GRAVITY * Vec3::Z;
        state.held = InertialSample { rate_body, specific_force_body };
        state.covariance.set_diagonal(&self.config.initial_variances());
        state.history.begin();
        state.inertial = Health::NEW;
        state.sources = [Health::NEW; SOURCES.len()];
        (state.step, state.turn) = (0, 0);
        state.restart = Restart::default();
        state.covariance_restarts = 0;
    }

    /// Time between predictions (s).
    #[must_use]
    pub fn step_period(&self) -> f32 {
        self.config.step_period
    }

    /// The estimate with its validity, ages, faults and deviations.
    #[must_use]
    pub fn estimate(&self, state: &EstimatorState) -> Estimate {
        let EstimatorConfig { step_period, faults, .. } = &self.config;
        let seconds = |steps: u32| steps as f32 * step_period;
        let inertial_timeout = INERTIAL_TIMEOUT / step_period;
        let deviations = |first| {
            let variances = state.covariance.variances(first).to_array();
            Vec3::from_array(variances.map(sqrt))
        };
        let [position, velocity, attitude] = [POSITION, VELOCITY, ATTITUDE].map(deviations);
        let inertial_age = state.inertial.age(state.step).unwrap_or(state.step);
        let mut validity = Validity::empty();
        let rate = inertial_age as f32 <= inertial_timeout;
        validity.set(Validity::RATE, rate);
        validity.set(Validity::TILT, rate && attitude.x.max(attitude.y) <= faults.tilt);
        validity.set(Validity::HEADING, rate && attitude.z <= faults.heading);
        validity.set(Validity::VELOCITY, rate && velocity.max_element() <= faults.velocity);
        validity.set(Validity::POSITION, rate && position.max_element() <= faults.position);
        let fault = |k: usize| {
            let timeout = self.config.source(SOURCES[k]).timeout / step_period;
            state.sources[k].fault(state.step, timeout, faults)
        };
        Estimate {
            vehicle: state.vehicle(),
            validity,
            age: seconds(inertial_age),
            source_ages: state.sources.map(|health| health.age(state.step).map(seconds)),
            faults: core::array::from_fn(fault),
            inertial_fault: state.inertial.fault(state.step, inertial_timeout, faults),
            position_deviation: position,
            velocity_deviation: velocity,
            attitude_deviation: attitude,
            restart: state.restart,
        }
    }

    /// Rotation about z from the field's horizontal direction to the world's x.
    fn north_rotation(&self) -> Quat {
        // Half the angle: the direction half way between x and north.
        let half = Vec2::new(1.0 + self.north.x, self.north.y);
        let length = half.length_squared();
        if length < 1e-6 {
            return Quat::from_xyzw(0.0, 0.0, 1.0, 0.0);
        }
        let half = half / sqrt(length);
        Quat::from_xyzw(0.0, 0.0, half.y, half.x)
    }
}

impl EstimatorConfig {
    /// A micro-electromechanical IMU at 1 kHz, GNSS, barometer, magnetometer and motion capture of common
    /// quality: an example, and a start for a configuration of one's own.
    pub const EXAMPLE: Self = Self {
        step_period: 1e-3,
        inertial: InertialNoise {
            gyro: 2.5e-4,
            accelerometer: 2e-3,
            gyro_bias: 1e-5,
            accelerometer_bias: 1e-4,
            distortion: 5e-4,
            motion_time: 0.5,
        },
        initial: InitialDeviation {
            position: 1.0,
            velocity: 0.2,
            tilt: 0.02,
            heading: 0.05,
            gyro_bias: 0.01,
            accelerometer_bias: 0.1,
        },
        magnetic_field_world: Vec3::new(0.0, 20.0, -40.0),
        barometer: SourceConfig {
            deviation: 0.3,
            deviation_vertical: 0.3,
            delay: 0.0,
            timeout: 0.5,
        },
        barometer_bias: BarometerBias { deviation: 0.0, walk: 0.0 },
        magnetometer: SourceConfig {
            deviation: 0.03,
            deviation_vertical: 0.03,
            delay: 0.0,
            timeout: 0.5,
        },
        gnss_position: SourceConfig {
            deviation: 1.2,
            deviation_vertical: 2.0,
            delay: 0.1,
            timeout: 1.0,
        },
        gnss_velocity: SourceConfig {
            deviation: 0.05,
            deviation_vertical: 0.1,
            delay: 0.1,
            timeout: 1.0,
        },
        capture_position: SourceConfig {
            deviation: 1e-3,
            deviation_vertical: 1e-3,
            delay: 0.01,
            timeout: 0.1,
        },
        capture_attitude: SourceConfig {
            deviation: 5e-3,
            deviation_vertical: 5e-3,
            delay: 0.01,
            timeout: 0.1,
        },
        rangefinder: SourceConfig {
            deviation: 0.02,
            deviation_vertical: 0.02,
            delay: 0.01,
            timeout: 0.5,
        },
        optical_flow: SourceConfig {
            deviation: 0.05,
            deviation_vertical: 0.05,
            delay: 0.01,
            timeout: 0.5,
        },
        faults: FaultLimits {
            gate: 16.0,
            rejections: 5,
            repetitions: 10,
            position: 5.0,
            velocity: 1.0,
            tilt: 0.1,
            heading: 0.3,
        },
    };
}
