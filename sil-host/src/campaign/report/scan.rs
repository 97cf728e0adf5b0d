//! The first pass over the rows: counts, extents, and the rows that are shown one by one.

use std::collections::BTreeMap;

use super::envelope::AxisValues;
use super::histogram::Extent;
use super::points::Points;
use super::quantity::Quantity;
use super::tally::Tally;
use crate::campaign::{Campaign, Row, RunOutcome};
use sim::guarantee::Requirement;

/// Rows that charts show one by one.
const POINTS: usize = 1_000;
/// Violated rows that are listed, and kinds of refusal.
const VIOLATIONS: usize = 100;
const REFUSALS: usize = 20;
/// Runs among which one is looked for that the scenario does not refuse.
const ATTEMPTS: u32 = 100;

/// All rows, taken in one by one.
#[derive(Clone, Debug)]
pub struct Scan {
    /// In the order of the campaign's variants.
    pub variants: Vec<VariantScan>,
    /// Extents of the quantities.
    pub extents: Vec<Extent>,
    /// Values of the two axes of the envelope.
    pub axes: [AxisValues; 2],
    /// A draw of rows.
    pub points: Points,
    /// The first violated rows.
    pub violations: Vec<Row>,
    envelope: Option<[usize; 2]>,
}

/// The rows of one variant.
#[derive(Clone, Debug)]
pub struct VariantScan {
    /// Runs that held every guarantee.
    pub held: u64,
    /// Runs that violated one.
    pub violated: u64,
    /// Runs that scenario or controller refused.
    pub refused: u64,
    /// Runs that were flown outside the assumptions of the theorems.
    pub outside: u64,
    /// Of these, runs that violated a guarantee.
    pub outside_violated: u64,
    /// Reasons for which runs were refused: the number of runs, and the seed of the first.
    pub refusals: BTreeMap<String, (u64, u32)>,
    /// In the order of the campaign's guarantees; none where it does not apply.
    pub tallies: Vec<Option<Tally>>,
}

impl VariantScan {
    fn new(campaign: &Campaign, variant: usize) -> Self {
        let promised = requirements(campaign, variant);
        let tally = |name| promised.get(name).map(|requirement| Tally::new(*requirement));
        Self {
            held: 0,
            violated: 0,
            refused: 0,
            outside: 0,
            outside_violated: 0,
            refusals: BTreeMap::new(),
            tallies: campaign.guarantees().iter().map(|it| tally(it.name)).collect(),
        }
    }

    /// Runs that were flown.
    #[must_use]
    pub fn flown(&self) -> u64 {
        self.held + self.violated
    }

    fn push(&mut self, row: &Row) {
        match row.outcome {
            RunOutcome::Held => self.held += 1,
            RunOutcome::Violated => self.violated += 1,
            RunOutcome::Refused => return self.refuse(row),
        }
        self.outside += u64::from(!row.assumptions_kept);
        let violated = row.outcome == RunOutcome::Violated;
        self.outside_violated += u64::from(!row.assumptions_kept && violated);
        for (tally, seen) in self.tallies.iter_mut().zip(&row.guarantees) {
            if let Some(tally) = tally {
                tally.push(row.seed, *seen);
            }
        }
    }

    fn refuse(&mut self, row: &Row) {
        self.refused += 1;
        if self.refusals.len() < REFUSALS || self.refusals.contains_key(&row.reason) {
            self.refusals.entry(row.reason.clone()).or_insert((0, row.seed)).0 += 1;
        }
    }
}

/// The bounds of a variant by the name of the guarantee, as one of its runs has them.
fn requirements(campaign: &Campaign, variant: usize) -> BTreeMap<&'static str, Requirement> {
    let variant = &campaign.variants()[variant];
    let scenario = |index| campaign.scenario(index, variant).ok();
    let Some(loaded) = (0..campaign.runs().min(ATTEMPTS)).find_map(scenario) else {
        return BTreeMap::new();
    };
    let monitors = loaded.scenario().monitors();
    monitors.verdicts().iter().map(|verdict| (verdict.name, verdict.requirement)).collect()
}

impl Scan {
    /// Before the first row.
    #[must_use]
    pub fn new(campaign: &Campaign, quantities: &[Quantity]) -> Self {
        let variants = 0..campaign.variants().len();
        Self {
            variants: variants.map(|variant| VariantScan::new(campaign, variant)).collect(),
            extents: vec![Extent::EMPTY; quantities.len()],
            axes: [AxisValues::new(), AxisValues::new()],
            points: Points::new(POINTS),
            violations: Vec::new(),
            envelope: campaign.envelope(),
        }
    }

