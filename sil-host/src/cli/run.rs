//! `run`.

use std::num::NonZeroU32;
use std::path::PathBuf;

use clap::Args;
use sil_host::report::{self, FlightReport};
use sil_host::run::{self, FlightOptions, RunError};
use sim::scenario::LoadedScenario;

use super::LogArguments;
use super::flight_progress::FlightProgressBar;

/// A tenth of the ticks shows everything but single-tick noise, in a tenth of the space.
pub(super) const TRACE_EVERY: NonZeroU32 = NonZeroU32::new(10).expect("ten is not zero");

/// Arguments of `run`.
#[derive(Clone, Debug, Args)]
pub struct RunArguments {
    /// Built-in scenarios or TOML files [default: the paper's two].
    #[arg(value_name = "NAME|FILE")]
    pub scenarios: Vec<String>,
    /// Change a value of every scenario, as in `--set controller.saturated.k4=3` (repeatable).
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub changes: Vec<String>,
    /// Output directory; each scenario gets a directory below it.
    #[arg(long, default_value = "out", value_name = "DIR")]
    pub out: PathBuf,
    /// Control ticks per row of the trace.
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
    /// Reads every scenario, with the changes made.
    ///
    /// # Errors
    /// The first scenario that cannot be read or flown.
    pub fn scenarios(&self) -> Result<Vec<LoadedScenario>, RunError> {
        let default = sim::scenario::DEFAULT_SCENARIOS.map(str::to_owned).to_vec();
        let names = if self.scenarios.is_empty() { &default } else { &self.scenarios };
        let seed = self.seed.map(|seed| format!("seed={seed}"));
        let changes: Vec<_> = self.changes.iter().cloned().chain(seed).collect();
        Ok(names
            .iter()
            .map(|name| LoadedScenario::open(name, &changes))
            .collect::<Result<_, _>>()?)
    }

    /// Options for the results.
    #[must_use]
    pub fn options(&self) -> FlightOptions {
        let Self { out, trace_every, log, .. } = self;
        FlightOptions { out: out.clone(), trace_every: *trace_every, log: log.options() }
    }
}

/// Flies every scenario and prints the tables; `true` if every guarantee held.
///
/// # Errors
/// All scenarios are read before the first is flown. See [`RunError`].
pub fn run(arguments: &RunArguments) -> Result<bool, RunError> {
    let scenarios = arguments.scenarios()?;
    let options = arguments.options();
    let mut reports = Vec::with_capacity(scenarios.len());
    for loaded in &scenarios {
        let progress = FlightProgressBar::new(loaded.scenario(), arguments.quiet);
        let report = run::fly(loaded, &options, &|ticks| progress.advance(ticks))?;
        progress.finish();
        if !arguments.json {
            print!("{}", report::table(&report, arguments.quiet));
        }
        reports.push(report);
    }
    if arguments.json {
        println!("{}", report::json(&reports));
    }
    Ok(reports.iter().all(FlightReport::passed))
}
