//! `merge`.

use std::path::PathBuf;

use clap::Args;

/// What to join.
#[derive(Clone, Debug, Args)]
pub struct MergeArguments {
    /// Directories of results of shares of one campaign, in any order.
    #[arg(value_name = "DIR", required = true)]
    pub parts: Vec<PathBuf>,
    /// Directory to write to, one below it for the campaign.
    #[arg(long, default_value = "out", value_name = "DIR")]
    pub out: PathBuf,
    /// Print only violated guarantees.
    #[arg(long, short)]
    pub quiet: bool,
    /// Print the summary as JSON instead of a table.
    #[arg(long)]
    pub json: bool,
}
