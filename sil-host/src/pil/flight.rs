//! Flights of scenarios on the vehicle, every tick compared with SIL.

use std::cell::RefCell;
use std::path::PathBuf;

use sim::observer::Observer;
use sim::scenario::{LoadedScenario, flight_with};

use super::PilError;
use super::comparison::Difference;
use super::cost::{CostUnit, StepCost};
use super::emulator::Emulator;
use super::fault::{Fault, FaultDirection, LinkFaults};
use super::on_vehicle::{InFlight, OnVehicle};
use super::recording::{Direction, Recording};
use super::session::VehicleSession;
use super::set_up::set_up;
use crate::report::FlightReport;
use crate::run::{self, FlightOptions, RunError};

/// Calls of the progress callback per flight.
const UPDATES: u64 = 100;

/// Measurements of a flight on the vehicle, besides its guarantees.
#[derive(Clone, Copy, Debug)]
pub struct OnBoard {
    /// Control ticks flown.
    pub ticks: u64,
    /// First difference of the vehicle from SIL.
    pub difference: Option<Difference>,
    /// Cost of the control ticks.
    pub cost: StepCost,
    /// In which unit.
    pub cost_unit: CostUnit,
}

/// Options of flights with the vehicle in the loop.
#[derive(Clone, Debug)]
pub struct PilOptions {
    /// Options for the results.
    pub flight: FlightOptions,
    /// The emulator and its image.
    pub emulator: Emulator,
    /// Serial port of a board, and its rate (bit/s), in place of the emulator.
    pub port: Option<(PathBuf, u32)>,
    /// Ticks begin by lock-step requests instead of the emulated clock. Always so at a serial port.
    pub lock_step: bool,
    /// File that keeps the bytes of both directions.
    pub record: Option<PathBuf>,
    /// Damage of the frames.
    pub faults: FaultOptions,
    /// Ticks that the host may fly ahead of the emulator at once, by the law's own output; 1: none. A flight that is
    /// recorded or damaged, or on a board, is flown tick by tick all the same.
    pub ahead: usize,
}

impl PilOptions {
    /// Ticks that the host flies ahead at once.
    fn batch(&self) -> usize {
        let by_tick = self.port.is_some() || self.record.is_some() || !self.faults.kinds.is_empty();
        if by_tick { 1 } else { self.ahead }
    }
}

/// Damage of the frames between host and vehicle; the seed is the scenario's.
#[derive(Clone, Debug, Default)]
pub struct FaultOptions {
    /// Kinds of damage; none: undamaged.
    pub kinds: Vec<Fault>,
    /// Damaged direction.
    pub direction: FaultDirection,
    /// Share of damaged frames, 0 to 1.
    pub rate: f64,
}

/// Flies a scenario on the vehicle and writes its results; `progress` receives the number of ticks
/// flown since its last call.
///
/// # Errors
/// See [`PilError`].
pub fn fly_recorded(
    loaded: &LoadedScenario,
    options: &PilOptions,
    progress: &dyn Fn(u64),
) -> Result<(FlightReport, OnBoard), PilError> {
    let batch = options.batch();
    let flown = fly_batches(loaded, options, batch, progress)?;
    if batch > 1 && flown.1.difference.is_some() {
        // Ahead, the plant went on by the law's output: what was seen since then is not the vehicle's flight.
        return fly_batches(loaded, options, 1, &|_| ());
    }
    Ok(flown)
}

fn fly_batches(
    loaded: &LoadedScenario,
    options: &PilOptions,
    batch: usize,
    progress: &dyn Fn(u64),
) -> Result<(FlightReport, OnBoard), PilError> {
    let emulator = &options.emulator;
    let blank = || Recording::new(&loaded.scenario().name, loaded.text());
    let recording = options.record.is_some().then(blank);
    let mut session = match &options.port {
        Some((port, baud)) => VehicleSession::attach(port, *baud, emulator.cost_unit(), recording)?,
        None => VehicleSession::boot_recorded(emulator, &[], recording)?.0,
    };
    if options.lock_step || options.port.is_some() {
        session.enter_lock_step()?;
    }
    set_up(&mut session, loaded.scenario())?;
    inject(&mut session, loaded.scenario().seed, &options.faults);
    let flown = run::recorded(loaded, &options.flight, |recorder| {
        fly_ahead(loaded, &mut session, batch, recorder, progress)
    });
    if let (Some(file), Some(recording)) = (&options.record, session.take_recording()) {
        // A flight that failed is worth replaying, too.
        recording.save(file).map_err(|error| RunError::Output(file.clone(), error.to_string()))?;
    }
    if options.port.is_some() {
        for direction in Direction::BOTH {
            session.inject(direction, None);
        }
        session.leave_lock_step()?;
    }
    flown
}

/// Damages frames as the options say.
fn inject(session: &mut VehicleSession, seed: u64, faults: &FaultOptions) {
    if faults.kinds.is_empty() {
        return;
    }
    for direction in faults.direction.directions() {
        // Another schedule for each direction.
        let seed = seed ^ (*direction as u64) << 32;
        let faults = LinkFaults::new(seed, &faults.kinds, faults.rate);
        session.inject(*direction, Some(faults));
    }
}

/// Flies a scenario on a vehicle that is [set up](set_up) for it, to its end, tick by tick.
///
/// # Errors
/// When the vehicle leaves flight or goes silent.
pub fn fly<O: Observer>(
    loaded: &LoadedScenario,
    session: &mut VehicleSession,
    observer: &mut O,
    progress: &dyn Fn(u64),
) -> Result<OnBoard, PilError> {
    fly_ahead(loaded, session, 1, observer, progress)
}

/// As [`fly`], with `batch` ticks sent at once; more than one for a vehicle in the emulator only. After a
/// [difference](OnBoard::difference) what is observed is the law's flight, not the vehicle's.
///
/// # Errors
/// As [`fly`].
pub fn fly_ahead<O: Observer>(
    loaded: &LoadedScenario,
    session: &mut VehicleSession,
    batch: usize,
    observer: &mut O,
    progress: &dyn Fn(u64),
) -> Result<OnBoard, PilError> {
    let scenario = loaded.scenario();
    let refusal = |error| loaded.refusal(&error);
    let law = scenario.controller.build().map_err(refusal)?;
    let cost_unit = session.cost_unit();
    let (sender, samples) = std::sync::mpsc::channel();
    let mut in_flight = InFlight::new(session);
    if scenario.sensors.is_some() {
        in_flight = in_flight.by_sensors(samples);
    }
    if batch > 1 {
        in_flight = in_flight.ahead(batch);
    }
    let in_flight = RefCell::new(in_flight);
    let vehicle = OnVehicle { law, flight: &in_flight };
    let mut flight =
        flight_with(vehicle, scenario).map_err(refusal)?.with_evaluator(scenario.evaluator());
    flight.send_samples(sender);
    let ticks = scenario.ticks();
    let chunk = ticks.div_ceil(UPDATES).max(1);
    for tick in 0..ticks {
        flight.observe(1, observer);
        if let Some(failure) = in_flight.borrow_mut().failure.take() {
            return Err(failure);
        }
        if tick % chunk == 0 {
            progress(chunk);
        }
    }
    in_flight.borrow_mut().finish()?;
    let InFlight { ticks, difference, cost, .. } = *in_flight.borrow();
    Ok(OnBoard { ticks, difference, cost, cost_unit })
}
