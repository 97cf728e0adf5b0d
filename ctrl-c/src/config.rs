//! Configuration of either controller as one C struct, with the names of the Rust configuration.

use ctrl_core::config::{CascadeGains, IntegralAction, RobustAdaptiveConfig, SaturatedConfig};
use ctrl_core::controller::ControllerConfig;
use ctrl_core::rotors::RotorModel;
use ctrl_core::vehicle::{InitialEstimate, Uncertainty};

use crate::access::Sized32;
use crate::result::code::{GYRFALCON_UNKNOWN_KIND, GYRFALCON_WRONG_ABI_VERSION};
use crate::result::{Failure, GYRFALCON_ABI_VERSION};
use crate::types::{GyrfalconInterval, GyrfalconVector, GyrfalconVectorInterval};

/// `kind` of controller 1, the robust adaptive controller (Theorem 1).
pub const GYRFALCON_ROBUST_ADAPTIVE: u32 = 1;
/// `kind` of controller 2, with limited thrust and torque (Theorem 2).
pub const GYRFALCON_SATURATED: u32 = 2;

/// Known bounds of the vehicle and of its disturbances.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct GyrfalconUncertainty {
    /// The mass lies inside (kg).
    pub mass: GyrfalconInterval,
    /// Each principal moment of inertia lies inside that of its axis (kg m^2).
    pub inertia: GyrfalconVectorInterval,
    /// Bound of each component of the disturbance acceleration (m/s^2).
    pub disturbance_acceleration: f32,
    /// Bound of the disturbance torque about each body axis (N m).
    pub disturbance_torque: GyrfalconVector,
}

/// Estimates at the first step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct GyrfalconInitial {
    /// Mass (kg), inside its interval.
    pub mass: f32,
    /// Principal moments of inertia (kg m^2), each inside its interval.
    pub inertia: GyrfalconVector,
}

/// Gains of the cascade that both controllers share.
#[allow(non_snake_case)] // the names of the refusals
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct GyrfalconCascade {
    /// Position gain inside the saturations (1/m).
    pub k1: f32,
    /// Velocity gain inside the saturations (s/m).
    pub k2: f32,
    /// Attitude gain about each body axis (1/s).
    pub k3: GyrfalconVector,
    /// Weight of the translational Lyapunov function.
    pub c: f32,
    /// Limit of the position part of the commanded acceleration (m/s^2).
    pub M1: f32,
    /// Limit of the velocity part of the commanded acceleration (m/s^2).
    pub M2: f32,
    /// Adaptation gain of the inverse mass (1/(kg N)); zero switches it off.
    pub gamma1: f32,
    /// Decay rate of the smoothing width (1/s).
    pub delta_1: f32,
    /// Floor of the smoothing width of the translational smooth sign (1/s).
    pub delta_min_translation: f32,
    /// Floor of the smoothing width of the rotational smooth sign (rad/s).
    pub delta_min_rotation: f32,
}

/// Integral action against disturbances that last; all zero: none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct GyrfalconIntegral {
    /// Bound of each horizontal component of the lasting disturbance acceleration (m/s^2).
    pub acceleration_max: f32,
    /// Gain of its estimate (m/s^2).
    pub gamma_d: f32,
    /// Bound of each component of the lasting disturbance torque (N m).
    pub torque_max: f32,
    /// Gain of its estimate: of controller 1 (N m), of controller 2 (1/s^2).
    pub gamma_t: f32,
}

/// Rotors that lag behind the torque command, as the law takes them to be; all zero: none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct GyrfalconRotors {
    /// Time constant with which the torque follows the command (s).
    pub lag: f32,
    /// Time constant that the lead leaves of it (s); zero for no lead.
    pub residual_lag: f32,
}

/// Configuration of either controller.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct GyrfalconConfig {
    /// `sizeof(gyrfalcon_config)`.
    pub struct_size: u32,
    /// `GYRFALCON_ABI_VERSION`.
    pub abi_version: u32,
    /// `GYRFALCON_ROBUST_ADAPTIVE` or `GYRFALCON_SATURATED`.
    pub kind: u32,
    /// Fixed time between two steps (s).
    pub step_period: f32,
    /// Bound of each component of the reference acceleration (m/s^2).
    pub reference_acceleration_max: f32,
    /// Known bounds of vehicle and disturbance.
    pub uncertainty: GyrfalconUncertainty,
    /// Estimates at the first step.
    pub initial: GyrfalconInitial,
    /// Gains of the shared cascade.
    pub cascade: GyrfalconCascade,
    /// Rate gain about each body axis: of controller 1 (N m s), of controller 2 (1/s).
    pub k4: GyrfalconVector,
    /// Adaptation gain of the inertia (controller 1) or of its inverse (controller 2) about each body axis; zero
    /// switches it off.
    pub gamma2: GyrfalconVector,
    /// Thrust limit (N); controller 2 only.
    pub thrust_max: f32,
    /// Limit of the torque about each body axis (N m); controller 2 only.
    pub torque_max: GyrfalconVector,
    /// Attitude gain of the auxiliary system (1/s); controller 2 only.
    pub k5: f32,
    /// Adaptation gain of the gyroscopic ratios; zero switches it off; controller 2 only.
    pub gamma3: f32,
    /// Integral action against lasting disturbances.
    pub integral: GyrfalconIntegral,
    /// Model of the rotors behind the torque command; all zero: none.
    pub rotors: GyrfalconRotors,
}

impl Sized32 for GyrfalconConfig {}

impl From<GyrfalconUncertainty> for Uncertainty {
    fn from(known: GyrfalconUncertainty) -> Self {
        Self {
            mass: known.mass.into(),
            inertia: known.inertia.into(),
            disturbance_acceleration: known.disturbance_acceleration,
            disturbance_torque: known.disturbance_torque.into(),
        }
    }
}

