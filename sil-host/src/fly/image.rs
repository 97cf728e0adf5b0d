//! The firmware's image under ground stations: QEMU runs it in lock step with the plant here, and its MAVLink port
//! is a TCP port of the emulator.

use std::net::{SocketAddr, TcpListener};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use ctrl_core::controller::AdaptiveController;
use ctrl_core::mode::Mode;
use ctrl_core::vehicle::{Wrench, WrenchBounds};
use link::{Downlink, Telemetry, Uplink};
use sim::plant::PlantState;
use sim::plant::disturbance::{DisturbanceProcess, DisturbanceSource};
use sim::plant::ground::GroundedVehicle;
use sim::plant::vehicle::Plant;
use sim::scenario::{LoadedScenario, Scenario};

use super::error::FlyError;
use crate::pil::PilError;
use crate::pil::emulator::Emulator;
use crate::pil::session::VehicleSession;
use crate::pil::set_up::stand;

/// Ticks between two looks at the clock.
const TICKS_PER_LOOK: u32 = 5;

/// Options of a session with the image.
#[derive(Clone, Debug)]
pub struct ImageOptions {
    /// The emulator and its image.
    pub emulator: Emulator,
    /// Address at which one ground station may connect.
    pub tcp: SocketAddr,
    /// Speed over real time.
    pub speed: f64,
    /// End of the session (s of flight); none: when it is asked to stop.
    pub duration: Option<f64>,
}

/// What a session with the image came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageReport {
    /// Control ticks.
    pub ticks: u64,
    /// Flights, each from the start of the rotors to their stop.
    pub flights: u32,
    /// Smallest and largest thrust while the law ran (N).
    pub thrust: (f32, f32),
    /// Largest torque component while the law ran (N m).
    pub torque_max: f32,
    /// `true` if every wrench was inside the law's bounds.
    pub bounded: bool,
    /// Largest height (m).
    pub height_max: f64,
    /// Seconds by which the emulator fell behind the clock.
    pub late: f64,
    /// Control ticks of flights whose telemetry did not come.
    pub skipped: u64,
}

/// The plant before the image.
struct Bench {
    plant: GroundedVehicle,
    disturbance: DisturbanceProcess,
    bounds: WrenchBounds,
    report: ImageReport,
    flying: bool,
    /// Tick of flight of the latest telemetry.
    flight_tick: u64,
}

impl Bench {
    fn new(scenario: &Scenario) -> Result<Self, FlyError> {
        let law = scenario.controller.build()?;
        let period = f64::from(scenario.controller.step_period());
        let start = scenario.initial.state();
        let standing = PlantState { position_world: start.position_world.with_z(0.0), ..start };
        let report = ImageReport {
            ticks: 0,
            flights: 0,
            thrust: (f32::INFINITY, f32::NEG_INFINITY),
            torque_max: 0.0,
            bounded: true,
            height_max: 0.0,
            late: 0.0,
            skipped: 0,
        };
        Ok(Self {
            plant: GroundedVehicle::new(scenario.vehicle(standing, period)?, 0.0),
            disturbance: DisturbanceProcess::new(&scenario.disturbance, scenario.seed, period),
            bounds: law.bounds(),
            report,
            flying: false,
            flight_tick: 0,
        })
    }

    /// The message with the state now.
    fn state(&self) -> Uplink {
        let state = self.plant.truth().measured();
        Uplink::State { tick: self.report.ticks, state }
    }

    /// The control periods since the latest telemetry, under the image's wrench: one, unless it was too busy to
    /// send.
    fn advance(&mut self, telemetry: &Telemetry) {
        let since = telemetry.tick.saturating_sub(self.flight_tick);
        let periods = if self.flying && telemetry.tick > 1 { since.clamp(1, 1000) } else { 1 };
        self.report.skipped += periods - 1;
        self.flight_tick = telemetry.tick;
        self.judge(telemetry);
        (0..periods).for_each(|_| self.period(telemetry));
    }

    fn period(&mut self, telemetry: &Telemetry) {
        let truth = *self.plant.truth();
        let mut disturbance = self.disturbance.advance(&truth);
        self.plant.command(&telemetry.wrench);
        self.plant.add_drag(&mut disturbance);
        self.plant.advance(&disturbance);
        self.report.ticks += 1;
        self.report.height_max = self.report.height_max.max(self.plant.truth().position_world.z);
    }

    fn judge(&mut self, telemetry: &Telemetry) {
        let flying = matches!(telemetry.mode, Mode::Flying | Mode::Failsafe);
        self.report.flights += u32::from(flying && !self.flying);
        self.flying = flying;
        if telemetry.mode != Mode::Flying {
            return;
        }
        let Wrench { thrust, torque_body } = telemetry.wrench;
        let torque = torque_body.abs();
        let report = &mut self.report;
        report.thrust = (report.thrust.0.min(thrust), report.thrust.1.max(thrust));
        report.torque_max = report.torque_max.max(torque.max_element());
        let WrenchBounds { thrust_min, thrust_max, torque_max, .. } = self.bounds;
        let inside = torque.cmple(torque_max).all();
        report.bounded &= (thrust_min..=thrust_max).contains(&thrust) && inside;
    }
}

/// Flies the image with the vehicle of a scenario until `interrupts` counts one or the time is over;
/// `listening` receives the address for ground stations.
///
/// # Errors
/// When the emulator cannot be started, or the image falls silent.
pub fn fly_image(
    loaded: &LoadedScenario,
    options: &ImageOptions,
    interrupts: &AtomicUsize,
    listening: &mut dyn FnMut(SocketAddr),
) -> Result<ImageReport, FlyError> {
    let mut bench = Bench::new(loaded.scenario())?;
    let address = free(options.tcp).map_err(FlyError::Port)?;
    // A socket's own buffers; nobody has to be there.
    let device = format!("tcp:{address},server=on,wait=off,nodelay=on");
    let mut session = VehicleSession::boot_with_mavlink(&options.emulator, &device)?;
    stand(&mut session, loaded.scenario())?;
    listening(address);
    let period = f64::from(loaded.scenario().controller.step_period());
    let mut start = Instant::now();
    let mut paced = 0_u64;
    while interrupts.load(Ordering::Relaxed) == 0 {
        let time = bench.report.ticks as f64 * period;
        if options.duration.is_some_and(|duration| time >= duration) {
            break;
        }
        for _ in 0..TICKS_PER_LOOK {
            let telemetry = tick(&mut session, &bench.state())?;
            bench.advance(&telemetry);
            paced += 1;
        }
        let due = start + Duration::from_secs_f64(paced as f64 * period / options.speed);
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
    Ok(bench.report)
}

/// One tick of the image; what else it sends is for other hosts.
fn tick(session: &mut VehicleSession, state: &Uplink) -> Result<Telemetry, PilError> {
    let received = session.send(std::slice::from_ref(state))?;
    let telemetry = received.iter().find_map(|message| match message {
        Downlink::Telemetry(telemetry) => Some(*telemetry),
        _ => None,
    });
    let silent = || PilError::Answer("telemetry in a tick".to_owned(), format!("{received:?}"));
    telemetry.ok_or_else(silent)
}

/// The address, with a port that is free now where it asks for any.
fn free(address: SocketAddr) -> std::io::Result<SocketAddr> {
    TcpListener::bind(address)?.local_addr()
}
