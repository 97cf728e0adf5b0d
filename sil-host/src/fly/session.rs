//! A session of flights: ticks at their pace, ports between them, results when a flight ends.

use std::net::SocketAddr;
use std::num::NonZeroU32;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use ctrl_core::mode::navigation::{NavigationEvent, Navigator, Request};
use ctrl_core::mode::{Command, Mode, Refusal};
use firmware::pilot::PilotedVehicle;
use firmware::session::SessionMemory;
use mavlink_vehicle::{
    LogEntry, ParameterRefusal, Part, Protocol, ProtocolConfig, ProtocolMemory, Severity, Vehicle,
    View,
};
use sim::scenario::LoadedScenario;

use super::error::FlyError;
use super::pace::Pace;
use super::ports::{PortOptions, Ports};
use super::record::{FlightLogs, FlownReport};
use super::signing;
use super::vehicle::{FlownTick, FlownVehicle};
use crate::log::LogOptions;
use crate::log::description::Description;

/// Frames between two turns of the ticks.
const FRAMES_MAX: usize = 256;
/// Longest sleep: the ports are looked at so often at least.
const SLEEP_MAX: Duration = Duration::from_millis(2);
/// Time that a landing at the end may take (s of flight).
const LANDING_MAX: f64 = 300.0;

/// Options of a session.
#[derive(Clone, Debug)]
pub struct FlyOptions {
    /// Addresses of the ports.
    pub ports: PortOptions,
    /// Settings of the protocol.
    pub protocol: ProtocolConfig,
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

/// Something that the user may want to see.
#[derive(Debug)]
pub enum FlyEvent<'a> {
    /// The ports are open; the address for TCP.
    Listening(Option<SocketAddr>),
    /// A flight has ended.
    Flown(&'a FlownReport),
    /// The vehicle lands before the session ends.
    Landing,
    /// Ticks given up because the computer was too slow.
    Late(u64),
}

/// Flies the vehicle of a scenario until `interrupts` counts one: a vehicle in the air is landed first, unless a
/// second one comes. Returns the reports of all flights.
///
/// # Errors
/// See [`FlyError`].
pub fn fly(
    loaded: &LoadedScenario,
    options: &FlyOptions,
    interrupts: &AtomicUsize,
    show: &mut dyn FnMut(FlyEvent),
) -> Result<Vec<FlownReport>, FlyError> {
    let scenario = loaded.scenario();
    let directory = options.out.join(&scenario.name);
    let unwritable = |error| FlyError::Output(directory.clone(), error);
    let mut memory = SessionMemory::new();
    let mut vehicle = FlownVehicle::new(scenario, &mut memory)?;
    let description = Description::new(loaded)?;
    let every = u64::from(options.trace_every.get());
    let logs = FlightLogs::new(scenario, description, &directory, &options.log, every);
    let mut logs = logs.map_err(unwritable)?;
    let mut ports = Ports::open(&options.ports).map_err(FlyError::Port)?;
    show(FlyEvent::Listening(ports.tcp_address()));
    let mut protocol_memory = ProtocolMemory::new();
    let mut protocol = Protocol::new(&options.protocol, &mut protocol_memory);
    let mut pace = Pace::new(Instant::now(), options.speed, vehicle.step_period());
    let mut ending = Ending::default();
    loop {
        for _ in 0..pace.due(Instant::now()) {
            let FlownTick { tick, outputs, navigation } = vehicle.tick();
            if let Some(changed) = vehicle.take_changed() {
                logs.follow(&changed)?;
            }
            if let Some(report) =
                logs.observe(&tick, outputs.mode, navigation).map_err(unwritable)?
            {
                show(FlyEvent::Flown(report));
            }
        }
        if vehicle.differs() {
            return Err(FlyError::Differs);
        }
        exchange(&mut protocol, &mut ports, &mut vehicle, &logs);
        let asked = interrupts.load(Ordering::Relaxed);
        let over = options.duration.is_some_and(|duration| vehicle.time() >= duration);
        if ending.reached(asked + usize::from(over), &mut vehicle, &mut protocol, show) {
            break;
        }
        let wait = pace.wait(Instant::now()).min(SLEEP_MAX);
        if !wait.is_zero() {
            std::thread::sleep(wait);
        }
    }
    if let Some(report) = logs.end().map_err(unwritable)? {
        show(FlyEvent::Flown(report));
    }
    if pace.skipped() > 0 {
        show(FlyEvent::Late(pace.skipped()));
    }
    Ok(logs.reports().to_vec())
}

/// Everything that has come is handled, and what is due is sent.
fn exchange(
    protocol: &mut Protocol<'_>,
    ports: &mut Ports,
    vehicle: &mut FlownVehicle<'_>,
    logs: &FlightLogs,
) {
    let mut logged = WithLogs { vehicle: vehicle.piloted(), logs };
    protocol.follow_clock(signing::now());
    ports.receive(|packet, line| protocol.handle(packet, line, &mut logged));
    for _ in 0..FRAMES_MAX {
        let Some(frame) = protocol.next_frame(&mut logged) else { break };
        ports.send(frame.as_bytes());
    }
    ports.flush();
}

/// The way to the end of a session.
#[derive(Debug, Default)]
struct Ending {
    landing_since: Option<f64>,
}

impl Ending {
    /// `true` when the session is over; a vehicle in the air is landed at the first request.
    fn reached(
        &mut self,
        requests: usize,
        vehicle: &mut FlownVehicle<'_>,
        protocol: &mut Protocol<'_>,
        show: &mut dyn FnMut(FlyEvent),
    ) -> bool {
        let in_air = matches!(vehicle.mode(), Mode::Flying | Mode::Failsafe);
        match (requests, self.landing_since) {
            (0, _) => false,
            (1, None) if in_air => {
                self.landing_since = Some(vehicle.time());
                let mode = vehicle.mode();
                // Refused in the failsafe only, which descends by itself.
                let _ = vehicle.pilot().request(mode, Request::Land(None));
                protocol.say(Severity::Critical, &[Part::Text("the session ends: landing")]);
                show(FlyEvent::Landing);
                false
            }
            (1, Some(since)) if in_air => vehicle.time() - since > LANDING_MAX,
            _ => true,
        }
    }
}

/// The vehicle with the logs of its flights.
struct WithLogs<'a, 'p, 's, 'm> {
    vehicle: PilotedVehicle<'p, 's, 'm>,
    logs: &'a FlightLogs,
}

impl Vehicle for WithLogs<'_, '_, '_, '_> {
    fn view(&self) -> View {
        self.vehicle.view()
    }

