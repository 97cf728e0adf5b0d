//! `[rotors]` of a scenario: effects against closed forms, flights with them, and what is refused.

use ctrl_core::vehicle::{GRAVITY, Wrench};
use glam::{DQuat, DVec3, Vec3};
use sim::guarantee::Verdict;
use sim::observer::Observer;
use sim::plant::actuation::ActuationConfig;
use sim::plant::rigid_body::RigidBody;
use sim::plant::rotors::{RotorFailure, Rotors, RotorsConfig};
use sim::plant::vehicle::{Plant, Vehicle};
use sim::plant::{Disturbance, PlantParameters, PlantState};
use sim::scenario::{BUILT_IN, LoadedScenario};
use sim::tick::Tick;

const QUAD: &str = r#"
frame = { ring = { spins = ["clockwise", "anticlockwise", "clockwise", "anticlockwise"], arm = 0.2, first_angle_deg = 45.0,
  torque_ratio = 0.016, thrust = { lower = 0.05, upper = 6.0 } } }
"#;
const OCTO: &str = r#"frame={ring={spins=["clockwise","anticlockwise","clockwise","anticlockwise","clockwise","anticlockwise","clockwise","anticlockwise"], arm=0.25, first_angle_deg=22.5, torque_ratio=0.016, thrust={lower=0.05, upper=3.0}}}"#;
const HEXA: &str = r#"frame={ring={spins=["anticlockwise","anticlockwise","clockwise","clockwise","anticlockwise","clockwise"], arm=0.25, first_angle_deg=30.0, torque_ratio=0.016, thrust={lower=0.05, upper=4.0}}}"#;
const BODY: PlantParameters = PlantParameters::new(0.85, DVec3::new(0.03, 0.05, 0.1));
const DT: f64 = 1e-3;

fn config(more: &str) -> RotorsConfig {
    toml_edit::de::from_str(&format!("{QUAD}{more}")).expect("rotors")
}

fn vehicle(more: &str, actuation: &ActuationConfig, velocity_world: DVec3) -> Vehicle {
    let body = RigidBody::new(&BODY, DT, 1);
    let start = PlantState {
        position_world: DVec3::ZERO,
        velocity_world,
        attitude: DQuat::IDENTITY,
        rate_body: DVec3::ZERO,
    };
    let rotors = Rotors::new(&config(more), actuation, &BODY, &body).expect("valid");
    Vehicle::new(body, None, start).by_rotors(rotors)
}

fn hover() -> Wrench {
    Wrench { thrust: BODY.mass as f32 * GRAVITY, torque_body: Vec3::ZERO }
}

/// Flies `ticks` under one command.
fn fly(vehicle: &mut Vehicle, command: &Wrench, wind_world: DVec3, ticks: u32) {
    for _ in 0..ticks {
        vehicle.command(command);
        let mut held = Disturbance { wind_world, ..Disturbance::NONE };
        vehicle.add_drag(&mut held);
        vehicle.advance(&held);
    }
}

#[test]
fn whole_rotors_with_a_known_curve_make_the_command() {
    let command = Wrench { thrust: 9.0, torque_body: Vec3::new(0.2, -0.1, 0.02) };
    for more in ["", "thrust_curve = { quadratic = 0.6 }"] {
        let applied = vehicle(more, &ActuationConfig::default(), DVec3::ZERO).command(&command);
        assert!((applied.thrust - 9.0).abs() < 1e-5, "{applied:?}");
        let torque = (applied.torque_body - command.torque_body.as_dvec3()).abs().max_element();
        assert!(torque < 1e-6, "{applied:?}");
    }
    let beyond = Wrench { thrust: 100.0, torque_body: Vec3::ZERO };
    let applied = vehicle("", &ActuationConfig::default(), DVec3::ZERO).command(&beyond);
    assert!((applied.thrust - 24.0).abs() < 1e-5, "{applied:?}");
}

#[test]
fn a_level_slide_decays_exponentially_by_the_drag() {
    let drag = 0.04;
    let start = DVec3::new(5.0, -3.0, 0.0);
    let wind = DVec3::new(1.0, 0.5, 0.0);
    let mut plant = vehicle("drag = 0.04", &ActuationConfig::default(), start);
    fly(&mut plant, &hover(), wind, 2_000);
    let each = f64::from(hover().thrust) / 4.0;
    let rate = drag * 4.0 * each.sqrt() / BODY.mass;
    let expected = wind + (start - wind) * (-rate * 2.0).exp();
    let error = (plant.truth().velocity_world - expected).truncate().length();
    // Thrusts in single precision turn the vehicle by some 1e-6 rad/s^2. Drag held at its value at the start of
    // each tick would be off by 2e-4 m/s.
    assert!(error < 5e-5, "{:?} {expected}", plant.truth());
    let way = wind * 2.0 + (start - wind) * (1.0 - (-rate * 2.0).exp()) / rate;
    let error = (plant.truth().position_world - way).truncate().length();
    assert!(error < 5e-5, "{:?} {way}", plant.truth());
}

