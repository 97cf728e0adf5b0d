//! The command line.

use std::num::NonZeroU32;
use std::path::PathBuf;

use clap::{ArgAction, Args, Parser, Subcommand};

use crate::pil::emulator::{IMAGE, QEMU, SHIFT};
use crate::pil::fault::Fault;

/// Flies the controllers of ctrl-core against a simulated vehicle and checks their guarantees.
///
/// Exit status: 0 every guarantee holds, 1 a guarantee is violated, 2 wrong usage or scenario,
/// 3 results cannot be written, 4 the vehicle in the loop (`pil`) failed. `pil` exits with 1 also when
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
}

/// A tenth of the ticks shows everything but single-tick noise, in a tenth of the space.
const TRACE_EVERY: NonZeroU32 = NonZeroU32::new(10).expect("ten is not zero");

/// How to run.
#[derive(Clone, Debug, Args)]
pub struct RunArguments {
    /// Built-in scenarios or TOML files; the paper's two when none is given.
    #[arg(value_name = "NAME|FILE")]
    pub scenarios: Vec<String>,
    /// Change a value of every scenario, as in `--set controller.saturated.k4=3` (repeatable).
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub changes: Vec<String>,
    /// Directory to write results to, one below it for each scenario.
    #[arg(long, default_value = "out", value_name = "DIR")]
    pub out: PathBuf,
    /// Write every N-th control tick to the trace.
    #[arg(long, default_value_t = TRACE_EVERY, value_name = "N")]
    pub trace_every: NonZeroU32,
    /// Seed of every random number; short for `--set seed=N`.
    #[arg(long)]
    pub seed: Option<u32>,
    /// Show no progress, and print only violated guarantees.
    #[arg(long, short)]
    pub quiet: bool,
    /// Print the verdicts as JSON instead of a table.
    #[arg(long)]
    pub json: bool,
}

impl RunArguments {
    /// Names or files of the scenarios to fly.
    #[must_use]
    pub fn scenarios(&self) -> Vec<String> {
        if self.scenarios.is_empty() {
            crate::scenario::DEFAULT_SCENARIOS.map(str::to_owned).to_vec()
        } else {
            self.scenarios.clone()
        }
    }

    /// Every change to the scenarios, in order.
    #[must_use]
    pub fn changes(&self) -> Vec<String> {
        let seed = self.seed.map(|seed| format!("seed={seed}"));
        self.changes.iter().cloned().chain(seed).collect()
    }
}

/// How to fly with the vehicle in the loop.
#[derive(Clone, Debug, Args)]
pub struct PilArguments {
    /// Scenarios and results, as for `run`.
    #[command(flatten)]
    pub run: RunArguments,
    /// The emulator.
    #[arg(long, default_value = QEMU, value_name = "PATH")]
    pub qemu: PathBuf,
    /// The firmware's image, built for the emulator.
    #[arg(long, default_value = IMAGE, value_name = "ELF")]
    pub image: PathBuf,
    /// An instruction takes 2^N ns of virtual time: 3 is near the real processor, more is faster,
    /// for the emulator spends most of its time on the instructions between two ticks.
    #[arg(long, default_value_t = SHIFT, value_name = "N", value_parser = clap::value_parser!(u8).range(3..=5))]
    pub shift: u8,
    /// Hold every tick against the law on the host, bit for bit.
    #[arg(long, default_value_t = true, action = ArgAction::Set, value_name = "BOOL")]
    pub compare: bool,
    /// Keep the bytes of both directions; with several scenarios, those of the last.
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Fly nothing; feed a recording to the law on the host and to the image instead.
    #[arg(long, value_name = "FILE", conflicts_with = "record")]
    pub replay: Option<PathBuf>,
    /// Damage frames to the vehicle in flight, with any of these faults; the seed is the scenario's.
    /// Missed samples are flown with late ones, so the bits are then not SIL's.
    #[arg(long, value_name = "KIND", value_delimiter = ',')]
    pub fault: Vec<Fault>,
    /// Share of frames that `--fault` damages.
    #[arg(long, default_value_t = 0.05, value_name = "SHARE")]
    pub fault_rate: f64,
}
