//! `campaign`.

use std::num::NonZeroU32;
use std::path::PathBuf;

use clap::Args;

use super::LogArguments;
use super::run::TRACE_EVERY;
use crate::campaign::Shard;

/// How to fly a campaign.
#[derive(Clone, Debug, Args)]
pub struct CampaignArguments {
    /// Built-in campaign or TOML file.
    #[arg(value_name = "NAME|FILE", required_unless_present = "list")]
    pub campaign: Option<String>,
    /// List the built-in campaigns.
    #[arg(long)]
    pub list: bool,
    /// Print the campaign in full: save it, change it, fly the file.
    #[arg(long)]
    pub show: bool,
    /// Change a value of every scenario, as in `--set controller.saturated.k4=3` (repeatable).
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub changes: Vec<String>,
    /// Number of runs, in place of the campaign's.
    #[arg(long, value_name = "N")]
    pub runs: Option<u32>,
    /// Seed of the first run, in place of the campaign's.
    #[arg(long, value_name = "N")]
    pub first_seed: Option<u32>,
    /// Directory to write results to, one below it for the campaign; what is there is continued.
    #[arg(long, default_value = "out", value_name = "DIR")]
    pub out: PathBuf,
    /// Overwrite results instead of continuing them.
    #[arg(long)]
    pub restart: bool,
    /// Fly only the i-th of n shares; `merge` joins them.
    #[arg(long, default_value = "1/1", value_name = "i/n")]
    pub shard: Shard,
    /// How many flights at a time; one a core if absent.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub threads: Option<u32>,
    /// Fly nothing but the run with this seed, with trace and figures.
    #[arg(long, value_name = "SEED", conflicts_with_all = ["shard", "restart"])]
    pub only: Option<u32>,
    /// With --only: fly nothing but this variant.
    #[arg(long, value_name = "NAME", requires = "only")]
    pub variant: Option<String>,
    /// With --only: write every N-th control tick to the trace.
    #[arg(long, default_value_t = TRACE_EVERY, value_name = "N")]
    pub trace_every: NonZeroU32,
    /// With --only: logs.
    #[command(flatten)]
    pub log: LogArguments,
    /// Show no progress, and print only violated guarantees.
    #[arg(long, short)]
    pub quiet: bool,
    /// Print the summary as JSON instead of a table.
    #[arg(long)]
    pub json: bool,
}

impl CampaignArguments {
    /// Changes to the campaign itself.
    #[must_use]
    pub fn own_changes(&self) -> Vec<String> {
        let runs = self.runs.map(|runs| format!("runs={runs}"));
        let seed = self.first_seed.map(|seed| format!("first_seed={seed}"));
        runs.into_iter().chain(seed).collect()
    }
}
