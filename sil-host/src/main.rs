//! Entry point: parses the command line and turns the outcome into an exit status.

use std::process::ExitCode;

use clap::Parser;
use sil_host::cli::{Cli, Command, RunArguments};
use sil_host::report;
use sil_host::run::{RunError, run};
use sil_host::scenario::{BUILT_IN, BuiltIn};

const VIOLATED: u8 = 1;
const WRONG_USAGE: u8 = 2;
const NOT_WRITTEN: u8 = 3;

fn main() -> ExitCode {
    match Cli::parse().command {
        Command::List => list(),
        Command::Show { name } => show(&name),
        Command::Run(arguments) => fly(&arguments),
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
    match run(arguments) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(VIOLATED),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(match error {
                RunError::Scenario(_) => WRONG_USAGE,
                RunError::Output(..) => NOT_WRITTEN,
            })
        }
    }
}
