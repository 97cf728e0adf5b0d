//! State of the estimator, and its output.

use bitflags::bitflags;
use glam::{Quat, Vec3};

use super::covariance::{Covariance, STATES};
use super::health::{Fault, Health};
use super::history::History;
use super::measurement::{InertialSample, SOURCES};
use crate::vehicle::VehicleState;

bitflags! {
    /// Usable parts of an estimate.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct Validity: u8 {
        /// Inertial samples arrive: the body rate is measured.
        const RATE = 1;
        /// Roll and pitch.
        const TILT = 1 << 1;
        /// Heading.
        const HEADING = 1 << 2;
        /// Velocity.
        const VELOCITY = 1 << 3;
        /// Position.
        const POSITION = 1 << 4;
    }
}

/// Restarts of position and velocity, announced so that controller and reference can shift with them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Restart {
    /// How often it happened; a change announces the next.
    pub count: u16,
    /// New less old position at the last one (m).
    pub position_shift_world: Vec3,
}

/// State of the estimator between two steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatorState {
    pub(super) position_world: Vec3,
    pub(super) velocity_world: Vec3,
    pub(super) attitude: Quat,
    pub(super) gyro_bias: Vec3,
    pub(super) accelerometer_bias: Vec3,
    pub(super) barometer_bias: f32,
    /// Of the last inertial sample, less the bias.
    pub(super) rate_body: Vec3,
    /// Rate and specific force beside gravity, body axes, without what is faster than the motion's time.
    pub(super) motion: [Vec3; 2],
    pub(super) held: InertialSample,
    pub(super) covariance: Covariance,
    pub(super) history: History,
    pub(super) inertial: Health,
    pub(super) sources: [Health; SOURCES.len()],
    pub(super) step: u32,
    /// Bias state whose noise the next prediction adds.
    pub(super) turn: u8,
    pub(super) restart: Restart,
    /// Covariances that had to be given up.
    pub(super) covariance_restarts: u16,
}

impl EstimatorState {
    /// All zero, for a static that [`Estimator::start_in`](super::Estimator::start_in) fills: no estimate before.
    pub const BLANK: Self = Self {
        position_world: Vec3::ZERO,
        velocity_world: Vec3::ZERO,
        attitude: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0),
        gyro_bias: Vec3::ZERO,
        accelerometer_bias: Vec3::ZERO,
        barometer_bias: 0.0,
        rate_body: Vec3::ZERO,
        motion: [Vec3::ZERO; 2],
        held: InertialSample { rate_body: Vec3::ZERO, specific_force_body: Vec3::ZERO },
        covariance: Covariance::BLANK,
        history: History::BLANK,
        inertial: Health::NEW,
        sources: [Health::NEW; SOURCES.len()],
        step: 0,
        turn: 0,
        restart: Restart { count: 0, position_shift_world: Vec3::ZERO },
        covariance_restarts: 0,
    };

    /// What the controllers take.
    #[inline(always)]
    #[must_use]
    pub fn vehicle(&self) -> VehicleState {
        VehicleState {
            position_world: self.position_world,
            velocity_world: self.velocity_world,
            attitude: self.attitude,
            rate_body: self.rate_body,
        }
    }

    /// Bias of the gyro, body axes (rad/s).
    #[must_use]
    pub fn gyro_bias(&self) -> Vec3 {
        self.gyro_bias
    }

    /// Bias of the accelerometer, body axes (m/s^2).
    #[must_use]
    pub fn accelerometer_bias(&self) -> Vec3 {
        self.accelerometer_bias
    }

    /// Bias of the barometer: what it shows too much (m).
    #[must_use]
    pub fn barometer_bias(&self) -> f32 {
        self.barometer_bias
    }

    /// Restarts of position and velocity.
    #[must_use]
    pub fn restart(&self) -> &Restart {
        &self.restart
    }

    /// Covariance of the error: truth less estimate, the attitude's as a rotation vector in world axes.
    #[must_use]
    pub fn covariance(&self) -> &Covariance {
        &self.covariance
    }

    /// The covariance in full.
    #[must_use]
    pub fn covariance_matrix(&self) -> [[f32; STATES]; STATES] {
        core::array::from_fn(|i| core::array::from_fn(|j| self.covariance.element(i, j)))
    }
}

/// Output of the estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// What the controllers take.
    pub vehicle: VehicleState,
    /// Its usable parts.
    pub validity: Validity,
    /// Time since the last inertial sample that was used (s); zero when it was the last step's.
    pub age: f32,
    /// Time since the last accepted measurement of each of the [`SOURCES`] (s); none before the first.
    pub source_ages: [Option<f32>; SOURCES.len()],
    /// Fault of each of the [`SOURCES`].
    pub faults: [Option<Fault>; SOURCES.len()],
    /// Fault of the inertial sensors.
    pub inertial_fault: Option<Fault>,
    /// Standard deviations of the position (m).
    pub position_deviation: Vec3,
    /// Standard deviations of the velocity (m/s).
    pub velocity_deviation: Vec3,
    /// Standard deviations of the attitude about world axes (rad).
    pub attitude_deviation: Vec3,
    /// Restarts of position and velocity.
    pub restart: Restart,
}
