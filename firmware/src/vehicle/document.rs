//! The form of `vehicle.toml`; `build.rs` reads it with this file.

use ctrl_core::allocation::RotorGeometry;
use ctrl_core::filter::RateFilterConfig;
use ctrl_core::mode::SupervisorConfig;
use ctrl_core::mode::safety::SafetyConfig;
use serde::{Deserialize, Serialize};

/// Supervision, filters of the rate, and rotors of the vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VehicleConfig {
    /// Limits of arming, flight and failsafe.
    pub supervisor: SupervisorConfig,
    /// Timeouts of the host's samples and references.
    pub link: LinkConfig,
    /// Filters of the body rate before the law; none if absent.
    #[serde(default)]
    pub rate_filter: RateFilterConfig,
    /// Hazards to watch for; none if absent.
    #[serde(default)]
    pub safety: SafetyConfig,
    /// The rotors, in the order of the outputs.
    pub geometry: RotorGeometry,
}

/// Timeouts of the host's samples and references.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkConfig {
    /// A state sample is used for this many ticks.
    pub sample_valid: u32,
    /// Timeout of the reference stream (ticks).
    pub reference_timeout: u32,
}
