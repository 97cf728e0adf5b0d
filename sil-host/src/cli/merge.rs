//! `merge`.

use std::path::PathBuf;

use clap::Args;
use sil_host::campaign::{self, CampaignError};

/// Arguments of `merge`.
#[derive(Clone, Debug, Args)]
pub struct MergeArguments {
    /// Directories of the results of shares of one campaign, in any order.
    #[arg(value_name = "DIR", required = true)]
    pub parts: Vec<PathBuf>,
    /// Output directory; the campaign gets a directory below it.
    #[arg(long, default_value = "out", value_name = "DIR")]
    pub out: PathBuf,
    /// Print only violated guarantees.
    #[arg(long, short)]
    pub quiet: bool,
    /// Print the summary as JSON instead of a table.
    #[arg(long)]
    pub json: bool,
}

/// Joins the results of shares and prints the summary; `true` if every guarantee held.
///
/// # Errors
/// See [`CampaignError`].
pub fn merge(arguments: &MergeArguments) -> Result<bool, CampaignError> {
    let summary = campaign::merge(&arguments.parts, &arguments.out)?;
    super::campaign::print_summary(&summary, arguments.json, arguments.quiet);
    Ok(summary.passed)
}
