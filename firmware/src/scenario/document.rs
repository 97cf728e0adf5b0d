//! The part of a scenario file that a vehicle needs; `build.rs` reads it from TOML with this file.

use ctrl_core::config::{RobustAdaptiveConfig, SaturatedConfig};
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

/// The configuration of either controller.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(clippy::large_enum_variant, reason = "there is no heap to put one on")]
pub enum ControllerConfig {
    /// Controller 1.
    RobustAdaptive(RobustAdaptiveConfig),
    /// Controller 2.
    Saturated(SaturatedConfig),
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

/// What the image flies: the flown scenario, with the paper's numbers for the other controller.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Flown {
    /// The controllers.
    pub tuning: Tuning,
    /// The reference that is flown when no host sends one.
    pub trajectory: TrajectoryConfig,
}
