//! Error of flying a campaign or of using its results.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use crate::run::RunError;
use sim::scenario::ScenarioError;

/// Cause of a campaign that could not be completed.
#[derive(Clone, Debug)]
pub enum CampaignError {
    /// The definition, or a scenario that it names, cannot be read or flown: file, line and key.
    Definition(ScenarioError),
    /// A request does not go together with the campaign.
    Usage(String),
    /// A directory or file of results is not what it should be: which, and why.
    Results(PathBuf, String),
    /// Results cannot be read or written: where, and why.
    Output(PathBuf, String),
    /// The progress asked for the end; what is written can be continued.
    Interrupted,
}

impl CampaignError {
    /// A fault in reading or writing `path`.
    pub(crate) fn io(path: &Path) -> impl Fn(io::Error) -> Self {
        move |error| Self::Output(path.to_owned(), error.to_string())
    }
}

impl fmt::Display for CampaignError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Definition(error) => error.fmt(out),
            Self::Interrupted => out.write_str("interrupted; the next call continues it"),
            Self::Usage(message) => out.write_str(message),
            Self::Results(path, message) | Self::Output(path, message) => {
                write!(out, "{}: {message}", path.display())
            }
        }
    }
}

impl std::error::Error for CampaignError {}

impl From<ScenarioError> for CampaignError {
    fn from(error: ScenarioError) -> Self {
        Self::Definition(error)
    }
}

impl From<RunError> for CampaignError {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Scenario(error) => Self::Definition(error),
            RunError::Output(path, message) => Self::Output(path, message),
        }
    }
}
