//! Scenarios: everything that a flight depends on, read from TOML.
//!
//! `sil-host show NAME` prints a built-in one, whose comments explain every field.

mod built_in;
pub mod document;
mod error;
mod flight;
mod initial;
mod loaded;
mod name;
mod validation;

pub use built_in::{BUILT_IN, BuiltIn, DEFAULT_SCENARIOS};
pub use error::{Origin, ScenarioError};
pub use flight::{ScenarioFlight, flight_with};
pub use initial::InitialCondition;
pub use loaded::LoadedScenario;
pub use name::{check_name, not_found};

use ctrl_core::controller::ControllerConfig;
use ctrl_core::filter::RateFilterConfig;
use ctrl_core::trajectory::TrajectoryConfig;
use glam::DVec3;
use serde::Deserialize;

use crate::feedback::StateFeedbackConfig;
use crate::guarantee::GuaranteeConfig;
use crate::plant::PlantParameters;
use crate::plant::actuation::ActuationConfig;
use crate::plant::disturbance::DisturbanceConfig;
use crate::plant::rotors::RotorsConfig;
use crate::sensor::SensorsConfig;

/// Everything that a flight depends on.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Short name, after which files of results are named; see [`check_name`].
    pub name: String,
    /// Description in a sentence or two.
    pub description: String,
    /// Duration of the flight (s).
    pub duration: f64,
    /// Seed of every random number.
    pub seed: u64,
    /// RK4 steps of the plant per control tick.
    pub plant_steps_per_tick: u32,
    /// The true vehicle, unknown to the controller.
    pub vehicle: VehicleConfig,
    /// Actuator dynamics; if absent, a command acts exactly and at once.
    #[serde(default)]
    pub actuation: ActuationConfig,
    /// Rotors that make the wrench; if absent, it acts as the actuators leave it.
    #[serde(default)]
    pub rotors: Option<RotorsConfig>,
    /// Sensors; if absent, the controller receives the true state.
    #[serde(default)]
    pub sensors: Option<SensorsConfig>,
    /// Noise and latency of the state that the controller receives, for a scenario without sensors.
    #[serde(default)]
    pub state_feedback: StateFeedbackConfig,
    /// Filters of the body rate that the controller receives.
    #[serde(default)]
    pub rate_filter: RateFilterConfig,
    /// State at the first tick.
    pub initial: InitialCondition,
    /// Disturbance of the vehicle.
    pub disturbance: DisturbanceConfig,
    /// Reference trajectory.
    pub trajectory: TrajectoryConfig,
    /// Controller.
    pub controller: ControllerConfig,
    /// Required bounds of the flight.
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
        Self::new(mass, inertia)
    }
}

impl Scenario {
    /// Number of control ticks in the flight.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        (self.duration / f64::from(self.controller.step_period())).round() as u64
    }

    /// True parameters of the vehicle, with the part of the constant disturbance that the controller's
    /// integral action estimates.
    #[must_use]
    pub fn plant_parameters(&self) -> PlantParameters {
        let lasting = self.disturbance.lasting(self.controller.integral());
        PlantParameters { lasting, ..self.vehicle.into() }
    }

    /// Actuator dynamics, with the delay rounded to the plant's steps.
    #[must_use]
    pub fn effective_actuation(&self) -> ActuationConfig {
        let period = f64::from(self.controller.step_period());
        self.actuation.in_steps_of(period / f64::from(self.plant_steps_per_tick))
    }

    /// `true` if the controller receives the true state, as the theorems assume.
    #[must_use]
    pub fn receives_the_truth(&self) -> bool {
        self.sensors.is_none() && self.state_feedback.is_exact() && self.rate_filter.is_empty()
    }

    /// Violated assumptions of the theorems, one sentence each: a true parameter or disturbance outside the
    /// set that the controller is given, or actuators that deviate from the command.
    #[must_use]
    pub fn broken_assumptions(&self) -> Vec<String> {
        validation::broken_assumptions(self)
    }
}
