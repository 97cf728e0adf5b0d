//! A push that lasts, flown: from rest at hover, beside the predicted time.

use glam::DVec3;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use serde::Serialize;
use sim::guarantee::tracking::rotation_angle;
use sim::observer::Observer;
use sim::scenario::{LoadedScenario, ScenarioError};
use sim::tick::Tick;

use super::proposal::Proposal;
use super::push::{ATTITUDE_LEFT, POSITION_LEFT};
use super::steady::Steady;

/// Factor on the predicted time after which a flight ends, and the least time that it goes on (s).
const FLOWN_ON: f64 = 1.5;
const FLOWN_ON_LEAST: f64 = 2.0;

/// Predicted and flown time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PushCheck {
    /// Longest over the corners (s).
    pub predicted: f64,
    /// Longest of the flights (s); none if one ended with a larger error.
    pub flown: Option<f64>,
    /// Flights.
    pub flights: u32,
}

impl PushCheck {
    /// `true` if every flight held the push within the predicted time.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.flown.is_some_and(|flown| flown <= self.predicted)
    }
}

/// Time of the last tick with a larger error than is to be left.
#[derive(Default)]
struct Outside {
    last: f64,
}

impl Observer for Outside {
    fn observe(&mut self, tick: &Tick) {
        let position = tick.position_error().length();
        let attitude = rotation_angle(tick.evaluation.attitude_error);
        let inside = position <= POSITION_LEFT && attitude <= ATTITUDE_LEFT;
        if !inside {
            self.last = tick.time;
        }
    }
}

/// Flies the push from rest at hover with both signs, at the ends of the inertia and of its first estimate; none
/// without integral action.
///
/// # Errors
/// When the scenario cannot be read: a fault of this program.
pub fn fly(proposal: &Proposal) -> Result<Option<PushCheck>, ScenarioError> {
    let Some(predicted) = proposal.push_settling else { return Ok(None) };
    let known = &proposal.request.known.inertia;
    let ends = [known.lower.as_dvec3(), known.upper.as_dvec3()];
    let cases: Vec<_> = ends
        .into_iter()
        .flat_map(|truth| ends.map(|estimate| (truth, estimate)))
        .flat_map(|(truth, estimate)| [1.0, -1.0].map(|sign| (truth, estimate, sign)))
        .collect();
    let flown: Result<Vec<_>, _> = cases
        .par_iter()
        .map(|&(truth, estimate, sign)| held(proposal, truth, estimate, sign, predicted))
        .collect();
    let longest = flown?.into_iter().fold(0.0, f64::max);
    let flown = (longest < duration(predicted) - 0.5 * FLOWN_ON_LEAST).then_some(longest);
    Ok(Some(PushCheck { predicted, flown, flights: cases.len() as u32 }))
}

/// Length of a flight (s).
fn duration(predicted: f64) -> f64 {
    (FLOWN_ON * predicted).max(predicted + FLOWN_ON_LEAST)
}

/// Time (s) after which the errors of one flight stay small.
fn held(
    proposal: &Proposal,
    truth: DVec3,
    estimate: DVec3,
    sign: f64,
    predicted: f64,
) -> Result<f64, ScenarioError> {
    let Steady { acceleration, torque } = proposal.request.steady;
    let text = proposal.scenario();
    let name = &proposal.request.name;
    let list = |x: DVec3| format!("{:?}", x.to_array());
    let reference = LoadedScenario::parse(name, &text, &[])?.scenario().initial.position;
    let start = reference - proposal.start_offset();
    let changes = [
        format!("duration={:?}", duration(predicted)),
        format!("vehicle.inertia={}", list(truth)),
        format!("controller.{}.initial.inertia={}", proposal.law.key(), list(estimate)),
        format!("initial.position={}", list(start)),
        "disturbance.noise.acceleration=0.0".to_owned(),
        "disturbance.noise.torque=0.0".to_owned(),
        format!(
            "disturbance.constant={{acceleration={}, torque={}}}",
            list(acceleration * DVec3::new(1.0, sign, 0.0)),
            list(torque * DVec3::new(1.0, sign, 1.0))
        ),
    ];
    let loaded = LoadedScenario::parse(name, &text, &changes)?;
    let mut outside = Outside::default();
    loaded.flight()?.observe(loaded.scenario().ticks(), &mut outside);
    Ok(outside.last)
}