impl From<GyrfalconInitial> for InitialEstimate {
    fn from(initial: GyrfalconInitial) -> Self {
        Self { mass: initial.mass, inertia: initial.inertia.into() }
    }
}

impl From<GyrfalconCascade> for CascadeGains {
    fn from(gains: GyrfalconCascade) -> Self {
        Self {
            k1: gains.k1,
            k2: gains.k2,
            k3: gains.k3.into(),
            c: gains.c,
            m1: gains.M1,
            m2: gains.M2,
            gamma1: gains.gamma1,
            delta_1: gains.delta_1,
            delta_min_translation: gains.delta_min_translation,
            delta_min_rotation: gains.delta_min_rotation,
        }
    }
}

impl From<GyrfalconIntegral> for IntegralAction {
    fn from(integral: GyrfalconIntegral) -> Self {
        Self {
            acceleration_max: integral.acceleration_max,
            gamma_d: integral.gamma_d,
            torque_max: integral.torque_max,
            gamma_t: integral.gamma_t,
        }
    }
}

impl From<GyrfalconRotors> for RotorModel {
    fn from(rotors: GyrfalconRotors) -> Self {
        Self { lag: rotors.lag, residual_lag: rotors.residual_lag }
    }
}

/// The core's configuration; the error is the result code of another version or an unknown kind.
impl TryFrom<GyrfalconConfig> for ControllerConfig {
    type Error = i32;

    fn try_from(config: GyrfalconConfig) -> Result<Self, i32> {
        config.core_config().map_err(|Failure(code)| code)
    }
}

impl GyrfalconConfig {
    /// The core's configuration; refuses another version and an unknown kind.
    pub(crate) fn core_config(&self) -> Result<ControllerConfig, Failure> {
        if self.abi_version != GYRFALCON_ABI_VERSION {
            return Err(Failure(GYRFALCON_WRONG_ABI_VERSION));
        }
        match self.kind {
            GYRFALCON_ROBUST_ADAPTIVE => {
                Ok(ControllerConfig::RobustAdaptive(RobustAdaptiveConfig {
                    step_period: self.step_period,
                    reference_acceleration_max: self.reference_acceleration_max,
                    uncertainty: self.uncertainty.into(),
                    initial: self.initial.into(),
                    cascade: self.cascade.into(),
                    k4: self.k4.into(),
                    gamma2: self.gamma2.into(),
                    integral: self.integral.into(),
                    rotors: self.rotors.into(),
                }))
            }
            GYRFALCON_SATURATED => Ok(ControllerConfig::Saturated(SaturatedConfig {
                step_period: self.step_period,
                reference_acceleration_max: self.reference_acceleration_max,
                uncertainty: self.uncertainty.into(),
                initial: self.initial.into(),
                cascade: self.cascade.into(),
                thrust_max: self.thrust_max,
                torque_max: self.torque_max.into(),
                k4: self.k4.into(),
                k5: self.k5,
                gamma2: self.gamma2.into(),
                gamma3: self.gamma3,
                integral: self.integral.into(),
                rotors: self.rotors.into(),
            })),
            _ => Err(Failure(GYRFALCON_UNKNOWN_KIND)),
        }
    }
}

/// The C configuration of a core configuration, for tests and measurements written in Rust.
impl From<&ControllerConfig> for GyrfalconConfig {
    fn from(config: &ControllerConfig) -> Self {
        let (known, initial, gains) = (config.uncertainty(), config.initial(), config.cascade());
        let integral = config.integral();
        let shared = Self {
            struct_size: Self::SIZE,
            abi_version: GYRFALCON_ABI_VERSION,
            step_period: config.step_period(),
            reference_acceleration_max: config.reference_acceleration_max(),
            uncertainty: GyrfalconUncertainty {
                mass: GyrfalconInterval { lower: known.mass.lower, upper: known.mass.upper },
                inertia: GyrfalconVectorInterval {
                    lower: known.inertia.lower.into(),
                    upper: known.inertia.upper.into(),
                },
                disturbance_acceleration: known.disturbance_acceleration,
                disturbance_torque: known.disturbance_torque.into(),
            },
            initial: GyrfalconInitial { mass: initial.mass, inertia: initial.inertia.into() },
            cascade: GyrfalconCascade {
                k1: gains.k1,
                k2: gains.k2,
                k3: gains.k3.into(),
                c: gains.c,
                M1: gains.m1,
                M2: gains.m2,
                gamma1: gains.gamma1,
                delta_1: gains.delta_1,
                delta_min_translation: gains.delta_min_translation,
                delta_min_rotation: gains.delta_min_rotation,
            },
            integral: GyrfalconIntegral {
                acceleration_max: integral.acceleration_max,
                gamma_d: integral.gamma_d,
                torque_max: integral.torque_max,
                gamma_t: integral.gamma_t,
            },
            rotors: GyrfalconRotors {
                lag: config.rotors().lag,
                residual_lag: config.rotors().residual_lag,
            },
            ..Self::default()
        };
        match config {
            ControllerConfig::RobustAdaptive(own) => Self {
                kind: GYRFALCON_ROBUST_ADAPTIVE,
                k4: own.k4.into(),
                gamma2: own.gamma2.into(),
                ..shared
            },
            ControllerConfig::Saturated(own) => Self {
                kind: GYRFALCON_SATURATED,
                k4: own.k4.into(),
                gamma2: own.gamma2.into(),
                thrust_max: own.thrust_max,
                torque_max: own.torque_max.into(),
                k5: own.k5,
                gamma3: own.gamma3,
                ..shared
            },
        }
    }
}
