//! Summary of a campaign: the numbers of runs that held, and the tightest run of each guarantee.

use std::fmt::Write;
use std::path::PathBuf;

use serde::Serialize;

use super::error::CampaignError;
use super::plan::Guarantee;
use super::row::{Row, RunOutcome};
use super::splitting::RareProbability;
use super::stop::{Decision, Evidence, Sequential};
use super::table::CampaignResults;
use crate::report::aligned;
use sim::guarantee::activity::TorqueActivity;
use sim::number::number;

/// Result of a campaign.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// The campaign's name.
    pub name: String,
    /// The campaign's description.
    pub description: String,
    /// Directory of the results.
    pub directory: PathBuf,
    /// `true` if no run violated a guarantee, or, with `[stop]`, if the demand was shown in every variant.
    pub passed: bool,
    /// Its variants.
    pub variants: Vec<VariantSummary>,
}

/// Result of a variant.
#[derive(Clone, Debug, Default, Serialize)]
pub struct VariantSummary {
    /// Its name.
    pub name: String,
    /// Runs in which every guarantee held.
    pub held: u32,
    /// Runs in which one did not.
    pub violated: u32,
    /// Runs that were refused.
    pub refused: u32,
    /// Runs that were flown though vehicle or disturbance leave what the controller was told.
    pub assumptions_broken: u32,
    /// The guarantees that are judged.
    pub guarantees: Vec<GuaranteeSummary>,
    /// Probability by `[splitting]`, whose flights are no draws of the campaign's distribution.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rare: Option<RareProbability>,
    /// Evidence about the demand of `[stop]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub evidence: Option<Evidence>,
    /// Torque activity: root mean square of the torque, and of its change per tick.
    pub activity: Vec<ActivitySummary>,
}

/// Root mean squares of the runs of a variant; information without a bound.
#[derive(Clone, Debug, Serialize)]
pub struct ActivitySummary {
    /// Name of its row in the table of a run.
    pub name: &'static str,
    /// Unit of the values.
    pub unit: &'static str,
    /// Runs that have a value.
    pub runs: u32,
    /// Mean over those runs.
    pub mean: f64,
    /// Largest value, and the seed of its run.
    pub largest: Option<(f64, u32)>,
    /// Place among the campaign's guarantees.
    #[serde(skip)]
    column: usize,
}

/// Result of a guarantee.
#[derive(Clone, Debug, Serialize)]
pub struct GuaranteeSummary {
    /// Its name in the table of a run.
    pub name: &'static str,
    /// Its equation; where variants differ, all of them.
    pub equation: String,
    /// Unit of the margin.
    pub unit: &'static str,
    /// Runs in which it was judged.
    pub judged: u32,
    /// Runs in which it was violated.
    pub violated: u32,
    /// Least margin, positive on the good side, and the seed of its run.
    pub tightest: Option<(f64, u32)>,
}

impl Summary {
    /// Of the rows in a directory of results.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn read(results: &CampaignResults) -> Result<Self, CampaignError> {
        let campaign = results.campaign();
        let guarantee = |it: &Guarantee| GuaranteeSummary {
            name: it.name,
            equation: it.equation.clone(),
            unit: it.unit,
            judged: 0,
            violated: 0,
            tightest: None,
        };
        let variants = campaign.variants().iter().map(|variant| VariantSummary {
            name: variant.name.clone(),
            held: 0,
            violated: 0,
            refused: 0,
            assumptions_broken: 0,
            guarantees: campaign.guarantees().iter().map(guarantee).collect(),
            evidence: None,
            rare: None,
            activity: activity(campaign.guarantees()),
        });
        let mut variants: Vec<_> = variants.collect();
        let mut stop = Sequential::new(campaign);
        for row in results.rows()? {
            let row = row?;
            variants[row.variant].add(&row);
            if let Some(stop) = &mut stop {
                stop.push(&[row]);
            }
        }
        let evidence = stop.into_iter().flat_map(Sequential::evidence);
        for (variant, evidence) in variants.iter_mut().zip(evidence) {
            variant.evidence = Some(evidence);
        }
        for variant in &mut variants {
            variant.guarantees.retain(|guarantee| guarantee.judged > 0);
        }
        Ok(Self {
            name: campaign.name().to_owned(),
            description: campaign.definition().description.clone(),
            directory: results.directory().to_owned(),
            passed: variants.iter().all(VariantSummary::passed),
            variants,
        })
    }

    /// As a table; with `only_violated` nothing but violated guarantees.
    #[must_use]
    pub fn table(&self, only_violated: bool) -> String {
        if only_violated && self.passed {
            return String::new();
        }
        let mut text = format!("\n{}: {}\n", self.name, self.description);
        for variant in &self.variants {
            variant.write(&mut text, only_violated);
        }
        let demand = self.variants.iter().any(VariantSummary::is_demanded);
        let result = match (demand, self.passed) {
            _ if self.variants.iter().any(VariantSummary::is_estimated) => {
                "a probability was estimated"
            }
            (false, true) => "no guarantee was violated",
            (false, false) => "guarantees were VIOLATED",
            (true, true) => "the demand is shown",
            (true, false) => "the demand is NOT shown",
        };
        let _ = writeln!(text, "  {result}; results in {}", self.directory.display());
        text
    }

    /// As JSON.
    #[must_use]
    pub fn json(&self) -> String {
        format!("{:#}", serde_json::json!(self))
    }
}

