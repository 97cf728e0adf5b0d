//! The form of `vehicle.toml`; `build.rs` reads it with this file.

use ctrl_core::allocation::RotorGeometry;
use ctrl_core::mode::SupervisorConfig;
use serde::{Deserialize, Serialize};

/// Supervision and rotors of the vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VehicleConfig {
    /// Limits of arming, flight and failsafe.
    pub supervisor: SupervisorConfig,
    /// The rotors, in the order of the outputs.
    pub geometry: RotorGeometry,
}
