//! The data of a page, as its scripts read it.

use std::collections::BTreeMap;

use serde::Serialize;

use super::counts::Counts;
use super::envelope::Envelope;
use super::flights::Flight;
use super::histogram::Histogram;
use super::quantity::{Kind, Quantity};
use super::scan::Scan;
use crate::campaign::{Campaign, Row, RunOutcome};

/// Everything that the scripts of a page read.
#[derive(Debug, Serialize)]
pub struct Document<'a> {
    variants: Vec<VariantName<'a>>,
    quantities: Vec<Counted<'a>>,
    points: PointColumns,
    envelope: &'a Option<Envelope>,
    commands: Vec<Commands>,
    flights: &'a [Flight],
}

#[derive(Debug, Serialize)]
struct VariantName<'a> {
    name: &'a str,
}

/// A quantity with its histogram.
#[derive(Debug, Serialize)]
struct Counted<'a> {
    #[serde(flatten)]
    quantity: &'a Quantity,
    #[serde(flatten)]
    histogram: &'a Histogram,
}

/// Rows that are shown one by one, as columns.
#[derive(Debug, Serialize)]
struct PointColumns {
    seed: Vec<u32>,
    variant: Vec<usize>,
    held: Vec<u8>,
    /// In the order of the quantities.
    columns: Vec<Vec<Option<f64>>>,
}

/// The commands that repeat runs of one variant: what all begin with, and the rest by seed.
#[derive(Debug, Default, Serialize)]
struct Commands {
    prefix: String,
    rest: BTreeMap<u32, String>,
}

impl<'a> Document<'a> {
    /// Puts the data together.
    #[must_use]
    pub fn new(
        campaign: &'a Campaign,
        quantities: &'a [Quantity],
        scan: &Scan,
        counts: &'a Counts,
        flights: &'a [Flight],
    ) -> Self {
        let shown = scan.shown();
        let names = campaign.variants().iter().map(|variant| VariantName { name: &variant.name });
        let counted = quantities.iter().zip(&counts.histograms);
        Self {
            variants: names.collect(),
            quantities: counted
                .map(|(quantity, histogram)| Counted { quantity, histogram })
                .collect(),
            points: PointColumns::new(&shown, quantities),
            envelope: &counts.envelope,
            commands: commands(campaign, &seeds(campaign, &shown, counts, flights)),
            flights,
        }
    }
}

impl PointColumns {
    fn new(rows: &[&Row], quantities: &[Quantity]) -> Self {
        let column = |quantity: &Quantity| {
            // The page draws these; its commands have the exact values.
            let digits = if quantity.kind == Kind::Varied { 5 } else { 4 };
            let shown = |row: &&Row| quantity.of(row).map(|value| significant(value, digits));
            rows.iter().map(shown).collect()
        };
        Self {
            seed: rows.iter().map(|row| row.seed).collect(),
            variant: rows.iter().map(|row| row.variant).collect(),
            held: rows.iter().map(|row| u8::from(row.outcome == RunOutcome::Held)).collect(),
            columns: quantities.iter().map(column).collect(),
        }
    }
}

/// `value` to so many significant digits.
fn significant(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

/// Seeds that a reader can ask a command of, for each variant.
fn seeds(
    campaign: &Campaign,
    shown: &[&Row],
    counts: &Counts,
    flights: &[Flight],
) -> Vec<Vec<u32>> {
    let of_variant = |variant: usize| {
        let rows = shown.iter().filter(|row| row.variant == variant).map(|row| row.seed);
        let flights = flights.iter().filter(|it| it.variant == variant).map(|it| it.seed);
        let cells = counts.envelope.iter().flat_map(|it| &it.variants[variant].seed);
        rows.chain(flights).chain(cells.copied().flatten()).collect()
    };
    (0..campaign.variants().len()).map(of_variant).collect()
}

fn commands(campaign: &Campaign, seeds: &[Vec<u32>]) -> Vec<Commands> {
    let of_variant = |(variant, seeds): (_, &Vec<u32>)| {
        let command =
            |seed: &u32| Some((*seed, campaign.replay_command(campaign.index(*seed)?, variant)));
        Commands::new(seeds.iter().filter_map(command).collect())
    };
    campaign.variants().iter().zip(seeds).map(of_variant).collect()
}

impl Commands {
    fn new(commands: BTreeMap<u32, String>) -> Self {
        let mut all = commands.values();
        let Some(first) = all.next() else { return Self::default() };
        let shared = |length: usize, other: &String| {
            let alike = first.bytes().zip(other.bytes()).take(length).take_while(|(a, b)| a == b);
            alike.count()
        };
        let length = first.floor_char_boundary(all.fold(first.len(), shared));
        Self {
            prefix: first[..length].to_owned(),
            rest: commands.iter().map(|(seed, it)| (*seed, it[length..].to_owned())).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_whole_again_with_their_prefix() {
        let all = BTreeMap::from([
            (1, "run a --set µ=1".to_owned()),
            (2, "run a --set ν=2".to_owned()),
            (3, "run a --set µ=3".to_owned()),
        ]);
        let commands = Commands::new(all.clone());
        assert_eq!(commands.prefix, "run a --set ");
        for (seed, command) in all {
            assert_eq!(commands.prefix.clone() + &commands.rest[&seed], command);
        }
        assert!(Commands::new(BTreeMap::new()).rest.is_empty());
    }

    #[test]
    fn digits_are_cut_not_values() {
        assert_eq!(significant(123_456.789, 4), 123_500.0);
        assert_eq!(significant(-1.234_56e-7, 4), -1.235e-7);
        assert_eq!(significant(0.0, 4), 0.0);
    }
}