    fn navigator(&mut self) -> &mut Navigator {
        self.vehicle.navigator()
    }

    fn command(&mut self, command: Command) -> Result<(), Refusal> {
        self.vehicle.command(command)
    }

    fn hear(&mut self) {
        self.vehicle.hear();
    }

    fn take_answer(&mut self) -> Option<Result<Mode, Refusal>> {
        self.vehicle.take_answer()
    }

    fn take_event(&mut self) -> Option<NavigationEvent> {
        self.vehicle.take_event()
    }

    fn parameter_count(&self) -> u16 {
        self.vehicle.parameter_count()
    }

    fn parameter_at(&self, index: u16) -> Option<(&'static str, f32)> {
        self.vehicle.parameter_at(index)
    }

    fn write_parameter(&mut self, name: &str, value: f32) -> Result<(), ParameterRefusal> {
        self.vehicle.write_parameter(name, value)
    }

    fn log_count(&self) -> u16 {
        u16::try_from(self.logs.entries().count()).unwrap_or(u16::MAX)
    }

    fn log(&self, index: u16) -> Option<LogEntry> {
        self.logs.entries().nth(index.into())
    }

    fn read_log(&mut self, index: u16, offset: u32, out: &mut [u8]) -> usize {
        self.logs.read(index, offset, out)
    }
}