#[test]
fn a_dead_rotor_gives_nothing_from_its_time_on_however_the_rotors_lag() {
    let failures = "failures = [{ rotor = 0, time = 0.1, thrust_left = 0.25 }]";
    let lagging = ActuationConfig { rotor_lag: Some(0.05), ..ActuationConfig::default() };
    for actuation in [ActuationConfig::default(), lagging] {
        let mut plant = vehicle(failures, &actuation, DVec3::ZERO);
        fly(&mut plant, &hover(), DVec3::ZERO, 100);
        assert!(plant.truth().rate_body.length() < 1e-6, "{:?}", plant.truth());
        fly(&mut plant, &hover(), DVec3::ZERO, 1);
        // A quarter of the weight, less three quarters of it at (d, d): torque (d, -d, kappa).
        let lost = 0.75 * f64::from(hover().thrust) / 4.0;
        let d = f64::from(0.2f32 * core::f32::consts::FRAC_1_SQRT_2);
        let expected = -lost * DVec3::new(d, -d, 0.016) / BODY.inertia * DT;
        let error = (plant.truth().rate_body - expected).length();
        assert!(error < 1e-6, "{:?} {expected}", plant.truth());
    }
}

#[test]
fn thrust_falls_with_the_square_of_the_voltage_unless_it_is_compensated() {
    let battery = |more: &str| {
        format!(
            "battery = {{ full_voltage = 16.0, empty_voltage = 12.0, nominal_voltage = 16.0, resistance = 0.02, capacity = 1.5, \
             charge = 0.5, power_factor = 12.0{more} }}"
        )
    };
    let applied = |more: &str| {
        let mut plant = vehicle(&battery(more), &ActuationConfig::default(), DVec3::ZERO);
        fly(&mut plant, &hover(), DVec3::ZERO, 3_000);
        let voltage = plant.battery().expect("a battery").voltage;
        (plant.command(&hover()).thrust / f64::from(hover().thrust), voltage)
    };
    let (thrust, voltage) = applied("");
    assert!((13.0..13.95).contains(&voltage), "{voltage}");
    assert!((thrust - (voltage / 16.0).powi(2)).abs() < 1e-6, "{thrust} {voltage}");
    let (thrust, voltage) = applied(", compensation_time = 0.1");
    assert!((13.0..13.95).contains(&voltage), "{voltage}");
    // The smoothed voltage is late by its time constant: 0.1 s of a fall of some mV/s.
    assert!((thrust - 1.0).abs() < 1e-3, "{thrust}");
}

/// Verdicts and largest position error from a time on.
fn flown(name: &str, changes: &[String], from: f64, until: f64) -> (Vec<Verdict>, f64) {
    struct Watch(sim::guarantee::Guarantees, f64, f64);
    impl Observer for Watch {
        fn observe(&mut self, tick: &Tick) {
            self.0.observe(tick);
            if tick.time >= self.1 {
                self.2 = self.2.max(tick.position_error().length());
            }
        }
    }
    let loaded = LoadedScenario::open(name, changes).unwrap_or_else(|error| panic!("{error}"));
    let mut watch = Watch(loaded.scenario().monitors(), from, 0.0);
    let period = f64::from(loaded.scenario().controller.step_period());
    loaded.flight().expect("valid").observe((until / period).round() as u64, &mut watch);
    (watch.0.verdicts(), watch.2)
}

#[test]
fn a_hexarotor_and_an_octorotor_lose_a_rotor_in_flight_and_still_track() {
    for (frame, rotor) in [(HEXA, 1), (OCTO, 0), (OCTO, 5)] {
        let change = |after: &str| {
            vec![format!(
                "rotors={{{frame}, failures=[{{rotor={rotor}, time=20, thrust_left=0{after}}}]}}"
            )]
        };
        // Position error of the lemniscate before the failure, and 10 s after it.
        let (_, before) = flown("lemniscate", &change(", reallocated_after=0.15"), 15.0, 20.0);
        let (rows, error) = flown("lemniscate", &change(", reallocated_after=0.15"), 30.0, 45.0);
        assert!(error < 1.05 * before + 0.02, "{frame} {rotor}: {before} {error}");
        let faults = rows.iter().find(|row| row.name.contains("fault")).expect("a row");
        assert!(faults.pass, "{faults:?}");
        // Without another allocation the same failure is not survived, or not tracked.
        let (_, lost) = flown("lemniscate", &change(""), 30.0, 45.0);
        assert!(lost.is_nan() || lost > 5.0 * error, "{frame} {rotor}: {lost} {error}");
    }
}

