//! Counts of runs that held, in cells over two varied values.

use std::collections::BTreeSet;

use serde::Serialize;

use super::histogram::Extent;
use crate::campaign::{Campaign, Row, RunOutcome};

/// More distinct values than this are cut into cells instead of shown one by one.
const LEVELS_MAX: usize = 40;
/// Cells of an axis without levels, and runs that each cell should get.
const CELLS: std::ops::RangeInclusive<usize> = 4..=20;
const RUNS_A_CELL: f64 = 6.0;

/// The values that an axis takes in a campaign.
#[derive(Clone, Debug)]
pub struct AxisValues {
    extent: Extent,
    /// As bits, in the order of positive and negative numbers apart; none once there are too many.
    distinct: Option<BTreeSet<u64>>,
}

impl AxisValues {
    /// Before the first.
    #[must_use]
    pub fn new() -> Self {
        Self { extent: Extent::EMPTY, distinct: Some(BTreeSet::new()) }
    }

    /// Takes in a value.
    pub fn push(&mut self, value: f64) {
        self.extent.include(value);
        if let Some(distinct) = &mut self.distinct {
            distinct.insert(value.to_bits());
            if distinct.len() > LEVELS_MAX {
                self.distinct = None;
            }
        }
    }

    /// The distinct values in order, if they are few.
    fn levels(&self) -> Option<Vec<f64>> {
        let mut levels: Vec<_> =
            self.distinct.as_ref()?.iter().map(|&b| f64::from_bits(b)).collect();
        levels.sort_by(f64::total_cmp);
        Some(levels)
    }
}

impl Default for AxisValues {
    fn default() -> Self {
        Self::new()
    }
}

/// One axis of the map.
#[derive(Clone, Debug, Serialize)]
pub struct Axis {
    name: String,
    unit: String,
    lower: f64,
    upper: f64,
    cells: usize,
    /// The value of each cell, where it has but one.
    levels: Option<Vec<f64>>,
    #[serde(skip)]
    parameter: usize,
}

impl Axis {
    fn new(campaign: &Campaign, parameter: usize, values: &AxisValues) -> Self {
        let described = &campaign.parameters()[parameter];
        // As many cells as leave the runs dense enough to compare shares; levels only where the
        // same values come back, as on a grid.
        let runs = f64::from(campaign.runs());
        let spread = ((runs / RUNS_A_CELL).sqrt() as usize).clamp(*CELLS.start(), *CELLS.end());
        let levels = values.levels().filter(|levels| 2 * levels.len() <= campaign.runs() as usize);
        Self {
            name: described.path.clone(),
            unit: described.unit.clone(),
            lower: values.extent.lower,
            upper: values.extent.upper,
            cells: levels.as_ref().map_or(spread, Vec::len),
            levels,
            parameter,
        }
    }

    fn cell(&self, row: &Row) -> Option<usize> {
        let value = *row.parameters.get(self.parameter)?;
        if let Some(levels) = &self.levels {
            return levels.iter().position(|level| *level == value);
        }
        let share = (value - self.lower) / (self.upper - self.lower);
        Some(((share * self.cells as f64) as usize).min(self.cells - 1))
    }
}

/// Counts of one variant, row by row from the lower left.
#[derive(Clone, Debug, Serialize)]
pub struct Cells {
    /// Runs that were flown.
    pub runs: Vec<u32>,
    /// Of these, runs that held.
    pub held: Vec<u32>,
    /// A run to look at: the first that was violated, else the first.
    pub seed: Vec<Option<u32>>,
}

/// The map of all variants.
#[derive(Clone, Debug, Serialize)]
pub struct Envelope {
    x: Axis,
    y: Axis,
    /// One a variant.
    pub variants: Vec<Cells>,
}

impl Envelope {
    /// An empty map over the campaign's two envelope parameters, whose values are `seen`.
    #[must_use]
    pub fn new(campaign: &Campaign, [across, up]: [usize; 2], seen: &[AxisValues; 2]) -> Self {
        let x = Axis::new(campaign, across, &seen[0]);
        let y = Axis::new(campaign, up, &seen[1]);
        let count = x.cells * y.cells;
        let cells = Cells { runs: vec![0; count], held: vec![0; count], seed: vec![None; count] };
        Self { x, y, variants: vec![cells; campaign.variants().len()] }
    }

