//! `consistency`.

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use sil_host::consistency::{self, ConsistencyOptions};
use sim::sensor::consistency::ConsistencyError;

/// Arguments of `consistency`.
#[derive(Clone, Debug, Args)]
pub struct ConsistencyArguments {
    /// Built-in sets of sensors, or scenarios with `[sensors]` [default: every built-in set].
    #[arg(value_name = "SET|NAME|FILE")]
    pub sets: Vec<String>,
    /// Flights of each set.
    #[arg(long, default_value_t = 1000, value_name = "N",
          value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub flights: u32,
    /// Seed of the first flight.
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub first_seed: u32,
    /// Length of a flight; the estimate's error is sampled at its end (s).
    #[arg(long, default_value_t = 15.0, value_name = "S", value_parser = seconds)]
    pub seconds: f64,
    /// Change a value of every scenario, as in `--set sensors.gnss="m9n"` (repeatable).
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub changes: Vec<String>,
    /// Show no progress.
    #[arg(long, short)]
    pub quiet: bool,
    /// Print JSON instead of a table.
    #[arg(long)]
    pub json: bool,
}

fn seconds(text: &str) -> Result<f64, String> {
    let bounds = 0.1..=10_000.0;
    text.parse()
        .ok()
        .filter(|seconds| bounds.contains(seconds))
        .ok_or_else(|| format!("must be in [{}, {}] s", bounds.start(), bounds.end()))
}

/// Flies every set and prints NEES and NIS; `true` if all lie within their bounds.
///
/// # Errors
/// See [`ConsistencyError`].
pub fn consistency(arguments: &ConsistencyArguments) -> Result<bool, ConsistencyError> {
    let scenarios = consistency::open(&arguments.sets, &arguments.changes)?;
    let ConsistencyArguments { flights, first_seed, seconds, .. } = *arguments;
    let options = ConsistencyOptions { flights, first_seed, seconds };
    let all = u64::from(flights) * scenarios.len() as u64;
    let bar = if arguments.quiet { ProgressBar::hidden() } else { ProgressBar::new(all) };
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos}/{len} flights, {eta} left") {
        bar.set_style(style);
    }
    let results = consistency::fly(&scenarios, &options, &|| bar.inc(1))?;
    bar.finish_and_clear();
    if arguments.json {
        println!("{}", consistency::json(&results));
    } else {
        print!("{}", consistency::table(&results));
    }
    Ok(consistency::passed(&results))
}
