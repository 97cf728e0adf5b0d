//! `tune`: gains from what is known of a vehicle, the closed loop that they make, and a check of both.
//! `docs/tune.md` derives the method.

mod assembly;
pub mod check;
pub mod design;
mod digits;
pub mod document;
pub mod filter;
pub mod hover;
pub mod infeasible;
pub mod inner;
mod lasting;
pub mod linear;
pub mod margin;
pub mod noise;
pub mod noise_flight;
pub mod noise_trade;
pub mod peak;
pub mod pole;
pub mod proposal;
pub mod push;
pub mod push_flight;
pub mod report;
pub mod request;
pub mod returning;
mod room;
pub mod steady;
pub mod survey;
pub mod ultimate;

use core::fmt;
use std::path::PathBuf;

use crate::campaign::CampaignError;
use infeasible::Infeasible;
use proposal::Proposal;
use request::{Request, WantedOptions};
use sim::scenario::{LoadedScenario, ScenarioError};

/// Cause of a proposal that was not made or written.
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

/// Proposes gains for a vehicle file or a scenario; the proposal's own scenario can be flown.
///
/// # Errors
/// See [`TuneError`].
pub fn propose(vehicle: &str, wanted: WantedOptions) -> Result<Proposal, TuneError> {
    let request = Request::open(vehicle, wanted).map_err(TuneError::Request)?;
    let proposal = Proposal::new(request).map_err(TuneError::Infeasible)?;
    // The scenario is read as `run` reads it.
    LoadedScenario::parse(&proposal.request.name, &proposal.scenario(), &[])
        .map_err(TuneError::Request)?;
    Ok(proposal)
}
