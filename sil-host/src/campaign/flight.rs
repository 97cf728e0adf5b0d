//! One run: the flight of each variant in front of the monitors, and its row.

use super::measures::{MEASURES, Measures};
use super::plan::{Campaign, Guarantee};
use super::row::{Observed, Row, RunOutcome};
use sim::guarantee::{Guarantees, Verdict};
use sim::scenario::{LoadedScenario, ScenarioError};

/// Result of one run.
#[derive(Clone, Debug)]
pub struct Run {
    /// One row per variant.
    pub rows: Vec<Row>,
    /// Simulated time of all variants together (s).
    pub flight_time: f64,
}

impl Run {
    /// `true` if a variant violated a guarantee.
    #[must_use]
    pub fn violated(&self) -> bool {
        self.rows.iter().any(|row| row.outcome == RunOutcome::Violated)
    }
}

/// Flies run `index` of the campaign in every variant.
#[must_use]
pub fn fly_run(campaign: &Campaign, index: u32) -> Run {
    let mut run = Run { rows: Vec::with_capacity(campaign.variants().len()), flight_time: 0.0 };
    for variant in 0..campaign.variants().len() {
        let (seed, values) = (campaign.seed(index), campaign.values(index));
        run.rows.push(fly_values(campaign, seed, values, variant, &mut run.flight_time));
    }
    run
}

/// Flies a run with these values in a variant; adds its simulated time (s) to `flight_time`.
pub(super) fn fly_values(
    campaign: &Campaign,
    seed: u32,
    values: Vec<f64>,
    variant: usize,
    flight_time: &mut f64,
) -> Row {
    let mut row = Row {
        seed,
        variant,
        parameters: values,
        outcome: RunOutcome::Refused,
        reason: String::new(),
        assumptions_kept: false,
        measures: vec![None; MEASURES.len()],
        guarantees: vec![Observed::default(); campaign.guarantees().len()],
    };
    let loaded = Campaign::scenario_with(&campaign.variants()[variant], &row.parameters, seed);
    let flown = loaded.and_then(|loaded| {
        let scenario = loaded.scenario();
        row.assumptions_kept = scenario.broken_assumptions().is_empty();
        *flight_time += scenario.duration;
        observed_flight(&loaded)
    });
    match flown {
        Ok((guarantees, measures)) => {
            conclude(&guarantees, &measures, campaign.guarantees(), &mut row);
        }
        Err(error) => row.reason = error.to_string(),
    }
    row
}

/// Flies a scenario from its first to its last tick.
fn observed_flight(loaded: &LoadedScenario) -> Result<(Guarantees, Measures), ScenarioError> {
    let scenario = loaded.scenario();
    let mut observers = (scenario.monitors(), Measures::new(scenario));
    loaded.flight()?.without_evaluator().observe_in_blocks(scenario.ticks(), &mut observers);
    Ok(observers)
}

/// Fills in the outcome.
fn conclude(guarantees: &Guarantees, measures: &Measures, columns: &[Guarantee], row: &mut Row) {
    let verdicts = guarantees.verdicts();
    let violated: Vec<_> = verdicts.iter().filter(|it| !it.pass).map(|it| it.name).collect();
    row.outcome = if violated.is_empty() { RunOutcome::Held } else { RunOutcome::Violated };
    row.reason = violated.join("; ");
    row.measures = measures.values();
    row.guarantees = columns.iter().map(|column| observed(&verdicts, column)).collect();
}

fn observed(verdicts: &[Verdict], column: &Guarantee) -> Observed {
    let verdict = verdicts.iter().find(|verdict| verdict.name == column.name);
    verdict
        .map_or_else(Observed::default, |it| Observed { observed: it.observed, margin: it.margin })
}
