//! The program: command line, progress, printed tables; one file per command.

mod campaign;
mod campaign_progress;
mod consistency;
mod failsafe;
mod flight_progress;
mod fly;
mod log;
mod merge;
mod pil;
mod processor;
mod run;
mod tune;

use clap::{Parser, Subcommand};

pub use campaign::{CampaignArguments, campaign};
pub use consistency::{ConsistencyArguments, consistency};
pub use failsafe::{FailsafeArguments, failsafe};
pub use fly::{FlyArguments, fly};
use log::LogArguments;
pub use merge::{MergeArguments, merge};
pub use pil::{PilArguments, pil};
pub use processor::missing_extensions;
pub use run::{RunArguments, run};
pub use tune::{TuneArguments, tune};

/// Flies the controllers of ctrl-core against a simulated vehicle and checks their guarantees.
///
/// Exit status: 0 every guarantee holds, 1 a guarantee is violated (`tune`: or no gains meet the
/// request; `consistency`: or NEES or NIS lie outside their bounds), 2 wrong usage or scenario, 3 results cannot be written, 4 the vehicle in the loop (`pil`) failed. `pil` exits with 1 also when
/// a bit differs from SIL.
#[derive(Clone, Debug, Parser)]
#[command(name = "sil-host", version)]
pub struct Cli {
    /// The command.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
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
    /// Fly a vehicle in real time under a ground station or a script, on MAVLink.
    Fly(FlyArguments),
    /// Let every fault happen at random times of a commanded flight, and judge its end.
    Failsafe(FailsafeArguments),
    /// As `run`, with the controller in the firmware's image in QEMU, in lock step with the plant.
    Pil(PilArguments),
    /// Fly a scenario many times, with values drawn from distributions or taken from a grid.
    Campaign(CampaignArguments),
    /// Join the results of the shares of a campaign.
    Merge(MergeArguments),
    /// Fly the estimator many times with every set of sensors, and compare its errors with its covariance.
    Consistency(ConsistencyArguments),
    /// Propose gains for a vehicle, show poles and predicted errors, check them with flights.
    Tune(TuneArguments),
}