#[test]
fn guarantees_of_v_become_information_and_limits_stay_judged() {
    let changes =
        vec![format!("rotors={{{OCTO}, drag=0.02, thrust_curve={{quadratic=0.7, assumed=0.8}}}}")];
    let (rows, _) = flown("paper-saturated", &changes, 0.0, 10.0);
    let row = |start: &str| rows.iter().find(|row| row.name.starts_with(start)).expect(start);
    use sim::guarantee::Requirement::Information;
    assert_eq!(row("Lyapunov balance residual").requirement, Information);
    assert_eq!(row("applied thrust").requirement, Information);
    assert!(row("torque about x").pass && row("torque about x").requirement != Information);
}

#[test]
fn whole_rotors_change_no_verdict_of_a_scenario() {
    let (ideal_rows, ideal) = flown("paper-saturated", &[], 10.0, 20.0);
    let changes = [format!("rotors={{{OCTO}}}")];
    let (rows, error) = flown("paper-saturated", &changes, 10.0, 20.0);
    assert!((ideal - error).abs() < 1e-4, "{ideal} {error}");
    for row in ideal_rows.iter().filter(|row| row.equation != "-" && row.unit != "1/s") {
        let by_rotors = rows.iter().find(|it| it.name == row.name).expect(row.name);
        assert!(by_rotors.pass == row.pass, "{row} {by_rotors}");
    }
}

fn fault(change: &str) -> String {
    match LoadedScenario::open("paper-saturated", &[change.to_owned()]) {
        Ok(_) => panic!("`{change}` was accepted"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn impossible_rotors_are_named() {
    let with = |more: &str| fault(&format!("rotors={{{OCTO}, {more}}}"));
    for (more, end) in [
        ("drag=-1", "rotors.drag: -1 must be in [0, 10] N s/m per root newton"),
        ("thrust_curve={quadratic=2}", "rotors.thrust_curve.quadratic: 2 must be in [0, 1]"),
        (
            "failures=[{rotor=8, time=1, thrust_left=0}]",
            "rotors.failures: failure 0: rotor 8 must be below 8, the number of rotors",
        ),
        (
            "failures=[{rotor=7, time=1, thrust_left=1.5}]",
            "rotors.failures: failure 0: thrust_left 1.5 must be in [0, 1]",
        ),
        (
            "battery={full_voltage=12, empty_voltage=13, nominal_voltage=14, resistance=0.1, capacity=1, power_factor=10}",
            "rotors.battery.full_voltage: 12 must be at least the empty voltage, 13",
        ),
    ] {
        let message = with(more);
        assert!(message.ends_with(end), "{message}");
    }
    let no_yaw = fault(&format!("rotors={{{}}}", OCTO.replace("anticlockwise", "clockwise")));
    assert!(no_yaw.contains(": rotors: "), "{no_yaw}");
    assert!(no_yaw.contains("independence"), "{no_yaw}");
    let four_left: Vec<_> = (0..4)
        .map(|rotor| format!("{{rotor={rotor}, time=1, thrust_left=0, reallocated_after=1}}"))
        .collect();
    let message = with(&format!("failures=[{}]", four_left.join(",")));
    assert!(message.contains("tilt torque"), "{message}");
    let changes = [format!("rotors={{{OCTO}}}"), "actuation.thrust_max=10".to_owned()];
    let error = LoadedScenario::open("paper-saturated", &changes).expect_err("refused").to_string();
    assert!(error.ends_with("must be absent beside [rotors], whose own limits act"), "{error}");
}

#[test]
fn what_the_rotors_break_is_said() {
    let changes =
        [format!("rotors={{{OCTO}, drag=0.02, failures=[{{rotor=1, time=5, thrust_left=0.4}}]}}")];
    let loaded = LoadedScenario::open("paper-saturated", &changes).expect("valid");
    assert_eq!(
        loaded.scenario().broken_assumptions(),
        [
            "the wrench is allocated to rotors, each within its limits",
            "rotor drag of 0.02 N s/m per root newton adds to the disturbance, without a bound",
            "rotor 1 gives 40 % of its thrust from 5 s on",
        ]
    );
}

#[test]
fn the_documented_table_is_one() {
    let document = include_str!("../../docs/plant.md");
    let table = document.split("```toml").find(|block| block.trim_start().starts_with("[rotors]"));
    let table = table.and_then(|block| block.split("```").next()).expect("a table");
    let text = format!("{}\n{table}", BUILT_IN[0].text);
    let loaded = LoadedScenario::parse("documented", &text, &[]).expect("valid");
    let rotors = loaded.scenario().rotors.as_ref().expect("rotors");
    let failure =
        RotorFailure { rotor: 2, time: 10.0, thrust_left: 0.0, reallocated_after: Some(0.2) };
    assert_eq!(rotors.failures, [failure]);
    assert!(rotors.battery.is_some() && rotors.drag.is_some() && rotors.thrust_curve.is_some());
}
