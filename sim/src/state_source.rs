//! State that the controller of a flight receives: its source, and the filter of the body rate behind it.

use std::sync::mpsc::Sender;

use ctrl_core::error::ConfigError;
use ctrl_core::estimator::{RESTART_SHARE, ReferenceShift};
use ctrl_core::filter::{RateFilter, RateFilterState};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::VehicleState;

use crate::feedback::StateFeedback;
use crate::plant::PlantState;
use crate::scenario::Scenario;
use crate::sensor::{Navigation, SensorSamples};

/// The state that the controller receives, tick by tick. The default is the plant's truth, rounded to `f32`.
#[derive(Clone, Debug, Default)]
pub struct StateSource {
    origin: Origin,
    rate_filter: Option<(RateFilter, RateFilterState)>,
    /// Leads the reference back after a restart of the estimate.
    shift: Option<ReferenceShift>,
    step_period: f32,
}

/// Origin of the state.
#[derive(Clone, Debug, Default)]
enum Origin {
    /// The plant's truth.
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
    /// The parameter that estimator or filter refuses.
    pub fn new(
        scenario: &Scenario,
        step_period: f32,
        start: &PlantState,
    ) -> Result<Self, ConfigError> {
        let (seed, period) = (scenario.seed, f64::from(step_period));
        let origin = match (&scenario.sensors, &scenario.state_feedback) {
            (Some(sensors), _) => {
                Origin::Navigation(Box::new(Navigation::new(sensors, seed, period, start)?))
            }
            (None, feedback) if feedback.is_exact() => Origin::Truth,
            (None, feedback) => {
                Origin::Feedback(Box::new(StateFeedback::new(feedback, seed, period, start)))
            }
        };
        let filter = RateFilter::new(&scenario.rate_filter, step_period)?;
        let filter = (!scenario.rate_filter.is_empty()).then(|| (filter, filter.initial_state()));
        let limit = RESTART_SHARE * scenario.controller.reference_acceleration_max();
        let shift = scenario.sensors.is_some().then(|| ReferenceShift::new(limit));
        Ok(Self { origin, rate_filter: filter, shift, step_period })
    }

    /// The state that the controller receives at this tick. Called once per tick.
    #[inline]
    pub fn measure(&mut self, truth: &PlantState) -> VehicleState {
        let mut seen = match &mut self.origin {
            Origin::Truth => truth.measured(),
            Origin::Feedback(feedback) => feedback.measure(truth),
            Origin::Navigation(navigation) => navigation.measure(truth),
        };
        if let Some((filter, state)) = &mut self.rate_filter {
            seen.rate_body = filter.step(state, seen.rate_body);
        }
        seen
    }

    /// The reference shifted with the restarts of the estimate, if there is one. Called once per tick, after
    /// [`measure`](Self::measure).
    #[inline]
    pub fn shifted(&mut self, reference: &Reference) -> Option<Reference> {
        let Origin::Navigation(navigation) = &self.origin else { return None };
        let shift = self.shift.as_mut()?;
        let mut shifted = *reference;
        shift.advance(navigation.state().restart(), self.step_period);
        shift.apply(&mut shifted);
        Some(shifted)
    }

    /// Sends the sensors' samples of every tick from now on; nothing without sensors.
    pub fn send_samples(&mut self, receiver: Sender<SensorSamples>) {
        if let Origin::Navigation(navigation) = &mut self.origin {
            navigation.send_samples(receiver);
        }
    }

    /// Sensors and estimator, if they are the origin.
    #[must_use]
    pub fn navigation(&self) -> Option<&Navigation> {
        match &self.origin {
            Origin::Navigation(navigation) => Some(navigation),
            Origin::Truth | Origin::Feedback(_) => None,
        }
    }
}
