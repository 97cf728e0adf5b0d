//! The link's lock step: control ticks when the host says so, over FIFOs and over USART2, rotors off.

use std::path::{Path, PathBuf};
use std::process::Child;
use std::time::{Duration, Instant};
use std::{fs, thread};

use ctrl_core::mode::{Command, Mode, Refusal};
use ctrl_core::vehicle::VehicleState;
use glam::Vec3;
use link::{Rejection, Uplink};
use sil_host::pil::PilError;
use sil_host::pil::emulator::Emulator;
use sil_host::pil::flight::{OnBoard, fly, fly_ahead};
use sil_host::pil::lockstep::PATIENCE;
use sil_host::pil::session::{VehicleSession, one_telemetry};
use sil_host::pil::set_up::set_up;
use sim::scenario::LoadedScenario;

use crate::PAPER;
use crate::emulator::emulator;
use crate::serial_link::Vehicle;

const HERE: VehicleState = VehicleState::at_rest(Vec3::ZERO);

/// An image with its serial port at a pseudo-terminal; ends with this value.
struct AtTerminal {
    emulator: Child,
    terminal: PathBuf,
}

impl AtTerminal {
    fn boot() -> Self {
        let emulator = emulator("firmware").start(&[], "pty").unwrap();
        let mut vehicle = Self { emulator, terminal: PathBuf::new() };
        let end = Instant::now() + PATIENCE;
        while vehicle.terminal.as_os_str().is_empty() {
            assert!(Instant::now() < end, "QEMU opens no terminal");
            thread::sleep(Duration::from_millis(5));
            vehicle.terminal = terminal_of(&vehicle.emulator).unwrap_or_default();
        }
        vehicle
    }

    fn attach(&self) -> VehicleSession {
        let (unit, end) = (emulator("firmware").cost_unit(), Instant::now() + PATIENCE);
        loop {
            match VehicleSession::attach(&self.terminal, 2_000_000, unit, None) {
                // A terminal cannot be opened before its master has unlocked it.
                Err(PilError::Line(..)) if Instant::now() < end => {
                    thread::sleep(Duration::from_millis(5));
                }
                attached => return attached.unwrap(),
            }
        }
    }
}

/// The terminal that a process is the master of. QEMU names it on its standard output, but late.
fn terminal_of(process: &Child) -> Option<PathBuf> {
    let files = fs::read_dir(format!("/proc/{}/fdinfo", process.id())).unwrap();
    files.filter_map(|file| fs::read_to_string(file.ok()?.path()).ok()).find_map(|file| {
        let index = file.lines().find_map(|line| line.strip_prefix("tty-index:"))?;
        Some(Path::new("/dev/pts").join(index.trim()))
    })
}

impl Drop for AtTerminal {
    fn drop(&mut self) {
        self.emulator.kill().unwrap();
        self.emulator.wait().unwrap();
    }
}

fn flown(session: &mut VehicleSession, scenario: &str, duration: f64) -> (OnBoard, u64) {
    let loaded = LoadedScenario::open(scenario, &[format!("duration={duration}")]).unwrap();
    set_up(session, loaded.scenario()).unwrap();
    let on_board = fly(&loaded, session, &mut (), &|_| ()).unwrap();
    (on_board, loaded.scenario().ticks())
}

#[test]
fn over_the_serial_port_a_flight_is_sils_to_the_bit_and_another_follows() {
    let vehicle = AtTerminal::boot();
    for scenario in PAPER {
        // As a host that comes anew each time, and leaves the vehicle in flight.
        let mut session = vehicle.attach();
        session.enter_lock_step().unwrap();
        let (on_board, ticks) = flown(&mut session, scenario, 0.2);
        assert_eq!((on_board.difference, on_board.ticks), (None, ticks), "{scenario}");
        assert_eq!(session.statistics().damaged, 0);
    }
}

#[test]
fn over_fifos_a_flight_is_sils_to_the_bit_and_costs_the_same() {
    for scenario in PAPER {
        let (mut session, _) = VehicleSession::boot(&emulator("firmware"), &[]).unwrap();
        let (by_clock, _) = flown(&mut session, scenario, 0.3);
        let (mut session, _) = VehicleSession::boot(&emulator("firmware"), &[]).unwrap();
        session.enter_lock_step().unwrap();
        let (in_step, ticks) = flown(&mut session, scenario, 0.3);
        assert_eq!((in_step.difference, in_step.ticks), (None, ticks));
        // Rotors are commanded by the clock, and stopped in lock step: 39 instructions for each of four pulses.
        let [by_clock, in_step] = [by_clock, in_step].map(|flown| flown.cost.mean());
        assert!((by_clock - in_step).abs() < 200.0, "{by_clock}, {in_step}");
        let health = session.health(HERE).unwrap();
        assert_eq!(health.groups.map(|group| group.overruns), [0; 4], "{health:?}");
    }
}

/// As `sil-host pil --lock-step --count false` flies: the emulator's time is the machine's, and steps are requested ahead.
#[test]
fn in_lock_step_without_counted_time_and_with_the_host_ahead_a_flight_is_sils_to_the_bit() {
    let emulator = Emulator { counted: false, ..emulator("firmware") };
    for scenario in PAPER {
        let loaded = LoadedScenario::open(scenario, &["duration=0.5".to_owned()]).unwrap();
        let (mut session, _) = VehicleSession::boot(&emulator, &[]).unwrap();
        session.enter_lock_step().unwrap();
        set_up(&mut session, loaded.scenario()).unwrap();
        let flown = fly_ahead(&loaded, &mut session, 32, &mut (), &|_| ()).unwrap();
        assert_eq!((flown.difference, flown.ticks), (None, 500), "{scenario}");
    }
}

