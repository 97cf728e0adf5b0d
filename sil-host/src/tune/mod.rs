//! `tune`: gains from what is known of a vehicle, the closed loop that they make, and a check of both.
//! `docs/tune.md` derives the method.

pub mod check;
pub mod design;
mod digits;
pub mod hover;
pub mod infeasible;
pub mod peak;
pub mod pole;
pub mod proposal;
pub mod report;
pub mod request;
mod room;
pub mod survey;
pub mod ultimate;

use core::fmt;
use std::path::PathBuf;

use crate::campaign::CampaignError;
use crate::cli::TuneArguments;
use check::{Check, check};
use infeasible::Infeasible;
use proposal::Proposal;
use request::Request;
use sim::scenario::{LoadedScenario, ScenarioError};

/// Why nothing was proposed or written.
#[derive(Clone, Debug)]
pub enum TuneError {
    /// The request cannot be read, or a value is out of its range.
    Request(ScenarioError),
    /// No gains meet it.
    Infeasible(Infeasible),
    /// The check cannot be flown.
    Check(CampaignError),
    /// The scenario cannot be written: where, and why.
    Output(PathBuf, String),
}

impl fmt::Display for TuneError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Request(error) => error.fmt(out),
            Self::Infeasible(error) => error.fmt(out),
            Self::Check(error) => error.fmt(out),
            Self::Output(path, error) => write!(out, "{}: {error}", path.display()),
        }
    }
}

impl core::error::Error for TuneError {}

/// Proposes gains, checks them, prints and writes them; whether they pass everything.
///
/// # Errors
/// See [`TuneError`].
pub fn tune(arguments: &TuneArguments) -> Result<bool, TuneError> {
    let request =
        Request::open(&arguments.vehicle, arguments.wanted()).map_err(TuneError::Request)?;
    let proposal = Proposal::new(request).map_err(TuneError::Infeasible)?;
    let text = proposal.scenario();
    // The scenario is read as `run` reads it: what is written can be flown.
    LoadedScenario::parse(&proposal.request.name, &text, &[]).map_err(TuneError::Request)?;
    if let Some(path) = &arguments.write {
        std::fs::write(path, &text)
            .map_err(|error| TuneError::Output(path.clone(), error.to_string()))?;
    }
    if !arguments.no_check && !arguments.quiet {
        eprintln!("{}: flying the check", proposal.request.name);
    }
    let checked =
        if arguments.no_check { None } else { Some(check(&proposal).map_err(TuneError::Check)?) };
    let passed = checked.as_ref().is_none_or(Check::passed);
    if arguments.json {
        println!("{}", report::json(&proposal, checked.as_ref(), passed));
    } else if !arguments.quiet {
        print!("{}", report::table(&proposal, checked.as_ref()));
    }
    Ok(passed)
}
