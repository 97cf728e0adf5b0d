//! Flights under commands, without sockets and as fast as they go: modes, both controllers, disturbances.

use std::path::Path;

use ctrl_core::mode::navigation::{
    Airborne, MissionItem, MissionKind, NavigationEvent, NavigationMode, Request,
};
use ctrl_core::mode::safety::{BatteryGuard, Reaction, SafetyConfig};
use ctrl_core::mode::{Command, Mode};
use ctrl_core::setpoint::Setpoint;
use firmware::session::SessionMemory;
use glam::Vec3;
use mavlink_vehicle::Vehicle;
use sil_host::fly::{FlightLogs, FlownTick, FlownVehicle};
use sil_host::log::LogOptions;
use sil_host::log::description::Description;
use sil_host::log::format::Format;
use sim::scenario::LoadedScenario;

/// A vehicle with its results.
struct Air<'m> {
    vehicle: FlownVehicle<'m>,
    logs: FlightLogs,
    events: Vec<NavigationEvent>,
    directory: std::path::PathBuf,
}

impl<'m> Air<'m> {
    fn new(test: &str, name: &str, changes: &[&str], memory: &'m mut SessionMemory) -> Self {
        let changes: Vec<_> = changes.iter().map(ToString::to_string).collect();
        let loaded = LoadedScenario::open(name, &changes).expect("a scenario");
        let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fly").join(test);
        let _ = std::fs::remove_dir_all(&directory);
        let options = LogOptions { formats: vec![Format::Ulog], rate: 100.0 };
        let description = Description::new(&loaded).expect("a description");
        let logs = FlightLogs::new(loaded.scenario(), description, &directory, &options, 10);
        let vehicle = FlownVehicle::new(loaded.scenario(), memory).expect("it flies");
        Self { vehicle, logs: logs.expect("a directory"), events: Vec::new(), directory }
    }

    fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds / self.vehicle.step_period()).round() as u64 {
            let FlownTick { tick, outputs, navigation } = self.vehicle.tick();
            self.logs.observe(&tick, outputs.mode, navigation).expect("written");
            self.events.extend(self.vehicle.piloted().take_event());
        }
        assert!(!self.vehicle.differs(), "the control group differs from the law");
    }

    /// Runs until a condition holds; fails after `seconds`.
    fn until(&mut self, seconds: f64, condition: impl Fn(&Self) -> bool) {
        let end = self.vehicle.time() + seconds;
        while !condition(self) {
            assert!(self.vehicle.time() < end, "{:?}", self.vehicle.truth());
            self.run(0.1);
        }
    }

    fn command(&mut self, command: Command) -> Result<Mode, ctrl_core::mode::Refusal> {
        self.vehicle.piloted().command(command).expect("none waits");
        self.run(0.1);
        self.vehicle.piloted().take_answer().expect("answered")
    }

    fn ask(&mut self, request: Request) {
        let mode = self.vehicle.mode();
        self.vehicle.pilot().request(mode, request).expect("accepted");
    }

    fn near(&self, place: Vec3, radius: f64) -> bool {
        (self.vehicle.truth().position_world - place.as_dvec3()).length() < radius
    }

    /// Armed and in hold at the height of a take-off; the place on the ground.
    fn take_off(&mut self) -> Vec3 {
        self.run(0.2);
        let ground = self.vehicle.truth().position_world.as_vec3();
        assert!(ground.z.abs() < 1e-3, "{ground}");
        assert_eq!(self.command(Command::Arm), Ok(Mode::Armed));
        self.ask(Request::TakeOff(None));
        self.until(60.0, |air| air.events.contains(&NavigationEvent::TakenOff));
        assert_eq!(self.vehicle.navigator().airborne(), Airborne::Air);
        ground
    }

    /// The flight's results: every guarantee held.
    fn finish(mut self) {
        self.until(90.0, |air| air.vehicle.mode() == Mode::Disarmed);
        let [report] = self.logs.reports() else { panic!("one flight") };
        assert!(report.passed() && report.verdicts.len() >= 4, "{:#?}", report.verdicts);
        assert!(self.vehicle.plant().stands());
        let speed = self.vehicle.plant().touchdown_speed();
        assert!(speed < 0.8, "touchdown at {speed} m/s");
        let entry = self.logs.entries().next().expect("a log");
        let log = std::fs::read(self.directory.join("flight-001/flight.ulg")).expect("a file");
        assert_eq!((entry.size as usize, &log[..4]), (log.len(), &b"ULog"[..]));
        let battery = log.windows(14).any(|part| part == b"battery_status");
        assert_eq!(battery, self.vehicle.battery().is_some());
        let mut part = [0; 90];
        assert_eq!(self.logs.read(0, 100, &mut part), 90);
        assert_eq!(part, log[100..190]);
        assert_eq!(self.logs.read(0, entry.size, &mut part), 0);
        assert_eq!(self.logs.read(7, 0, &mut part), 0);
    }
}

