//! The firmware's image under ground stations: QEMU runs it in lock step with the plant here, and [`Ports`] carry its
//! MAVLink port to the stations.
//!
//! Every tick of a flight is recorded as `run` records it, and compared with the law on the host, bit for bit.

use std::num::NonZeroU32;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use ctrl_core::mode::Mode;
use ctrl_core::mode::navigation::NavigationMode;
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::VehicleState;
use link::{Downlink, Guidance, Secret, Telemetry, Uplink};
use mavlink_vehicle::SigningKey;
use sim::scenario::LoadedScenario;
use sim::tick::Tick;

use super::error::FlyError;
use super::image_law::LawAboard;
use super::image_line::ImageDoor;
use super::observed_law::ObservedLaw;
use super::plant::FlownPlant;
use super::ports::{PortOptions, Ports};
use super::record::{FlightLogs, FlownReport};
use super::session::FlyEvent;
use super::signing;
use crate::log::LogOptions;
use crate::log::description::Description;
use crate::pil::PilError;
use crate::pil::comparison::{Difference, Step, first_difference, lasting};
use crate::pil::emulator::Emulator;
use crate::pil::session::VehicleSession;
use crate::pil::set_up::stand;

/// Ticks between two looks at the clock and at the stations.
const TICKS_PER_LOOK: u32 = 5;

/// Options of a session with the image.
#[derive(Clone, Debug)]
pub struct ImageOptions {
    /// The emulator and its image.
    pub emulator: Emulator,
    /// Addresses of the ports.
    pub ports: PortOptions,
    /// File that stands for the chip's memory of parameters and key; without one the image keeps nothing.
    pub memory: Option<PathBuf>,
    /// Key of signatures that the image is given before it flies, and keeps.
    pub signing_key: Option<SigningKey>,
    /// Speed over real time.
    pub speed: f64,
    /// End of the session (s of flight); none: when it is asked to stop.
    pub duration: Option<f64>,
    /// Directory of results; the session gets one below it, named after the scenario.
    pub out: PathBuf,
    /// Logs of the flights.
    pub log: LogOptions,
    /// Ticks per row of the trace.
    pub trace_every: NonZeroU32,
}

/// What a session with the image came to.
#[derive(Clone, Debug)]
pub struct ImageReport {
    /// Reports of the flights.
    pub flights: Vec<FlownReport>,
    /// Control ticks.
    pub ticks: u64,
    /// Ticks of flight that were compared with the law on the host, bit for bit.
    pub compared: u64,
    /// The first difference from it.
    pub difference: Option<Difference>,
    /// Largest height (m).
    pub height_max: f64,
    /// Seconds by which the emulator fell behind the clock.
    pub late: f64,
    /// Control ticks of flights whose telemetry did not come.
    pub skipped: u64,
}

impl ImageReport {
    /// `true` if every guarantee held and no bit differed.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.flights.iter().all(FlownReport::passed) && self.difference.is_none()
    }
}

/// The plant before the image, and the law beside it.
struct Bench {
    plant: FlownPlant,
    /// The state of this tick, as the image receives it.
    measured: VehicleState,
    observed: ObservedLaw,
    aboard: LawAboard,
    /// What the law aboard follows at the latest tick.
    guidance: Guidance,
    period: f64,
    flying: bool,
    /// Tick of flight of the latest telemetry.
    flight_tick: u64,
    /// The law on the host has had every tick of this flight.
    in_step: bool,
    report: ImageReport,
}

impl Bench {
    fn new(loaded: &LoadedScenario) -> Result<Self, FlyError> {
        let scenario = loaded.scenario();
        let mut plant = FlownPlant::new(scenario)?;
        let reference = Reference::hover(plant.truth().measured().position_world);
        Ok(Self {
            measured: plant.measure(),
            plant,
            observed: ObservedLaw::new(scenario)?,
            aboard: LawAboard::new(&scenario.controller),
            guidance: Guidance { law_changes: 0, navigation: NavigationMode::Hold, reference },
            period: scenario.controller.step_period().into(),
            flying: false,
            flight_tick: 0,
            in_step: false,
            report: ImageReport {
                flights: Vec::new(),
                ticks: 0,
                compared: 0,
                difference: None,
                height_max: 0.0,
                late: 0.0,
                skipped: 0,
            },
        })
    }

    /// The messages of a tick: its state, and questions. The state comes first: after it one other message is handled in
    /// time for the tick.
    fn messages(&self) -> Vec<Uplink> {
        let state = Uplink::State { tick: self.report.ticks, state: self.measured };
        let asked = [state, Uplink::GuidanceRead];
        asked.into_iter().chain(self.aboard.question()).collect()
    }

