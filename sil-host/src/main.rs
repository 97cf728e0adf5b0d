//! Entry point: parses the command line and turns the result into an exit status.

mod cli;

use std::process::ExitCode;

use clap::Parser;
use cli::{Cli, Command};
use sil_host::campaign::CampaignError;
use sil_host::fly::FlyError;
use sil_host::pil::PilError;
use sil_host::report;
use sil_host::run::RunError;
use sil_host::tune::TuneError;
use sim::scenario::{BUILT_IN, BuiltIn};

const VIOLATED: u8 = 1;
const WRONG_USAGE: u8 = 2;
const NOT_WRITTEN: u8 = 3;
const VEHICLE_FAILED: u8 = 4;
const WRONG_PROCESSOR: u8 = 5;

fn main() -> ExitCode {
    let missing = cli::missing_extensions();
    if !missing.is_empty() {
        eprintln!(
            "error: this processor lacks {}, which the build uses; build for it with \
             RUSTFLAGS=\"-C target-cpu=native\" cargo build --release -p sil-host",
            missing.join(", ")
        );
        return ExitCode::from(WRONG_PROCESSOR);
    }
    execute()
}

/// Everything after the check of the processor, which must come before any code that it is about.
#[inline(never)]
fn execute() -> ExitCode {
    match Cli::parse().command {
        Command::List => list(),
        Command::Show { name } => show(&name),
        Command::Run(arguments) => status(cli::run(&arguments), run_failure),
        Command::Pil(arguments) => status(cli::pil(&arguments), |error| match error {
            PilError::Run(error) => run_failure(error),
            _ => VEHICLE_FAILED,
        }),
        Command::Fly(arguments) => status(cli::fly(&arguments), fly_failure),
        Command::Failsafe(arguments) => status(cli::failsafe(&arguments), fly_failure),
        Command::Campaign(arguments) => status(cli::campaign(&arguments), campaign_failure),
        Command::Merge(arguments) => status(cli::merge(&arguments), campaign_failure),
        Command::Consistency(arguments) => status(cli::consistency(&arguments), |_| WRONG_USAGE),
        Command::Tune(arguments) => status(cli::tune(&arguments), |error| match error {
            TuneError::Infeasible(_) => VIOLATED,
            TuneError::Output(..) => NOT_WRITTEN,
            TuneError::Request(_) | TuneError::Check(_) => WRONG_USAGE,
        }),
    }
}

fn fly_failure(error: &FlyError) -> u8 {
    match error {
        FlyError::Output(..) => NOT_WRITTEN,
        FlyError::Differs | FlyError::Image(_) => VEHICLE_FAILED,
        FlyError::Scenario(_)
        | FlyError::Refused(_)
        | FlyError::Frame { .. }
        | FlyError::Port(_)
        | FlyError::Key(..) => WRONG_USAGE,
    }
}

fn list() -> ExitCode {
    print!("{}", report::built_in_table());
    ExitCode::SUCCESS
}

fn show(name: &str) -> ExitCode {
    let Some(scenario) = BuiltIn::named(name) else {
        let known = BUILT_IN.iter().map(|scenario| scenario.name);
        let reason = &"no built-in scenario";
        eprintln!("error: {name}: {}", sim::scenario::not_found(name, reason, "scenarios", known));
        return ExitCode::from(WRONG_USAGE);
    };
    print!("{}", scenario.text);
    ExitCode::SUCCESS
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

fn status<E: std::fmt::Display>(result: Result<bool, E>, failure: impl Fn(&E) -> u8) -> ExitCode {
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(VIOLATED),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(failure(&error))
        }
    }
}
