//! The part of a scenario file that a vehicle needs; `build.rs` reads it from TOML with this file.

use ctrl_core::config::{RobustAdaptiveConfig, SaturatedConfig};
use ctrl_core::controller::{AnyController, ControllerConfig};
use ctrl_core::error::ConfigError;
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::saturated::Saturated;
use ctrl_core::trajectory::TrajectoryConfig;
use link::ControllerKind;
use serde::{Deserialize, Serialize};

/// Controller and trajectory of a scenario. What only a simulation needs is left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Document {
    /// The control law with its numbers.
    pub controller: ControllerConfig,
    /// The reference that is flown when no host sends one.
    pub trajectory: TrajectoryConfig,
}

/// The numbers of both controllers, and which of them is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tuning {
    /// The choice.
    pub kind: ControllerKind,
    /// Numbers of controller 1.
    pub robust_adaptive: RobustAdaptiveConfig,
    /// Numbers of controller 2.
    pub saturated: SaturatedConfig,
}

impl Tuning {
    /// The chosen controller, validated.
    ///
    /// # Errors
    /// The parameter that the controller refuses.
    pub fn controller(&self) -> Result<AnyController, ConfigError> {
        self.controller_of(self.kind)
    }

    /// The controller of a kind, validated.
    ///
    /// # Errors
    /// The parameter that the controller refuses.
    #[inline(never)]
    pub fn controller_of(&self, kind: ControllerKind) -> Result<AnyController, ConfigError> {
        match kind {
            ControllerKind::RobustAdaptive => robust_adaptive(&self.robust_adaptive),
            ControllerKind::Saturated => saturated(&self.saturated),
        }
    }
}

// Apart, so that only one of them takes stack at a time.

#[inline(never)]
fn robust_adaptive(config: &RobustAdaptiveConfig) -> Result<AnyController, ConfigError> {
    RobustAdaptive::new(config).map(AnyController::RobustAdaptive)
}

#[inline(never)]
fn saturated(config: &SaturatedConfig) -> Result<AnyController, ConfigError> {
    Saturated::new(config).map(AnyController::Saturated)
}

/// The mission that is built in: the scenario, with the paper's numbers for the other controller.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BuiltInMission {
    /// The controllers.
    pub tuning: Tuning,
    /// The reference that is flown when no host sends one.
    pub trajectory: TrajectoryConfig,
}