    /// Takes in a row.
    pub fn push(&mut self, row: &Row, quantities: &[Quantity]) {
        self.variants[row.variant].push(row);
        for (extent, quantity) in self.extents.iter_mut().zip(quantities) {
            quantity.of(row).into_iter().for_each(|value| extent.include(value));
        }
        if let Some(envelope) = self.envelope {
            for (axis, parameter) in self.axes.iter_mut().zip(envelope) {
                axis.push(row.parameters[parameter]);
            }
        }
        if row.outcome != RunOutcome::Refused {
            self.points.push(row);
        }
        if row.outcome == RunOutcome::Violated && self.violations.len() < VIOLATIONS {
            self.violations.push(row.clone());
        }
    }

    /// Rows that violated a guarantee.
    #[must_use]
    pub fn violated(&self) -> u64 {
        self.variants.iter().map(|variant| variant.violated).sum()
    }

    /// Every row that charts show: the draw and the listed violations, each once, by seed.
    #[must_use]
    pub fn shown(&self) -> Vec<&Row> {
        let all = self.points.rows().chain(&self.violations);
        let shown: BTreeMap<_, _> = all.map(|row| ((row.seed, row.variant), row)).collect();
        shown.into_values().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::report::flights;
    use crate::campaign::{MEASURES, Observed};
    use std::path::Path;

    const RUNS: u32 = 200;

    fn campaign() -> Campaign {
        let text = format!(
            "name = \"t\"\ndescription = \"\"\nsampling = \"monte_carlo\"\nruns = {RUNS}\n\
             scenario = \"tilt-recovery\"\n\
             [[vary]]\npath = \"vehicle.mass\"\nuniform = {{ lower = 0.7, upper = 1.0 }}\n"
        );
        Campaign::parse(
            "t",
            &text,
            Path::new(""),
            &crate::campaign::CampaignOverrides::default(),
            &[],
        )
        .expect("a campaign")
    }

    /// Every tenth run is refused, every tenth violates what the flight promises first; half are
    /// outside the assumptions.
    fn row(campaign: &Campaign, index: u32) -> Row {
        let (outcome, margin) = match index % 10 {
            0 => (RunOutcome::Refused, 0.0),
            1 => (RunOutcome::Violated, -f64::from(index)),
            _ => (RunOutcome::Held, f64::from(index)),
        };
        let seen = Observed { observed: Some(margin), margin: Some(margin) };
        Row {
            seed: campaign.seed(index),
            variant: 0,
            parameters: campaign.values(index),
            outcome,
            reason: format!("reason {}", index % 20),
            assumptions_kept: index.is_multiple_of(2),
            measures: vec![Some(f64::from(index)); MEASURES.len()],
            guarantees: vec![seen; campaign.guarantees().len()],
        }
    }

    fn scan(campaign: &Campaign) -> Scan {
        let quantities = Quantity::all(campaign);
        let mut scan = Scan::new(campaign, &quantities);
        (0..RUNS).for_each(|index| scan.push(&row(campaign, index), &quantities));
        scan
    }

    #[test]
    fn outcomes_are_counted_and_refused_runs_are_not_judged() {
        let campaign = campaign();
        let scan = scan(&campaign);
        let counts = &scan.variants[0];
        assert_eq!((counts.held, counts.violated, counts.refused), (160, 20, 20));
        assert_eq!((counts.outside, counts.outside_violated), (100, 20));
        let refusals: Vec<_> = counts.refusals.iter().collect();
        let (zero, ten) = ("reason 0".to_owned(), "reason 10".to_owned());
        assert_eq!(refusals, [(&zero, &(10, campaign.seed(0))), (&ten, &(10, campaign.seed(10)))]);
        for tally in counts.tallies.iter().flatten().filter(|tally| tally.is_bound()) {
            assert_eq!((tally.runs, tally.violated), (180, 20));
            assert_eq!(tally.tightest.runs()[0].seed, campaign.seed(191));
        }
        assert_eq!((scan.violated(), scan.violations.len()), (20, 20));
        assert_eq!(scan.shown().len(), 180, "drawn and violated rows, each once");
    }

    #[test]
    fn few_runs_are_replayed_each_once_the_worst_first() {
        let campaign = campaign();
        let chosen = flights::choose(&campaign, &scan(&campaign));
        let seeds: Vec<_> = chosen.iter().map(|choice| campaign.index(choice.seed)).collect();
        assert_eq!(seeds, [Some(191), Some(101), Some(1)], "worst, typical, best");
        assert!(chosen[0].reasons.len() > 10, "every guarantee has the same worst run");
    }
}
