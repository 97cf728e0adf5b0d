//! A campaign as it is written in TOML. `sil-host campaign NAME --show` prints a built-in one, whose
//! comments explain every field.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::distribution::Vary;
use super::splitting::Splitting;
use super::stop::StopRule;

/// Definition of a campaign's flights.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Definition {
    /// Short name; the directory of the results is called after it.
    pub name: String,
    /// Question that it answers, in a sentence or two.
    pub description: String,
    /// Sampling of the varied values.
    pub sampling: Sampling,
    /// Number of runs; in a grid, which has one per cell if this is absent, a multiple of its cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub runs: Option<u32>,
    /// Seed of the first run; run `i` has the seed `first_seed + i`.
    #[serde(default = "one")]
    pub first_seed: u32,
    /// Built-in scenario, or file beside the campaign's, that every run starts from, unless the
    /// variants name their own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scenario: Option<String>,
    /// Changes to the scenario that all runs share, `path=value` each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub set: Vec<String>,
    /// Two varied paths that the recovery envelope, or heat map, is drawn over.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub envelope: Option<[String; 2]>,
    /// Demand after which the campaign ends as soon as it is shown or refuted; `runs` is then the most that are flown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop: Option<StopRule>,
    /// Estimation of a rare violation by multilevel splitting; `runs` is then the most flights.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub splitting: Option<Splitting>,
    /// Values that change from run to run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub vary: Vec<Vary>,
    /// Each run is flown once in every variant, with the same values and the same seed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub variant: Vec<VariantDefinition>,
    /// Texts of scenarios by name, which go before built-in ones and files: what makes the
    /// `campaign.toml` of a result complete in itself.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub scenarios: BTreeMap<String, String>,
}

/// Sampling of the varied values of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// Every value at random, from the run's seed.
    MonteCarlo,
    /// As many strata of equal probability in each dimension as there are runs, each met once.
    LatinHypercube,
    /// Owen-scrambled Sobol points.
    Sobol,
    /// All combinations of the listed levels; what has no levels is drawn as in `monte_carlo`.
    Grid,
}

/// A variant of every run.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct VariantDefinition {
    /// Short name.
    pub name: String,
    /// Scenario in place of the campaign's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scenario: Option<String>,
    /// Changes after the campaign's.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub set: Vec<String>,
}

fn one() -> u32 {
    1
}
