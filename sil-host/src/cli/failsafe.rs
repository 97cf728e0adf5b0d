//! `failsafe`.

use std::num::NonZeroU64;

use clap::Args;
use rayon::prelude::*;
use sil_host::fly::FlyError;
use sil_host::fly::failsafe::{FaultOutcome, FlightFault, fly_with_fault};
use sim::scenario::LoadedScenario;

/// Arguments of `failsafe`.
#[derive(Clone, Debug, Args)]
pub struct FailsafeArguments {
    /// Built-in scenario or TOML file: its vehicle, controller and disturbance.
    #[arg(value_name = "NAME|FILE", default_value = "paper-saturated")]
    pub scenario: String,
    /// Change a value of the scenario, as in `--set vehicle.mass=0.95` (repeatable).
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub changes: Vec<String>,
    /// Flights with each fault.
    #[arg(long, default_value = "20", value_name = "N")]
    pub runs: NonZeroU64,
    /// Seed of the first flight of each fault.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
}

/// Flies every fault at random times and prints a row for each; `true` if every flight ended as it must.
///
/// # Errors
/// See [`FlyError`].
pub fn failsafe(arguments: &FailsafeArguments) -> Result<bool, FlyError> {
    let loaded = LoadedScenario::open(&arguments.scenario, &arguments.changes)?;
    let seeds = arguments.seed..arguments.seed.saturating_add(arguments.runs.get());
    println!(
        "{:<22} {:>7} {:>7} {:>12} {:>14} {:>14}",
        "fault", "flights", "passed", "ended [s]", "landed [m/s]", "from home [m]"
    );
    let mut passed = true;
    for fault in FlightFault::ALL {
        let flights: Vec<(u64, FaultOutcome)> = seeds
            .clone()
            .into_par_iter()
            .map(|seed| Ok((seed, fly_with_fault(loaded.scenario(), fault, seed)?)))
            .collect::<Result<_, FlyError>>()?;
        passed &= print_row(fault, &flights);
    }
    Ok(passed)
}

/// Prints the largest of each quantity, and every violation; `true` if there is none.
fn print_row(fault: FlightFault, flights: &[(u64, FaultOutcome)]) -> bool {
    let violations: Vec<_> = flights
        .iter()
        .filter_map(|(seed, outcome)| Some((seed, outcome, outcome.violation(fault)?)))
        .collect();
    let most = |quantity: fn(&FaultOutcome) -> f64| {
        flights.iter().map(|(_, outcome)| quantity(outcome)).fold(0.0, f64::max)
    };
    println!(
        "{:<22} {:>7} {:>7} {:>12.1} {:>14.2} {:>14.2}",
        fault.name(),
        flights.len(),
        flights.len() - violations.len(),
        most(|outcome| outcome.ended_after.unwrap_or(f64::INFINITY)),
        most(|outcome| outcome.touchdown_speed),
        most(|outcome| outcome.from_home),
    );
    for (seed, outcome, violation) in &violations {
        println!("  seed {seed}, fault at {:.2} s: {violation}", outcome.fault_time);
    }
    violations.is_empty()
}