#[test]
fn controller_2_flies_a_mission_from_the_ground_to_the_ground() {
    let mut memory = SessionMemory::new();
    let mut air = Air::new("mission", "paper-saturated", &[], &mut memory);
    air.run(0.2);
    let ground = air.vehicle.truth().position_world.as_vec3();
    let item = |kind, east: f32, height, number| MissionItem {
        kind,
        position_world: ground + Vec3::new(east, 0.0, height),
        number,
        ..MissionItem::default()
    };
    let items = [
        item(MissionKind::TakeOff, 0.0, 2.0, 0),
        item(MissionKind::Waypoint, 3.0, 2.0, 1),
        item(MissionKind::Land, 3.0, 0.0, 2),
    ];
    air.vehicle.piloted().navigator().set_mission(items.into_iter()).expect("valid");
    assert_eq!(air.command(Command::Arm), Ok(Mode::Armed));
    air.ask(Request::Mission);
    air.until(120.0, |air| air.events.contains(&NavigationEvent::Landed));
    let reached: Vec<_> = (0..3).map(NavigationEvent::ItemReached).collect();
    assert_eq!(air.events, [&reached[..], &[NavigationEvent::Landed]].concat());
    assert!(air.near(ground + 3.0 * Vec3::X, 0.3));
    air.finish();
}

#[test]
fn controller_1_follows_set_points_and_returns_under_a_constant_push() {
    let mut memory = SessionMemory::new();
    let disturbed =
        ["disturbance.constant={ acceleration = [0.02, -0.01, 0.01], torque = [0.01, 0.0, 0.0] }"];
    let mut air = Air::new("set-points", "lemniscate", &disturbed, &mut memory);
    let ground = air.take_off();
    let east = Setpoint {
        velocity_world: [Some(0.5), Some(0.0), Some(0.0)],
        yaw: Some(1.0),
        ..Setpoint::default()
    };
    air.vehicle.piloted().navigator().stream(east).expect("valid");
    air.ask(Request::Offboard);
    for _ in 0..50 {
        air.vehicle.piloted().navigator().stream(east).expect("valid");
        air.run(0.1);
    }
    assert_eq!(air.vehicle.navigator().mode(), NavigationMode::Offboard);
    let velocity = air.vehicle.truth().velocity_world;
    assert!((velocity.x - 0.5).abs() < 0.1 && velocity.y.abs() < 0.1, "{velocity}");
    air.run(1.0);
    assert_eq!(air.vehicle.navigator().mode(), NavigationMode::Hold, "silence");
    air.ask(Request::Return);
    air.until(120.0, |air| air.vehicle.mode() == Mode::Disarmed);
    assert!(air.near(ground, 0.4), "{:?} is not {ground}", air.vehicle.truth());
    air.finish();
}

