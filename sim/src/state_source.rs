//! Source of the state that the controller of a flight receives.

use ctrl_core::error::ConfigError;
use ctrl_core::vehicle::VehicleState;

use crate::feedback::StateFeedback;
use crate::plant::PlantState;
use crate::scenario::Scenario;
use crate::sensor::Navigation;

/// Source of the state that the controller receives.
#[derive(Clone, Debug, Default)]
pub enum StateSource {
    /// The plant's truth, rounded to `f32`.
    #[default]
    Truth,
    /// The truth with noise and latency.
    Feedback(Box<StateFeedback>),
    /// Sensors and estimator.
    Navigation(Box<Navigation>),
}

impl StateSource {
    /// That of `scenario`, for a flight from `start`; `step_period` (s).
    ///
    /// # Errors
    /// The parameter that the estimator refuses.
    pub fn new(
        scenario: &Scenario,
        step_period: f64,
        start: &PlantState,
    ) -> Result<Self, ConfigError> {
        if let Some(sensors) = &scenario.sensors {
            let navigation = Navigation::new(sensors, scenario.seed, step_period, start)?;
            return Ok(Self::Navigation(Box::new(navigation)));
        }
        let feedback = &scenario.state_feedback;
        if feedback.is_exact() {
            return Ok(Self::Truth);
        }
        let feedback = StateFeedback::new(feedback, scenario.seed, step_period, start);
        Ok(Self::Feedback(Box::new(feedback)))
    }

    /// The state that the controller receives at this tick. Called once per tick.
    #[inline]
    pub fn measure(&mut self, truth: &PlantState) -> VehicleState {
        match self {
            Self::Truth => truth.measured(),
            Self::Feedback(feedback) => feedback.measure(truth),
            Self::Navigation(navigation) => navigation.measure(truth),
        }
    }
}
