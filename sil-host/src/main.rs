//! Entry point: parses the command line and turns the outcome into an exit status.

use std::process::ExitCode;

use clap::Parser;
use sil_host::campaign::{CampaignError, campaign, merge};
use sil_host::cli::{Cli, Command, PilArguments, RunArguments, TuneArguments};
use sil_host::pil::{PilError, pil};
use sil_host::report;
use sil_host::run::{RunError, run};
use sil_host::tune::{TuneError, tune};
use sim::scenario::{BUILT_IN, BuiltIn};

const VIOLATED: u8 = 1;
const WRONG_USAGE: u8 = 2;
const NOT_WRITTEN: u8 = 3;
const VEHICLE_FAILED: u8 = 4;

fn main() -> ExitCode {
    match Cli::parse().command {
        Command::List => list(),
        Command::Show { name } => show(&name),
        Command::Run(arguments) => fly(&arguments),
        Command::Pil(arguments) => fly_on_vehicle(&arguments),
        Command::Campaign(arguments) => verdict(campaign(&arguments), campaign_failure),
        Command::Merge(arguments) => verdict(merge(&arguments), campaign_failure),
        Command::Tune(arguments) => propose(&arguments),
    }
}

fn list() -> ExitCode {
    print!("{}", report::built_in_table());
    ExitCode::SUCCESS
}

fn show(name: &str) -> ExitCode {
    let Some(scenario) = BuiltIn::named(name) else {
        let known: Vec<_> = BUILT_IN.iter().map(|scenario| scenario.name).collect();
        eprintln!("error: no built-in scenario `{name}`; there are {}", known.join(", "));
        return ExitCode::from(WRONG_USAGE);
    };
    print!("{}", scenario.text);
    ExitCode::SUCCESS
}

fn fly(arguments: &RunArguments) -> ExitCode {
    verdict(run(arguments), run_failure)
}

fn fly_on_vehicle(arguments: &PilArguments) -> ExitCode {
    verdict(pil(arguments), |error| match error {
        PilError::Run(error) => run_failure(error),
        _ => VEHICLE_FAILED,
    })
}

fn propose(arguments: &TuneArguments) -> ExitCode {
    verdict(tune(arguments), |error| match error {
        TuneError::Infeasible(_) => VIOLATED,
        TuneError::Output(..) => NOT_WRITTEN,
        TuneError::Request(_) | TuneError::Check(_) => WRONG_USAGE,
    })
}

fn run_failure(error: &RunError) -> u8 {
    match error {
        RunError::Scenario(_) => WRONG_USAGE,
        RunError::Output(..) => NOT_WRITTEN,
    }
}

fn campaign_failure(error: &CampaignError) -> u8 {
    match error {
        CampaignError::Output(..) => NOT_WRITTEN,
        _ => WRONG_USAGE,
    }
}

fn verdict<E: std::fmt::Display>(result: Result<bool, E>, failure: impl Fn(&E) -> u8) -> ExitCode {
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(VIOLATED),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(failure(&error))
        }
    }
}
