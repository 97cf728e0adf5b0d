//! One run: the flight of each variant in front of the monitors, and its row.

use super::measures::{MEASURES, Measures};
use super::plan::{Campaign, Guarantee};
use super::row::{Observed, Outcome, Row};
use sim::closed_loop::Observer;
use sim::guarantee::lyapunov::Evaluator;
use sim::guarantee::{Guarantees, Verdict};
use sim::sample::Sample;
use sim::scenario::{LoadedScenario, Scenario, ScenarioError};

/// What came out of one run.
#[derive(Clone, Debug)]
pub struct Run {
    /// A row a variant.
    pub rows: Vec<Row>,
    /// Simulated time of all variants together (s).
    pub flight_time: f64,
}

/// Flies run `index` of the campaign in every variant.
#[must_use]
pub fn fly(campaign: &Campaign, index: u32) -> Run {
    let mut run = Run { rows: Vec::with_capacity(campaign.variants().len()), flight_time: 0.0 };
    for variant in 0..campaign.variants().len() {
        run.rows.push(fly_variant(campaign, index, variant, &mut run.flight_time));
    }
    run
}

fn fly_variant(campaign: &Campaign, index: u32, variant: usize, flight_time: &mut f64) -> Row {
    let mut row = Row {
        seed: campaign.seed(index),
        variant,
        parameters: campaign.values(index),
        outcome: Outcome::Refused,
        reason: String::new(),
        assumptions_kept: false,
        measures: vec![None; MEASURES.len()],
        guarantees: vec![Observed::default(); campaign.guarantees().len()],
    };
    let flown = campaign.scenario(index, &campaign.variants()[variant]).and_then(|loaded| {
        let scenario = loaded.scenario();
        row.assumptions_kept = scenario.broken_assumptions().is_empty();
        *flight_time += scenario.duration;
        watched(&loaded)
    });
    match flown {
        Ok(watch) => watch.conclude(campaign.guarantees(), &mut row),
        Err(error) => row.reason = error.to_string(),
    }
    row
}

/// Flies a scenario from its first to its last tick.
fn watched(loaded: &LoadedScenario) -> Result<Watch, ScenarioError> {
    let scenario = loaded.scenario();
    let mut watch = Watch::new(scenario);
    loaded.flight()?.advance(scenario.ticks(), &mut watch);
    Ok(watch)
}

/// The monitors of a run, without trace or figures.
#[derive(Clone, Debug)]
pub struct Watch {
    evaluator: Evaluator,
    guarantees: Guarantees,
    measures: Measures,
}

impl Watch {
    /// Watches a flight of `scenario`.
    #[must_use]
    pub fn new(scenario: &Scenario) -> Self {
        Self {
            evaluator: Evaluator::new(&scenario.controller, &scenario.vehicle.into()),
            guarantees: Guarantees::of(scenario),
            measures: Measures::new(scenario),
        }
    }

    /// Writes down what was seen.
    fn conclude(&self, columns: &[Guarantee], row: &mut Row) {
        let verdicts = self.guarantees.verdicts();
        let violated: Vec<_> = verdicts.iter().filter(|it| !it.pass).map(|it| it.name).collect();
        row.outcome = if violated.is_empty() { Outcome::Held } else { Outcome::Violated };
        row.reason = violated.join("; ");
        row.measures = self.measures.values();
        row.guarantees = columns.iter().map(|column| observed(&verdicts, column)).collect();
    }
}

fn observed(verdicts: &[Verdict], column: &Guarantee) -> Observed {
    let verdict = verdicts.iter().find(|verdict| verdict.name == column.name);
    verdict
        .map_or_else(Observed::default, |it| Observed { observed: it.observed, margin: it.margin })
}

impl Observer for Watch {
    fn observe(&mut self, sample: &Sample) {
        let evaluation = self.evaluator.evaluate(sample);
        self.guarantees.observe(sample, &evaluation);
        self.measures.observe(sample, &evaluation);
    }
}
