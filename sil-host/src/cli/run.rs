//! `run`.

use std::num::NonZeroU32;
use std::path::PathBuf;

use clap::Args;

use super::LogArguments;

/// A tenth of the ticks shows everything but single-tick noise, in a tenth of the space.
pub(super) const TRACE_EVERY: NonZeroU32 = NonZeroU32::new(10).expect("ten is not zero");

/// How to run.
#[derive(Clone, Debug, Args)]
pub struct RunArguments {
    /// Built-in scenarios or TOML files; the paper's two when none is given.
    #[arg(value_name = "NAME|FILE")]
    pub scenarios: Vec<String>,
    /// Change a value of every scenario, as in `--set controller.saturated.k4=3` (repeatable).
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub changes: Vec<String>,
    /// Directory to write results to, one below it for each scenario.
    #[arg(long, default_value = "out", value_name = "DIR")]
    pub out: PathBuf,
    /// Write every N-th control tick to the trace.
    #[arg(long, default_value_t = TRACE_EVERY, value_name = "N")]
    pub trace_every: NonZeroU32,
    /// Logs for other programs.
    #[command(flatten)]
    pub log: LogArguments,
    /// Seed of every random number; short for `--set seed=N`.
    #[arg(long)]
    pub seed: Option<u32>,
    /// Show no progress, and print only violated guarantees.
    #[arg(long, short)]
    pub quiet: bool,
    /// Print the verdicts as JSON instead of a table.
    #[arg(long)]
    pub json: bool,
}

impl RunArguments {
    /// Names or files of the scenarios to fly.
    #[must_use]
    pub fn scenarios(&self) -> Vec<String> {
        if self.scenarios.is_empty() {
            sim::scenario::DEFAULT_SCENARIOS.map(str::to_owned).to_vec()
        } else {
            self.scenarios.clone()
        }
    }

    /// Every change to the scenarios, in order.
    #[must_use]
    pub fn changes(&self) -> Vec<String> {
        let seed = self.seed.map(|seed| format!("seed={seed}"));
        self.changes.iter().cloned().chain(seed).collect()
    }
}
