//! `pil`.

use std::path::PathBuf;

use clap::{ArgAction, Args};

use super::RunArguments;
use crate::pil::emulator::{IMAGE, QEMU, SHIFT};
use crate::pil::fault::{Fault, FaultDirection};

/// Bits a second of the firmware's link.
const BAUD: u32 = 2_000_000;

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
    /// Fly on the vehicle at a serial port instead, in lock step, its rotors off.
    #[arg(long, value_name = "DEVICE", conflicts_with_all = ["image", "replay"])]
    pub port: Option<PathBuf>,
    /// Bits a second on the port.
    #[arg(long, default_value_t = BAUD, value_name = "RATE")]
    pub baud: u32,
    /// Begin each control tick when its sample has come, not by the emulated clock: rotors stay off,
    /// and any attitude may be started from.
    #[arg(long, conflicts_with = "replay")]
    pub lock_step: bool,
    /// Hold every tick against the law on the host, bit for bit.
    #[arg(long, default_value_t = true, action = ArgAction::Set, value_name = "BOOL")]
    pub compare: bool,
    /// Keep the bytes of both directions; with several scenarios, those of the last.
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Fly nothing; feed a recording to the law on the host and to the image instead.
    #[arg(long, value_name = "FILE", conflicts_with = "record")]
    pub replay: Option<PathBuf>,
    /// Damage frames in flight, with any of these faults; the seed is the scenario's. A missed sample
    /// is flown with a late one, so the bits are then not SIL's.
    #[arg(long, value_name = "KIND", value_delimiter = ',')]
    pub fault: Vec<Fault>,
    /// Which frames `--fault` damages.
    #[arg(long, value_enum, default_value_t, value_name = "DIRECTION")]
    pub fault_direction: FaultDirection,
    /// Share of frames that `--fault` damages.
    #[arg(long, default_value_t = 0.05, value_name = "SHARE")]
    pub fault_rate: f64,
}
