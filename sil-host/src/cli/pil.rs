//! `pil`.

use std::path::{Path, PathBuf};

use clap::{ArgAction, Args};
use indicatif::MultiProgress;
use rayon::prelude::*;
use sil_host::pil::PilError;
use sil_host::pil::emulator::{Emulator, IMAGE, QEMU, SHIFT};
use sil_host::pil::fault::{Fault, FaultDirection};
use sil_host::pil::flight::{FaultOptions, OnBoard, PilOptions, fly_recorded};
use sil_host::pil::recording::Recording;
use sil_host::pil::replay::{Replayed, replay};
use sil_host::report::{self, FlightReport};
use sim::scenario::LoadedScenario;

use super::RunArguments;
use super::flight_progress::FlightProgressBar;

/// Bits per second of the firmware's link.
const BAUD: u32 = 2_000_000;
/// Ticks ahead: their packets fit the emulated vehicle's buffers.
const AHEAD: u8 = 32;

/// Arguments of `pil`.
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
    /// Bits per second on the port.
    #[arg(long, default_value_t = BAUD, value_name = "RATE")]
    pub baud: u32,
    /// Begin each control tick when its sample has come, not by the emulated clock: rotors stay off,
    /// and any attitude may be started from.
    #[arg(long, conflicts_with = "replay")]
    pub lock_step: bool,
    /// Let virtual time pass by counted instructions. Without, it is the machine's: in lock step alone, a third faster,
    /// and the cost of a control tick is not known.
    #[arg(long, default_value_t = true, action = ArgAction::Set, value_name = "BOOL",
          requires_if("false", "lock_step"))]
    pub count: bool,
    /// Compare every tick with the law on the host, bit for bit.
    #[arg(long, default_value_t = true, action = ArgAction::Set, value_name = "BOOL")]
    pub compare: bool,
    /// Ticks that the host flies ahead at once by the law's own output, in the emulator: the vehicle's answers are
    /// compared afterwards, and a flight with a difference is flown again tick by tick. 1 flies tick by tick, as
    /// `--compare false`, `--record`, `--fault` and `--port` do.
    #[arg(long, default_value_t = AHEAD, value_name = "TICKS", value_parser = clap::value_parser!(u8).range(1..=32))]
    pub ahead: u8,
    /// Keep the bytes of both directions; with several scenarios, those of the last.
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Fly nothing; feed a recording to the law on the host and to the image instead.
    #[arg(long, value_name = "FILE", conflicts_with = "record")]
    pub replay: Option<PathBuf>,
    /// Damage frames in flight, with any of these faults; the seed is the scenario's. A missed sample
    /// is flown with a late one, so the bits are then not SIL's.
    /// Kinds: lost, duplicated, reordered, truncated, flipped, delayed, garbage.
    #[arg(long, value_name = "KIND", value_delimiter = ',')]
    pub fault: Vec<Fault>,
    /// Damaged direction: up (to the vehicle), down or both.
    #[arg(long, default_value = "up", value_name = "DIRECTION")]
    pub fault_direction: FaultDirection,
    /// Share of frames that `--fault` damages.
    #[arg(long, default_value_t = 0.05, value_name = "SHARE")]
    pub fault_rate: f64,
}

impl PilArguments {
    fn emulator(&self) -> Emulator {
        let Self { qemu, image, shift, count, .. } = self;
        Emulator { program: qemu.clone(), image: image.clone(), shift: *shift, counted: *count }
    }

    fn options(&self) -> PilOptions {
        PilOptions {
            flight: self.run.options(),
            emulator: self.emulator(),
            port: self.port.clone().map(|port| (port, self.baud)),
            lock_step: self.lock_step,
            record: self.record.clone(),
            ahead: if self.compare { self.ahead.into() } else { 1 },
            faults: FaultOptions {
                kinds: self.fault.clone(),
                direction: self.fault_direction,
                rate: self.fault_rate,
            },
        }
    }
}

/// Flies every scenario on the vehicle and prints the tables; `true` if every guarantee held and, if
/// compared, every bit was SIL's.
///
/// # Errors
/// See [`PilError`].
pub fn pil(arguments: &PilArguments) -> Result<bool, PilError> {
    if let Some(file) = &arguments.replay {
        return replay_file(file, arguments);
    }
    let scenarios = arguments.run.scenarios()?;
    let (options, bars) = (arguments.options(), MultiProgress::new());
    let fly = |loaded: &LoadedScenario| {
        let progress = FlightProgressBar::new(loaded.scenario(), arguments.run.quiet).among(&bars);
        let flown = fly_recorded(loaded, &options, &|ticks| progress.advance(ticks))?;
        progress.finish();
        Ok::<_, PilError>(flown)
    };
    // There is one serial port, and one file for the recording.
    let one_by_one = options.port.is_some() || options.record.is_some();
    let flown: Vec<_> = if one_by_one {
        scenarios.iter().map(fly).collect()
    } else {
        scenarios.par_iter().map(fly).collect()
    };
    let (mut reports, mut same) = (Vec::new(), true);
    for flown in flown {
        let (report, on_board) = flown?;
        if !arguments.run.json {
            print!("{}", report::table(&report, arguments.run.quiet));
        }
        same &= !arguments.compare || on_board.difference.is_none();
        print_on_board(&on_board, arguments);
        reports.push(report);
    }
    if arguments.run.json {
        println!("{}", report::json(&reports));
    }
    Ok(same && reports.iter().all(FlightReport::passed))
}

/// Feeds a recording to host and image and prints the result; `true` if both did as recorded.
fn replay_file(file: &Path, arguments: &PilArguments) -> Result<bool, PilError> {
    let recording = Recording::load(file)
        .map_err(|error| PilError::Recording(file.to_owned(), error.to_string()))?;
    let replayed = replay(&recording, &arguments.emulator())?;
    let Replayed { host_ticks, host_difference, packets, image_difference } = replayed;
    match host_difference {
        Some(difference) => println!("host: not as recorded: {difference}"),
        None => println!("host: {host_ticks} ticks of flight as recorded, every bit"),
    }
    match image_difference {
        Some(packet) => println!("image: another answer in packet {packet}"),
        None => println!("image: {packets} packets answered as recorded"),
    }
    Ok(replayed.same())
}

fn print_on_board(on_board: &OnBoard, arguments: &PilArguments) {
    let OnBoard { ticks, difference, cost, cost_unit } = on_board;
    match difference.filter(|_| arguments.compare) {
        Some(difference) => eprintln!("  not as in SIL: {difference}"),
        None if arguments.compare && !arguments.run.quiet => {
            eprintln!("  every bit as in SIL, {ticks} ticks");
        }
        None => {}
    }
    if !arguments.run.quiet && (arguments.count || arguments.port.is_some()) {
        eprintln!("  control tick [{cost_unit}]: {cost}");
    }
}
