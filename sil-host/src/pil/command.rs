//! `pil`: flies scenarios on the vehicle and holds every tick against SIL.

use std::cell::RefCell;
use std::path::Path;

use ctrl_core::controller::TrackingController;
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::saturated::Saturated;

use super::PilError;
use super::comparison::Difference;
use super::cost::{CostUnit, StepCost};
use super::emulator::Emulator;
use super::fault::LinkFaults;
use super::on_vehicle::{InFlight, OnVehicle};
use super::recording::{Direction, Recording};
use super::replay::{Replayed, replay};
use super::session::Session;
use super::set_up::set_up;
use crate::cli::PilArguments;
use crate::progress::Progress;
use crate::report::{self, Outcome};
use crate::run::{self, RunError};
use sim::closed_loop::Observer;
use sim::scenario::{ControllerConfig, LoadedScenario, start};

/// Updates of the progress display in a flight.
const UPDATES: u64 = 100;

/// What a flight on the vehicle showed besides its guarantees.
#[derive(Clone, Copy, Debug)]
pub struct OnBoard {
    /// Control ticks flown.
    pub ticks: u64,
    /// Where the vehicle first differed from SIL.
    pub difference: Option<Difference>,
    /// What the control ticks cost.
    pub cost: StepCost,
    /// In which unit.
    pub cost_unit: CostUnit,
}

/// Flies every scenario on the vehicle and prints what came out; whether every guarantee held and,
/// if compared, every bit was SIL's.
///
/// # Errors
/// See [`PilError`].
pub fn pil(arguments: &PilArguments) -> Result<bool, PilError> {
    if let Some(file) = &arguments.replay {
        return replay_file(file, arguments);
    }
    let changes = arguments.run.changes();
    let names = arguments.run.scenarios();
    let scenarios = names.iter().map(|name| LoadedScenario::open(name, &changes));
    let scenarios = scenarios.collect::<Result<Vec<_>, _>>()?;
    let emulator = emulator(arguments);
    let (mut outcomes, mut same) = (Vec::new(), true);
    for scenario in &scenarios {
        let (outcome, on_board) = fly_watched(scenario, &emulator, arguments)?;
        if !arguments.run.json {
            print!("{}", report::table(&outcome, arguments.run.quiet));
        }
        same &= !arguments.compare || on_board.difference.is_none();
        print_on_board(&on_board, arguments);
        outcomes.push(outcome);
    }
    if arguments.run.json {
        println!("{}", report::json(&outcomes));
    }
    Ok(same && outcomes.iter().all(Outcome::passed))
}

fn emulator(arguments: &PilArguments) -> Emulator {
    let PilArguments { qemu, image, shift, .. } = arguments;
    Emulator { program: qemu.clone(), image: image.clone(), shift: *shift }
}

/// Feeds a recording to host and image and prints what came out; whether all was as recorded.
fn replay_file(file: &Path, arguments: &PilArguments) -> Result<bool, PilError> {
    let recording = Recording::load(file)
        .map_err(|error| PilError::Recording(file.to_owned(), error.to_string()))?;
    let replayed = replay(&recording, &emulator(arguments))?;
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
    if !arguments.run.quiet {
        eprintln!("  control tick [{cost_unit}]: {cost}");
    }
}

fn fly_watched(
    loaded: &LoadedScenario,
    emulator: &Emulator,
    arguments: &PilArguments,
) -> Result<(Outcome, OnBoard), PilError> {
    let blank = || Recording::new(&loaded.scenario().name, loaded.text());
    let recording = arguments.record.is_some().then(blank);
    let mut session = match &arguments.port {
        Some(port) => Session::attach(port, arguments.baud, emulator.cost_unit(), recording)?,
        None => Session::boot_recorded(emulator, &[], recording)?.0,
    };
    if arguments.lock_step || arguments.port.is_some() {
        session.enter_lock_step()?;
    }
    set_up(&mut session, loaded.scenario())?;
    inject(&mut session, loaded.scenario().seed, arguments);
    let flown = run::watched(loaded, &arguments.run, |watch, progress| {
        fly(loaded, &mut session, watch, Some(progress))
    });
    if let (Some(file), Some(recording)) = (&arguments.record, session.take_recording()) {
        // A flight that failed is worth replaying, too.
        recording.save(file).map_err(|error| RunError::Output(file.clone(), error.to_string()))?;
    }
    if arguments.port.is_some() {
        for direction in Direction::BOTH {
            session.inject(direction, None);
        }
        session.leave_lock_step()?;
    }
    flown
}

/// Damages frames as the arguments say.
fn inject(session: &mut Session, seed: u64, arguments: &PilArguments) {
    if arguments.fault.is_empty() {
        return;
    }
    for direction in arguments.fault_direction.directions() {
        // Another schedule for each direction.
        let seed = seed ^ (*direction as u64) << 32;
        let faults = LinkFaults::new(seed, &arguments.fault, arguments.fault_rate);
        session.inject(*direction, Some(faults));
    }
}

/// Flies a scenario on a vehicle that is [set up](set_up) for it, to its end.
///
/// # Errors
/// When the vehicle leaves flight or goes silent.
pub fn fly<O: Observer>(
    loaded: &LoadedScenario,
    session: &mut Session,
    observer: &mut O,
    progress: Option<&Progress>,
) -> Result<OnBoard, PilError> {
    let refusal = |error| loaded.refusal(&error);
    match &loaded.scenario().controller {
        ControllerConfig::RobustAdaptive(config) => {
            let law = RobustAdaptive::new(config).map_err(refusal)?;
            fly_law(law, loaded, session, observer, progress)
        }
        ControllerConfig::Saturated(config) => {
            let law = Saturated::new(config).map_err(refusal)?;
            fly_law(law, loaded, session, observer, progress)
        }
    }
}

fn fly_law<C: TrackingController, O: Observer>(
    law: C,
    loaded: &LoadedScenario,
    session: &mut Session,
    observer: &mut O,
    progress: Option<&Progress>,
) -> Result<OnBoard, PilError> {
    let cost_unit = session.cost_unit();
    let in_flight = RefCell::new(InFlight::new(session));
    let vehicle = OnVehicle { law, flight: &in_flight };
    let scenario = loaded.scenario();
    let mut flight = start(vehicle, scenario).map_err(|error| loaded.refusal(&error))?;
    let ticks = scenario.ticks();
    let chunk = ticks.div_ceil(UPDATES).max(1);
    for tick in 0..ticks {
        flight.advance(1, observer);
        if let Some(failure) = in_flight.borrow_mut().failure.take() {
            return Err(failure);
        }
        if let Some(progress) = progress.filter(|_| tick % chunk == 0) {
            progress.advance(chunk);
        }
    }
    let InFlight { ticks, difference, cost, .. } = *in_flight.borrow();
    Ok(OnBoard { ticks, difference, cost, cost_unit })
}