impl VariantSummary {
    fn is_demanded(&self) -> bool {
        self.evidence.is_some() || self.rare.as_ref().is_some_and(|rare| rare.demanded.is_some())
    }

    fn is_estimated(&self) -> bool {
        self.rare.is_some() && !self.is_demanded()
    }

    fn passed(&self) -> bool {
        match &self.evidence {
            Some(evidence) => evidence.decision == Decision::Demonstrated,
            None => self.violated == 0,
        }
    }

    fn add(&mut self, row: &Row) {
        match row.outcome {
            RunOutcome::Held => self.held += 1,
            RunOutcome::Violated => self.violated += 1,
            RunOutcome::Refused => self.refused += 1,
        }
        let flown = row.outcome != RunOutcome::Refused;
        self.assumptions_broken += u32::from(flown && !row.assumptions_kept);
        let violated: Vec<_> = match row.outcome {
            RunOutcome::Violated => row.reason.split("; ").collect(),
            _ => Vec::new(),
        };
        for summary in &mut self.activity {
            summary.add(row);
        }
        for (summary, seen) in self.guarantees.iter_mut().zip(&row.guarantees) {
            let broken = violated.contains(&summary.name);
            summary.judged += u32::from(seen.margin.is_some() || broken);
            summary.violated += u32::from(broken);
            if let Some(margin) = seen.margin
                && summary.tightest.is_none_or(|(least, _)| margin < least || margin.is_nan())
            {
                summary.tightest = Some((margin, row.seed));
            }
        }
    }

    fn write(&self, text: &mut String, only_violated: bool) {
        let Self { name, held, violated, refused, assumptions_broken, .. } = self;
        let _ = writeln!(
            text,
            "  {name}: {held} held, {violated} violated, {refused} refused; assumptions broken in \
             {assumptions_broken}"
        );
        if let Some(evidence) = &self.evidence {
            let _ = writeln!(text, "    {}", evidence.sentence());
        }
        if let Some(rare) = &self.rare {
            let _ = writeln!(text, "    {}", rare.sentence());
            return;
        }
        let shown = self.guarantees.iter().filter(|it| !only_violated || it.violated > 0);
        let headings = ["guarantee", "judged", "violated", "least margin", "unit", "seed"];
        let rows: Vec<_> = shown.map(GuaranteeSummary::cells).collect();
        *text += &aligned(&headings.map(str::to_owned), &rows);
        for ActivitySummary { name, unit, mean, largest, .. } in &self.activity {
            if let (Some((largest, seed)), false) = (largest, only_violated) {
                let (mean, largest) = (number(*mean), number(*largest));
                let _ = writeln!(
                    text,
                    "  info  {name}: mean {mean} {unit}, largest {largest} {unit} (seed {seed})"
                );
            }
        }
    }
}

/// Empty summaries of the torque activity, as far as it is among the columns.
fn activity(columns: &[Guarantee]) -> Vec<ActivitySummary> {
    let empty = |(column, it): (usize, &Guarantee)| {
        let known = TorqueActivity::ROWS.contains(&it.name);
        let (name, unit, largest) = (it.name, it.unit, None);
        known.then_some(ActivitySummary { name, unit, runs: 0, mean: 0.0, largest, column })
    };
    columns.iter().enumerate().filter_map(empty).collect()
}

impl ActivitySummary {
    fn add(&mut self, row: &Row) {
        let Some(value) = row.guarantees.get(self.column).and_then(|it| it.observed) else {
            return;
        };
        self.runs += 1;
        self.mean += (value - self.mean) / f64::from(self.runs);
        if self.largest.is_none_or(|(largest, _)| value > largest || value.is_nan()) {
            self.largest = Some((value, row.seed));
        }
    }
}

impl GuaranteeSummary {
    fn cells(&self) -> [String; 6] {
        let tightest = |cell: fn((f64, u32)) -> String| self.tightest.map_or("-".to_owned(), cell);
        [
            format!("{} {}", self.name, self.equation),
            self.judged.to_string(),
            self.violated.to_string(),
            tightest(|(margin, _)| number(margin)),
            self.unit.to_owned(),
            tightest(|(_, seed)| seed.to_string()),
        ]
    }
}
