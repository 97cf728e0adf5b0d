//! Runs that the report replays, flown again from their seeds.

use rayon::prelude::*;
use serde::Serialize;

use super::scan::Scan;
use crate::campaign::{Campaign, CampaignError, MEASURES, Row};
use crate::replay3d::{ReplayRecorder, Track};

/// Flights that are replayed, shared between the variants.
const FLIGHTS: usize = 16;
/// Frames of a flight.
const FRAMES: usize = 300;
/// The measure by which a run is the best or a typical one.
const RANKED_BY: &str = "position_error_rms";

/// A run to replay.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Number of the variant.
    pub variant: usize,
    /// Seed of the run.
    pub seed: u32,
    /// Reasons for which it is shown.
    pub reasons: Vec<String>,
}

/// A run that was flown again.
#[derive(Clone, Debug, Serialize)]
pub struct Flight {
    /// Name in a list.
    pub name: String,
    /// Number of the variant.
    pub variant: usize,
    /// Seed of the run.
    pub seed: u32,
    /// Recorded track.
    pub track: Track,
}

/// In each variant, the runs with the tightest margins, violated guarantees first, then the best
/// run and a typical one of those drawn.
#[must_use]
pub fn choose(campaign: &Campaign, scan: &Scan) -> Vec<Choice> {
    let variants = 0..campaign.variants().len();
    variants.flat_map(|variant| choose_of(campaign, scan, variant)).collect()
}

fn choose_of(campaign: &Campaign, scan: &Scan, variant: usize) -> Vec<Choice> {
    let mut chosen = Vec::<Choice>::new();
    let mut choose = |seed: u32, reason: String, limit: usize| {
        if let Some(choice) = chosen.iter_mut().find(|choice| choice.seed == seed) {
            choice.reasons.push(reason);
        } else if chosen.len() < limit {
            chosen.push(Choice { variant, seed, reasons: vec![reason] });
        }
    };
    let tallies = campaign.guarantees().iter().zip(&scan.variants[variant].tallies);
    let mut worst: Vec<_> = tallies
        .filter_map(|(guarantee, tally)| {
            let tally = tally.as_ref()?;
            let stands_out = tally.violated > 0 || tally.tightest.is_distinct();
            let run = tally.tightest.runs().first().filter(|_| stands_out)?;
            Some((tally.violated == 0, guarantee.name, run.seed))
        })
        .collect();
    worst.sort_by_key(|(held, ..)| *held);
    let most = (FLIGHTS / campaign.variants().len()).saturating_sub(2).max(1);
    for (held, name, seed) in worst {
        let reason = if held { "tightest" } else { "worst" };
        choose(seed, format!("{reason} {name}"), most);
    }
    let ranked = ranked(scan, variant);
    if let Some((_, seed)) = ranked.get(ranked.len() / 2) {
        choose(*seed, "typical".to_owned(), most + 1);
    }
    if let Some((_, seed)) = ranked.first() {
        choose(*seed, "best".to_owned(), most + 2);
    }
    chosen
}

/// The drawn runs of a variant by the measure that ranks them, best first.
fn ranked(scan: &Scan, variant: usize) -> Vec<(f64, u32)> {
    let measure = MEASURES.iter().position(|measure| measure.key == RANKED_BY);
    let rank = |row: &Row| Some((*row.measures.get(measure?)?)?).map(|value| (value, row.seed));
    let of_variant = scan.points.rows().filter(|row| row.variant == variant);
    let mut ranked: Vec<_> = of_variant.filter_map(rank).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    ranked
}

/// Flies the chosen runs again.
///
/// # Errors
/// When a scenario is refused.
pub fn fly(campaign: &Campaign, choices: &[Choice]) -> Result<Vec<Flight>, CampaignError> {
    choices.par_iter().map(|choice| fly_one(campaign, choice)).collect()
}

fn fly_one(campaign: &Campaign, choice: &Choice) -> Result<Flight, CampaignError> {
    let variant = &campaign.variants()[choice.variant];
    let Choice { seed, .. } = *choice;
    let index = campaign.index(seed).ok_or_else(|| {
        CampaignError::Usage(format!("seed {seed} is not one of `{}`", campaign.name()))
    })?;
    let loaded = campaign.scenario(index, variant)?;
    let scenario = loaded.scenario();
    let mut recorder = ReplayRecorder::new(scenario.duration, FRAMES);
    loaded.flight()?.observe(scenario.ticks(), &mut recorder);
    let name = name(campaign, choice);
    Ok(Flight { name, variant: choice.variant, seed, track: Track::new(&recorder.finish()) })
}

/// Variant, seed, and up to two of the reasons.
fn name(campaign: &Campaign, choice: &Choice) -> String {
    let variant = &campaign.variants()[choice.variant].name;
    let more = match choice.reasons.len() {
        0..=2 => String::new(),
        reasons => format!(" and {} more", reasons - 2),
    };
    let reasons: Vec<_> = choice.reasons.iter().take(2).map(String::as_str).collect();
    format!("{variant}, seed {}: {}{more}", choice.seed, reasons.join("; "))
}
