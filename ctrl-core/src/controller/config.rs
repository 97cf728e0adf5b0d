//! Choice of a controller at run time, by a scenario file or a message.

use glam::Vec3;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use super::AnyController;
use crate::config::{CascadeGains, IntegralAction, RobustAdaptiveConfig, SaturatedConfig};
use crate::error::ConfigError;
use crate::robust_adaptive::RobustAdaptive;
use crate::rotors::RotorModel;
use crate::saturated::Saturated;
use crate::vehicle::{InitialEstimate, Uncertainty};

/// The configuration of one controller of any kind.
///
/// In text the kind is the key and its fields the value, so that a file's reader can point at a
/// wrong field: `[controller.saturated]`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum ControllerConfig {
    /// Controller 1 (Theorem 1).
    RobustAdaptive(RobustAdaptiveConfig),
    /// Controller 2 (Theorem 2).
    Saturated(SaturatedConfig),
}

/// Evaluates the expression for the configuration of whichever kind.
macro_rules! of_each {
    ($config:expr, $inner:ident => $value:expr) => {
        match $config {
            ControllerConfig::RobustAdaptive($inner) => $value,
            ControllerConfig::Saturated($inner) => $value,
        }
    };
}

impl ControllerConfig {
    /// Builds the controller.
    ///
    /// # Errors
    /// That of the kind's constructor: the parameter, its value and the bound.
    pub fn build(&self) -> Result<AnyController, ConfigError> {
        Ok(match self {
            Self::RobustAdaptive(config) => {
                AnyController::RobustAdaptive(RobustAdaptive::new(config)?)
            }
            Self::Saturated(config) => AnyController::Saturated(Saturated::new(config)?),
        })
    }

    /// The key of this kind in a scenario file.
    #[must_use]
    pub fn key(&self) -> &'static str {
        match self {
            Self::RobustAdaptive(_) => "robust_adaptive",
            Self::Saturated(_) => "saturated",
        }
    }

    /// Bounds of vehicle and disturbance that the controller is given.
    #[must_use]
    pub fn uncertainty(&self) -> &Uncertainty {
        of_each!(self, config => &config.uncertainty)
    }

    /// Estimates at the first step.
    #[must_use]
    pub fn initial(&self) -> &InitialEstimate {
        of_each!(self, config => &config.initial)
    }

    /// Gains of the shared cascade.
    #[must_use]
    pub fn cascade(&self) -> &CascadeGains {
        of_each!(self, config => &config.cascade)
    }

    /// Gains of the shared cascade, mutable.
    pub fn cascade_mut(&mut self) -> &mut CascadeGains {
        of_each!(self, config => &mut config.cascade)
    }

    /// Bounds and gains of the integral action.
    #[must_use]
    pub fn integral(&self) -> &IntegralAction {
        of_each!(self, config => &config.integral)
    }

    /// Bounds and gains of the integral action, mutable.
    pub fn integral_mut(&mut self) -> &mut IntegralAction {
        of_each!(self, config => &mut config.integral)
    }

    /// Model of the rotors behind the torque command.
    #[must_use]
    pub fn rotors(&self) -> &RotorModel {
        of_each!(self, config => &config.rotors)
    }

    /// Model of the rotors behind the torque command, mutable.
    pub fn rotors_mut(&mut self) -> &mut RotorModel {
        of_each!(self, config => &mut config.rotors)
    }

    /// The fixed step `dt` (s).
    #[must_use]
    pub fn step_period(&self) -> f32 {
        of_each!(self, config => config.step_period)
    }

    /// `M_p`: bound of each component of the reference acceleration (m/s^2).
    #[must_use]
    pub fn reference_acceleration_max(&self) -> f32 {
        of_each!(self, config => config.reference_acceleration_max)
    }

    /// `M_f` (N), where the law limits the thrust.
    #[must_use]
    pub fn thrust_max(&self) -> Option<f32> {
        match self {
            Self::RobustAdaptive(_) => None,
            Self::Saturated(config) => Some(config.thrust_max),
        }
    }

    /// `M_tau` about each body axis (N m), where the law limits the torque.
    #[must_use]
    pub fn torque_max(&self) -> Option<Vec3> {
        match self {
            Self::RobustAdaptive(_) => None,
            Self::Saturated(config) => Some(config.torque_max),
        }
    }
}