    /// The control periods since the latest telemetry: one, unless the image was too busy to send.
    fn advance(&mut self, received: &[Downlink], logs: &mut FlightLogs) -> Result<(), FlyError> {
        for message in received {
            if let Downlink::Guidance(guidance) = message {
                self.guidance = *guidance;
            }
            if let Some(config) = self.aboard.take(message) {
                self.observed.follow(&config)?;
                logs.follow(&config)?;
            }
        }
        let telemetry = telemetry(received)?;
        let told = Step::told(&telemetry, lasting(received, telemetry.tick));
        let since = telemetry.tick.saturating_sub(self.flight_tick);
        let periods = if self.flying && telemetry.tick > 1 { since.clamp(1, 1000) } else { 1 };
        let flying = matches!(telemetry.mode, Mode::Flying | Mode::Failsafe);
        if !flying || !self.flying {
            self.in_step = self.aboard.is_known();
        }
        self.in_step &= periods == 1;
        (self.flying, self.flight_tick) = (flying, telemetry.tick);
        self.report.skipped += periods - 1;
        for _ in 0..periods {
            let tick = self.period(telemetry.mode, &told);
            let failed = logs.observe(&tick, telemetry.mode, self.guidance.navigation).err();
            if let Some(error) = failed {
                return Err(logs.unwritable(error));
            }
        }
        self.measured = self.plant.measure();
        Ok(())
    }

    /// One control period under the image's wrench, which is `told` in `mode`.
    fn period(&mut self, mode: Mode, told: &Step) -> Tick {
        let acting = self.plant.command(&told.output.wrench);
        let law = (self.guidance.reference, told.output);
        let seen = self.plant.seen(self.report.ticks, self.period, law, acting);
        let mut tick = Tick { law: self.in_step, ..seen };
        if self.in_step {
            self.compare(&mut tick, mode, told);
        } else {
            tick.evaluation.position_error = tick.position_error();
        }
        self.plant.advance(&tick.disturbance);
        self.report.ticks += 1;
        self.report.height_max = self.report.height_max.max(self.plant.truth().position_world.z);
        tick
    }

    /// Steps the law on the host, and compares.
    fn compare(&mut self, tick: &mut Tick, mode: Mode, told: &Step) {
        let Some(expected) = self.observed.observe(tick, mode, &self.measured) else {
            return;
        };
        self.report.compared += 1;
        if self.report.difference.is_none() {
            self.report.difference = first_difference(tick.tick, told, &expected);
        }
    }
}

/// Flies the image with the vehicle of a scenario until `interrupts` counts one or the time is over.
///
/// # Errors
/// When a port or the emulator cannot be started, results cannot be written, or the image falls silent.
pub fn fly_image(
    loaded: &LoadedScenario,
    options: &ImageOptions,
    interrupts: &AtomicUsize,
    show: &mut dyn FnMut(FlyEvent),
) -> Result<ImageReport, FlyError> {
    let mut bench = Bench::new(loaded)?;
    let directory = options.out.join(&loaded.scenario().name);
    let description = Description::new(loaded)?;
    let every = options.trace_every.get().into();
    let logs = FlightLogs::new(loaded.scenario(), description, &directory, &options.log, every);
    let mut logs = logs.map_err(|error| FlyError::Output(directory.clone(), error))?;
    let mut ports = Ports::open(&options.ports).map_err(FlyError::Port)?;
    let door = ImageDoor::open().map_err(FlyError::Port)?;
    let device = door.device().map_err(FlyError::Port)?;
    let memory = options.memory.iter().map(|file| format!("parameters={}", file.display()));
    let directives: Vec<_> = memory.collect();
    let mut session = VehicleSession::boot_with_mavlink(&options.emulator, &directives, &device)?;
    let mut line = door.accept().map_err(FlyError::Port)?;
    stand(&mut session, loaded.scenario())?;
    if let Some(key) = options.signing_key {
        let state = bench.measured;
        let message = Uplink::SigningKey { key: Secret(key.to_bytes()), timestamp: signing::now() };
        session.expect_ok("the signing key", message, state)?;
    }
    show(FlyEvent::Listening(ports.tcp_address()));
    let mut start = Instant::now();
    let (mut paced, mut shown) = (0_u64, 0);
    while interrupts.load(Ordering::Relaxed) == 0 {
        let time = bench.report.ticks as f64 * bench.period;
        if options.duration.is_some_and(|duration| time >= duration) {
            break;
        }
        for _ in 0..TICKS_PER_LOOK {
            let received = session.send(&bench.messages())?;
            bench.advance(&received, &mut logs)?;
            paced += 1;
        }
        line.exchange(&mut ports).map_err(FlyError::Port)?;
        for report in logs.reports().iter().skip(shown) {
            show(FlyEvent::Flown(report));
            shown += 1;
        }
        let due = start + Duration::from_secs_f64(paced as f64 * bench.period / options.speed);
        let now = Instant::now();
        match due.checked_duration_since(now) {
            Some(wait) => std::thread::sleep(wait),
            None => {
                // What the emulator is late by is given up.
                bench.report.late += (now - due).as_secs_f64();
                (start, paced) = (now, 0);
            }
        }
    }
    let last = logs.end().map_err(|error| FlyError::Output(directory, error))?;
    if let Some(report) = last {
        show(FlyEvent::Flown(report));
    }
    Ok(ImageReport { flights: logs.reports().to_vec(), ..bench.report })
}

/// The telemetry of a tick; what else the image sends is for other hosts.
fn telemetry(received: &[Downlink]) -> Result<Telemetry, PilError> {
    let telemetry = received.iter().find_map(|message| match message {
        Downlink::Telemetry(telemetry) => Some(*telemetry),
        _ => None,
    });
    let silent = || PilError::Answer("telemetry in a tick".to_owned(), format!("{received:?}"));
    telemetry.ok_or_else(silent)
}