#[test]
fn a_vehicle_with_rotor_lag_and_delay_hovers_and_lands() {
    let mut memory = SessionMemory::new();
    let slow = ["actuation.rotor_lag=0.02", "actuation.delay=0.005"];
    let mut air = Air::new("rotor-lag", "paper-saturated", &slow, &mut memory);
    let ground = air.take_off();
    air.run(5.0);
    assert!(air.near(ground + 2.5 * Vec3::Z, 0.3), "{:?}", air.vehicle.truth());
    air.ask(Request::Land(None));
    air.finish();
}

#[test]
fn the_same_commands_at_the_same_ticks_leave_the_same_bytes() {
    let fly = |test: &str| {
        let mut memory = SessionMemory::new();
        let mut air = Air::new(test, "hover-gusts", &[], &mut memory);
        air.run(0.2);
        air.command(Command::Arm).expect("armed");
        air.ask(Request::TakeOff(None));
        air.run(3.0);
        air.command(Command::Disarm).expect("disarmed");
        air.run(0.1);
        std::fs::read(air.directory.join("flight-001/flight.ulg")).expect("a log")
    };
    assert!(fly("repeated-1") == fly("repeated-2"));
}

#[test]
fn the_plants_battery_sags_under_the_rotors_and_the_guard_brings_the_vehicle_down() {
    // A frame as that of firmware/vehicle.toml, and a battery with little left.
    let rotors = r#"rotors={frame={ring={spins=["clockwise","anticlockwise","clockwise","anticlockwise"], arm=0.2, first_angle_deg=45.0, torque_ratio=0.016, thrust={lower=0.0, upper=4.0}}}, battery={full_voltage=16.8, empty_voltage=13.2, nominal_voltage=15.0, resistance=0.02, capacity=1.0, charge=0.4, power_factor=12.0, compensation_time=0.5}}"#;
    let mut memory = SessionMemory::new();
    let mut air = Air::new("battery", "hover-gusts", &[rotors], &mut memory);
    let battery = BatteryGuard {
        low: 14.0,
        critical: 13.4,
        time: 1.0,
        low_reaction: Reaction::Return,
        critical_reaction: Reaction::Land,
    };
    let safety = SafetyConfig { battery: Some(battery), ..SafetyConfig::default() };
    air.vehicle.set_safety(&safety).expect("valid");
    let at_rest = air.vehicle.battery().expect("a battery");
    assert!((at_rest.voltage - (13.2 + 0.4 * 3.6)).abs() < 1e-5 && at_rest.current == 0.0);
    air.run(0.5);
    air.command(Command::Arm).expect("armed");
    air.ask(Request::TakeOff(Some(3.0)));
    air.until(60.0, |air| air.vehicle.truth().position_world.z > 2.5);
    let flying = air.vehicle.battery().expect("a battery");
    // Four rotors with 2.08 N each take 4 * 12 * 2.08^1.5 = 144 W.
    assert!((flying.voltage * flying.current - 144.0).abs() < 15.0, "{flying:?}");
    assert!(flying.remaining < at_rest.remaining && flying.voltage < at_rest.voltage);
    air.until(120.0, |air| air.vehicle.mode() == Mode::Disarmed);
    assert!(air.vehicle.plant().stands() && air.vehicle.plant().touchdown_speed() < 0.8);
    let low = air.vehicle.battery().expect("a battery");
    assert!(low.voltage < 14.0 && low.remaining > 0.05, "{low:?}");
    // Its log has the topic, which one of a plant without a battery has not; the station sees the same numbers.
    let logged = |log: &[u8]| log.windows(14).any(|part| part == b"battery_status");
    assert!(logged(&std::fs::read(air.directory.join("flight-001/flight.ulg")).expect("a log")));
    assert_eq!(air.vehicle.piloted().view().battery, Some(low));

    let hexarotor = rotors.replace("spins=[", r#"spins=["clockwise","anticlockwise","#);
    let loaded = LoadedScenario::open("hover-gusts", &[hexarotor]).expect("a scenario");
    let error = FlownVehicle::new(loaded.scenario(), &mut SessionMemory::new()).expect_err("six");
    assert_eq!(error.to_string(), "rotors.frame: 6 rotors, but firmware/vehicle.toml has 4");
}
