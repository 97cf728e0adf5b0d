//! Torque activity under rate noise, flown: the nominal vehicle at hover, nothing else disturbing it.

use serde::Serialize;
use sim::guarantee::activity::TorqueActivity;
use sim::scenario::{LoadedScenario, ScenarioError};

use super::noise::Activity;
use super::proposal::Proposal;

/// Largest relative difference between prediction and flight.
pub const TOLERANCE: f64 = 0.1;

/// Least time that is averaged over (s).
const AVERAGED: f64 = 10.0;

/// Predicted and flown activity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NoiseCheck {
    /// From the loops at hover.
    pub predicted: Activity,
    /// Of the flight: torque and its change per tick, root mean squares over all axes (N m).
    pub flown: [f64; 2],
}

impl NoiseCheck {
    /// `true` if the flight has what was predicted, to [`TOLERANCE`].
    #[must_use]
    pub fn passed(&self) -> bool {
        let near = |flown: f64, predicted: f64| (flown / predicted - 1.0).abs() <= TOLERANCE;
        let [torque, change] = self.flown;
        near(torque, self.predicted.torque) && near(change, self.predicted.change)
    }
}

/// Flies the proposal's scenario under its rate noise alone; none without rate noise.
///
/// # Errors
/// When the scenario cannot be read: a fault of this program.
pub fn fly(proposal: &Proposal) -> Result<Option<NoiseCheck>, ScenarioError> {
    let Some(predicted) = proposal.activity else { return Ok(None) };
    let request = &proposal.request;
    let settled = proposal.settle_time;
    let averaged = (20.0 / request.wanted.position_bandwidth).max(AVERAGED);
    let changes = [
        format!("state_feedback.rate_body.white_noise={:?}", request.rate_noise),
        format!("duration={:?}", settled + averaged),
        "disturbance.noise.acceleration=0.0".to_owned(),
        "disturbance.noise.torque=0.0".to_owned(),
    ];
    let loaded = LoadedScenario::parse(&request.name, &proposal.scenario(), &changes)?;
    let period = f64::from(request.step_period);
    let mut activity = TorqueActivity::default();
    let mut flight = loaded.flight()?;
    flight.advance((settled / period).round() as u64);
    flight.observe((averaged / period).round() as u64, &mut activity);
    let flown = [activity.rms(), activity.change_rms()].map(|it| it.unwrap_or(f64::NAN));
    Ok(Some(NoiseCheck { predicted, flown }))
}
