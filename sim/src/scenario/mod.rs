//! A scenario: everything that a flight depends on, read from TOML.
//!
//! `sil-host show NAME` prints a built-in one, whose comments explain every field.

mod built_in;
pub mod document;
mod error;
mod flight;
mod initial;
mod loaded;
mod validation;

pub use built_in::{BUILT_IN, BuiltIn, DEFAULT_SCENARIOS};
pub use error::{Origin, ScenarioError};
pub use flight::AnyFlight;
pub use flight::start;
pub use initial::InitialCondition;
pub use loaded::LoadedScenario;

use ctrl_core::config::{RobustAdaptiveConfig, SaturatedConfig};
use ctrl_core::trajectory::TrajectoryConfig;
use ctrl_core::vehicle::{InitialEstimate, Uncertainty};
use glam::DVec3;
use serde::Deserialize;

use crate::guarantee::GuaranteeConfig;
use crate::plant::PlantParameters;
use crate::plant::actuation::ActuationConfig;
use crate::plant::disturbance::DisturbanceConfig;

/// Everything that a flight depends on.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Short name; files of results are called after it.
    pub name: String,
    /// What it shows, in a sentence or two.
    pub description: String,
    /// How long to fly (s).
    pub duration: f64,
    /// Seed of every random number.
    pub seed: u64,
    /// RK4 steps of the plant a control tick.
    pub plant_steps_per_tick: u32,
    /// The true vehicle, which the controller does not know.
    pub vehicle: VehicleConfig,
    /// What the rotors make of a command; absent: exactly it, at once.
    #[serde(default)]
    pub actuation: ActuationConfig,
    /// State at the first tick.
    pub initial: InitialCondition,
    /// What disturbs the vehicle.
    pub disturbance: DisturbanceConfig,
    /// Where to fly.
    pub trajectory: TrajectoryConfig,
    /// Who flies.
    pub controller: ControllerConfig,
    /// What the flight must achieve.
    pub guarantees: GuaranteeConfig,
}

/// True parameters of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VehicleConfig {
    /// Mass (kg).
    pub mass: f64,
    /// Principal moments of inertia (kg m^2).
    pub inertia: DVec3,
}

impl From<VehicleConfig> for PlantParameters {
    fn from(VehicleConfig { mass, inertia }: VehicleConfig) -> Self {
        Self { mass, inertia }
    }
}

/// Which controller flies, and its configuration.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ControllerConfig {
    /// Controller 1 (Theorem 1).
    RobustAdaptive(RobustAdaptiveConfig),
    /// Controller 2 (Theorem 2).
    Saturated(SaturatedConfig),
}

impl ControllerConfig {
    /// Its key in a scenario file.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::RobustAdaptive(_) => "robust_adaptive",
            Self::Saturated(_) => "saturated",
        }
    }

    /// What the controller is told of vehicle and disturbance.
    #[must_use]
    pub fn uncertainty(&self) -> &Uncertainty {
        match self {
            Self::RobustAdaptive(config) => &config.uncertainty,
            Self::Saturated(config) => &config.uncertainty,
        }
    }

    /// Estimates at the first step.
    #[must_use]
    pub fn initial(&self) -> &InitialEstimate {
        match self {
            Self::RobustAdaptive(config) => &config.initial,
            Self::Saturated(config) => &config.initial,
        }
    }

    /// The fixed step (s).
    #[must_use]
    pub fn step_period(&self) -> f32 {
        match self {
            Self::RobustAdaptive(config) => config.step_period,
            Self::Saturated(config) => config.step_period,
        }
    }
}

impl Scenario {
    /// Number of control ticks in the flight.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        (self.duration / f64::from(self.controller.step_period())).round() as u64
    }

    /// What the rotors make of a command, with the delay that the plant's steps give.
    #[must_use]
    pub fn effective_actuation(&self) -> ActuationConfig {
        let period = f64::from(self.controller.step_period());
        self.actuation.in_steps_of(period / f64::from(self.plant_steps_per_tick))
    }

    /// Where the true vehicle or the disturbance leaves the set that the controller is told, or does
    /// not do as commanded: then the theorems promise nothing. One sentence each.
    #[must_use]
    pub fn broken_assumptions(&self) -> Vec<String> {
        validation::broken_assumptions(self)
    }
}
