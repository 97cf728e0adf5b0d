//! The command line; a file a command.

mod campaign;
mod log;
mod merge;
mod pil;
mod run;
mod tune;

use clap::{Parser, Subcommand};

pub use campaign::CampaignArguments;
pub use log::LogArguments;
pub use merge::MergeArguments;
pub use pil::PilArguments;
pub use run::RunArguments;
pub use tune::TuneArguments;

/// Flies the controllers of ctrl-core against a simulated vehicle and checks their guarantees.
///
/// Exit status: 0 every guarantee holds, 1 a guarantee is violated (`tune`: or no gains meet the
/// request), 2 wrong usage or scenario, 3 results cannot be written, 4 the vehicle in the loop (`pil`) failed. `pil` exits with 1 also when
/// a bit differs from SIL.
#[derive(Clone, Debug, Parser)]
#[command(name = "sil-host", version)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Clone, Debug, Subcommand)]
pub enum Command {
    /// List the built-in scenarios.
    List,
    /// Print a built-in scenario in full: save it, change it, run the file.
    Show {
        /// Name of a built-in scenario.
        name: String,
    },
    /// Fly scenarios, check their guarantees, write traces and figures.
    Run(RunArguments),
    /// As `run`, with the controller in the firmware's image in QEMU, in lock step with the plant.
    Pil(PilArguments),
    /// Fly a scenario many times, with values drawn from distributions or taken from a grid.
    Campaign(CampaignArguments),
    /// Join the shares of a campaign that were flown by themselves.
    Merge(MergeArguments),
    /// Propose gains for a vehicle, show poles and predicted errors, check them with flights.
    Tune(TuneArguments),
}