    /// Counts a run; a refused one was not flown.
    pub fn push(&mut self, row: &Row) {
        let (Some(column), Some(line)) = (self.x.cell(row), self.y.cell(row)) else { return };
        let cell = line * self.x.cells + column;
        let counts = &mut self.variants[row.variant];
        let all_held = counts.runs[cell] == counts.held[cell];
        match row.outcome {
            RunOutcome::Refused => return,
            RunOutcome::Held => {
                counts.held[cell] += 1;
                counts.seed[cell].get_or_insert(row.seed);
            }
            RunOutcome::Violated if all_held => counts.seed[cell] = Some(row.seed),
            RunOutcome::Violated => {}
        }
        counts.runs[cell] += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn campaign(levels: bool) -> Campaign {
        let (tilt, rate) = if levels {
            ("linspace = { lower = 0.0, upper = 90.0, levels = 3 }", "values = [-1.0, 0.0, 2.0]")
        } else {
            ("uniform = { lower = 0.0, upper = 90.0 }", "uniform = { lower = -1.0, upper = 2.0 }")
        };
        let sampling = if levels { "grid" } else { "monte_carlo" };
        let text = format!(
            "name = \"t\"\ndescription = \"\"\nsampling = \"{sampling}\"\nruns = 180\n\
             scenario = \"tilt-recovery\"\n\
             envelope = [\"initial.tilt_deg\", \"initial.rate_body[0]\"]\n\
             [[vary]]\npath = \"initial.tilt_deg\"\n{tilt}\n\
             [[vary]]\npath = \"initial.rate_body[0]\"\n{rate}\n"
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

    fn row(seed: u32, parameters: [f64; 2], outcome: RunOutcome) -> Row {
        Row {
            seed,
            variant: 0,
            parameters: parameters.to_vec(),
            outcome,
            reason: String::new(),
            assumptions_kept: true,
            measures: Vec::new(),
            guarantees: Vec::new(),
        }
    }

    fn map(campaign: &Campaign, rows: &[Row]) -> Envelope {
        let mut seen = [AxisValues::new(), AxisValues::new()];
        for index in 0..campaign.runs() {
            let values = campaign.values(index);
            seen.iter_mut().zip(values).for_each(|(seen, value)| seen.push(value));
        }
        let mut envelope = Envelope::new(campaign, [0, 1], &seen);
        rows.iter().for_each(|row| envelope.push(row));
        envelope
    }

    #[test]
    fn a_grid_has_a_cell_a_level() {
        use RunOutcome::{Held, Refused, Violated};
        let rows = [
            row(1, [45.0, -1.0], Held),
            row(2, [45.0, -1.0], Violated),
            row(3, [45.0, -1.0], Violated),
            row(4, [90.0, 2.0], Held),
            row(5, [0.0, 0.0], Refused),
        ];
        let envelope = map(&campaign(true), &rows);
        assert_eq!(envelope.y.levels, Some(vec![-1.0, 0.0, 2.0]), "in order of value");
        let cells = &envelope.variants[0];
        assert_eq!(cells.runs, [0, 3, 0, 0, 0, 0, 0, 0, 1]);
        assert_eq!(cells.held, [0, 1, 0, 0, 0, 0, 0, 0, 1]);
        assert_eq!((cells.seed[1], cells.seed[8], cells.seed[3]), (Some(2), Some(4), None));
    }

    #[test]
    fn random_values_are_cut_into_cells_and_both_ends_are_inside() {
        let campaign = campaign(false);
        let rows: Vec<_> = (0..campaign.runs())
            .map(|index| {
                let values = campaign.values(index);
                row(index, [values[0], values[1]], RunOutcome::Held)
            })
            .collect();
        let envelope = map(&campaign, &rows);
        assert_eq!((envelope.x.cells, envelope.x.levels.is_none()), (5, true));
        assert_eq!(envelope.variants[0].runs.iter().sum::<u32>(), 180);
    }
}