#[test]
fn only_in_lock_step_a_flight_may_begin_at_any_attitude() {
    let (mut session, _) = VehicleSession::boot(&emulator("firmware"), &[]).unwrap();
    let tilted = LoadedScenario::open("tilt-recovery", &["duration=0.3".to_owned()]).unwrap();
    let refused = set_up(&mut session, tilted.scenario()).unwrap_err().to_string();
    assert!(refused.contains("tilted beyond the arming limit"), "{refused}");
    session.enter_lock_step().unwrap();
    let (on_board, ticks) = flown(&mut session, "tilt-recovery", 0.3);
    assert_eq!((on_board.difference, on_board.ticks), (None, ticks));
    // What was in flight there is disarmed where the clock ticks, and may not arm so tilted.
    let state = tilted.scenario().initial.state().measured();
    session.leave_lock_step().unwrap();
    session.subscribe(state).unwrap();
    let sample = Uplink::State { tick: 0, state };
    for _ in 0..60 {
        let telemetry = session.tick(std::slice::from_ref(&sample)).unwrap();
        assert_eq!((telemetry.mode, telemetry.wrench.thrust), (Mode::Disarmed, 0.0));
    }
    let refused = session.ask(Uplink::Command(Command::Arm), state).unwrap();
    assert_eq!(refused, Err(Rejection::Mode(Refusal::Tilted)));
}

#[test]
fn lock_step_is_refused_unless_disarmed() {
    let (mut session, _) = VehicleSession::boot(&emulator("firmware"), &[]).unwrap();
    session.subscribe(HERE).unwrap();
    let sample = [Uplink::State { tick: 0, state: HERE }];
    for _ in 0..60 {
        session.tick(&sample).unwrap();
    }
    session.expect_ok("to arm", Uplink::Command(Command::Arm), HERE).unwrap();
    assert_eq!(session.ask(Uplink::LockStep(true), HERE).unwrap(), Err(Rejection::NotNow));
    let step = Uplink::Step { uptime_ticks: 1 };
    assert_eq!(session.ask(step, HERE).unwrap(), Err(Rejection::NotNow));
}

#[test]
fn in_lock_step_no_rotor_turns_whatever_the_controller_says() {
    let (mut vehicle, _) = Vehicle::boot(&["ticks=400"]);
    vehicle.0.enter_lock_step().unwrap();
    vehicle.subscribe(HERE);
    let sample = Uplink::State { tick: 0, state: HERE };
    for _ in 0..60 {
        vehicle.tick(std::slice::from_ref(&sample));
    }
    vehicle.ask(Uplink::Command(Command::Arm), HERE).unwrap();
    let telemetry = vehicle.tick(&[sample.clone(), Uplink::Command(Command::Start)]);
    assert_eq!(telemetry.mode, Mode::Flying);
    assert!(telemetry.wrench.thrust > 1.0);
    while vehicle.0.send(std::slice::from_ref(&sample)).is_ok() {}
    let report = vehicle.send_until_the_end(&[]);
    assert!(report.contains("end of run at tick 400"), "{report}");
    assert!(report.contains("rotor duty [10000, 10000, 10000, 10000]"), "{report}");
}

#[test]
fn a_host_that_is_silent_in_lock_step_is_left_and_the_vehicle_disarmed() {
    let (mut session, _) =
        VehicleSession::boot(&emulator("firmware"), &["lock-step-timeout=20".to_owned()]).unwrap();
    session.enter_lock_step().unwrap();
    let loaded = LoadedScenario::open("paper-saturated", &["duration=0.1".to_owned()]).unwrap();
    let state = set_up(&mut session, loaded.scenario()).unwrap();
    let start = [Uplink::State { tick: 0, state }, Uplink::Command(Command::Start)];
    let received = session.send(&start).unwrap();
    assert_eq!(one_telemetry(&received).unwrap().mode, Mode::Flying);
    // A packet without a step: 20 s of the vehicle's time pass before the next one comes.
    let received = session.send_bytes(&[]).unwrap();
    let telemetry = one_telemetry(&received).unwrap();
    assert_eq!((telemetry.mode, telemetry.wrench.thrust), (Mode::Disarmed, 0.0));
}

#[test]
fn commands_that_wait_at_the_end_of_lock_step_start_nothing() {
    let (mut vehicle, _) = Vehicle::boot(&["ticks=400"]);
    vehicle.0.enter_lock_step().unwrap();
    vehicle.subscribe(HERE);
    let sample = Uplink::State { tick: 0, state: HERE };
    for _ in 0..60 {
        vehicle.tick(std::slice::from_ref(&sample));
    }
    // Without a step in between: the end of lock step comes before the first of them.
    let [arm, start] = [Command::Arm, Command::Start].map(Uplink::Command);
    let frames = vehicle.0.frames(&[sample.clone(), arm, start, Uplink::LockStep(false)]);
    vehicle.0.send_bytes(&frames.concat()).unwrap();
    vehicle.0.leave_lock_step().unwrap();
    for _ in 0..5 {
        let telemetry = vehicle.tick(std::slice::from_ref(&sample));
        assert_eq!((telemetry.mode, telemetry.wrench.thrust), (Mode::Disarmed, 0.0));
    }
}
