//! Actuator dynamics against exact solutions, and their effect on scenarios and guarantees.

use ctrl_core::vehicle::{GRAVITY, Wrench};
use glam::{DQuat, DVec3, Vec3};
use sim::guarantee::{Guarantees, Requirement, Verdict};
use sim::observer::Observer;
use sim::plant::actuation::{ActuationConfig, Actuators};
use sim::plant::rigid_body::RigidBody;
use sim::plant::{AppliedWrench, Disturbance, PlantParameters, PlantState};
use sim::scenario::{BUILT_IN, LoadedScenario};
use sim::tick::Tick;

const BODY: PlantParameters = PlantParameters::new(0.85, DVec3::new(0.03, 0.05, 0.1));
const CALM: Disturbance = Disturbance::NONE;
const IDEAL: ActuationConfig =
    ActuationConfig { thrust_max: None, torque_max: None, delay: None, rotor_lag: None };
const STILL: PlantState = PlantState {
    position_world: DVec3::ZERO,
    velocity_world: DVec3::ZERO,
    attitude: DQuat::IDENTITY,
    rate_body: DVec3::ZERO,
};

/// Flies `ticks` of `dt` under one command from `start`.
fn fly(
    config: &ActuationConfig,
    start: PlantState,
    (dt, sub_steps, ticks): (f64, u32, u32),
    command: Wrench,
) -> PlantState {
    let body = RigidBody::new(&BODY, dt, sub_steps);
    let mut actuators = Actuators::new(config, &BODY, &body).expect("not ideal");
    (0..ticks).fold(start, |state, _| {
        actuators.take(&command);
        actuators.advance(&body, &state, &CALM)
    })
}

fn weight() -> f64 {
    f64::from(BODY.mass as f32 * GRAVITY)
}

/// Acceleration of a level vehicle under `thrust` (m/s^2).
fn climb(thrust: f64) -> f64 {
    thrust / BODY.mass - f64::from(GRAVITY)
}

#[test]
fn nothing_between_is_ideal() {
    let body = RigidBody::new(&BODY, 1e-3, 1);
    let none = ActuationConfig { delay: Some(0.0), rotor_lag: Some(0.0), ..IDEAL };
    let short = ActuationConfig { delay: Some(0.4e-3), ..IDEAL };
    for config in [IDEAL, none, short] {
        assert!(Actuators::new(&config, &BODY, &body).is_none());
    }
}

#[test]
fn limits_that_never_act_change_no_bit() {
    for built_in in BUILT_IN {
        let end = |changes: &[&str]| {
            let changes: Vec<_> = changes.iter().map(ToString::to_string).collect();
            let loaded = LoadedScenario::open(built_in.name, &changes).expect("valid");
            let mut flight = loaded.flight().expect("valid");
            flight.advance(1_000);
            *flight.truth()
        };
        let far = ["actuation.thrust_max=1000", "actuation.torque_max=1000"];
        for steps in ["plant_steps_per_tick=1", "plant_steps_per_tick=3"] {
            assert_eq!(end(&[steps, far[0], far[1]]), end(&[steps]), "{}", built_in.name);
        }
    }
}

#[test]
fn a_delayed_climb_starts_later() {
    let thrust = 10.0f32;
    let command = Wrench { thrust, torque_body: Vec3::ZERO };
    for (delay, sub_steps) in [(0.012, 1), (0.0135, 4), (0.1, 1), (0.0005, 2)] {
        let config = ActuationConfig { delay: Some(delay), ..IDEAL };
        let end = fly(&config, STILL, (1e-3, sub_steps, 500), command);
        let (before, after) = (climb(weight()), climb(thrust.into()));
        let speed = before * delay + after * (0.5 - delay);
        assert!((end.velocity_world.z - speed).abs() < 1e-12, "{delay}: {end:?} {speed}");
        let later = 0.5 - delay;
        let way = 0.5 * (before * delay * (delay + 2.0 * later) + after * later * later);
        assert!((end.position_world.z - way).abs() < 1e-12, "{delay}: {end:?} {way}");
    }
}

#[test]
fn a_lagging_climb_and_spin_are_exponential() {
    let command = Wrench { thrust: 10.0, torque_body: Vec3::new(0.0, 0.0, 0.01) };
    let (time, torque) = (0.2, f64::from(0.01f32));
    for lag in [1e-5, 0.003, 0.03, 0.5] {
        let config = ActuationConfig { rotor_lag: Some(lag), ..IDEAL };
        let end = fly(&config, STILL, (1e-3, 1, 200), command);
        // The integral of 1 - e^(-t/T).
        let gained = time + lag * (-time / lag).exp_m1();
        let speed = climb(weight()) * time + (10.0 - weight()) / BODY.mass * gained;
        assert!((end.velocity_world.z - speed).abs() < 1e-12, "{lag}: {end:?}");
        assert!((end.rate_body.z - torque / BODY.inertia.z * gained).abs() < 1e-13, "{lag}");
        let twice = 0.5 * time * time - lag * gained;
        let way = 0.5 * climb(weight()) * time * time + (10.0 - weight()) / BODY.mass * twice;
        // Of the position RK4 makes an error that a step of the lag's own length shows.
        let tolerance = if lag > 0.02 { 1e-9 } else { 1e-6 };
        assert!((end.position_world.z - way).abs() < tolerance, "{lag}: {end:?} {way}");
    }
}

#[test]
fn a_delayed_lag_is_the_lag_later() {
    let command = Wrench { thrust: 10.0, torque_body: Vec3::ZERO };
    let config = ActuationConfig { delay: Some(0.05), rotor_lag: Some(0.02), ..IDEAL };
    let end = fly(&config, STILL, (1e-3, 1, 200), command);
    let (later, lag) = (0.15, 0.02f64);
    let gained = later + lag * (-later / lag).exp_m1();
    let speed = climb(weight()) * 0.2 + (10.0 - weight()) / BODY.mass * gained;
    assert!((end.velocity_world.z - speed).abs() < 1e-12);
}

#[test]
fn limits_act_on_what_lags() {
    let command = Wrench { thrust: 20.0, torque_body: Vec3::new(0.0, 0.0, -3.0) };
    let (thrust_max, torque_max) = (Some(9.0), Some(DVec3::new(1.0, 1.0, 0.25)));
    let config = ActuationConfig { thrust_max, torque_max, rotor_lag: Some(1e-6), ..IDEAL };
    let end = fly(&config, STILL, (1e-3, 1, 1_000), command);
    assert!((end.velocity_world.z - climb(9.0)).abs() < 1e-5, "{end:?}");
    assert!((end.rate_body.z + 0.25 / BODY.inertia.z).abs() < 1e-5, "{end:?}");
}

#[test]
fn runge_kutta_keeps_its_fourth_order_under_a_lag() {
    let tumbling = PlantState {
        velocity_world: DVec3::new(4.0, 5.0, -6.0),
        attitude: DQuat::from_xyzw(0.1, -0.7, 0.4, 0.58).normalize(),
        rate_body: DVec3::new(3.0, 0.1, -2.0),
        ..STILL
    };
    let command = Wrench { thrust: 11.0, torque_body: Vec3::new(0.3, -0.2, 0.1) };
    let config = ActuationConfig { rotor_lag: Some(0.1), ..IDEAL };
    // The same ticks in more and more plant steps: the command is held over each of them.
    let end = |steps| fly(&config, tumbling, (0.02, steps, 50), command);
    let exact = end(64);
    let error = |steps| {
        let state = end(steps);
        (state.position_world - exact.position_world).length()
            + (state.velocity_world - exact.velocity_world).length()
            + (state.rate_body - exact.rate_body).length()
            + (state.attitude - exact.attitude).length()
    };
    for (coarse, fine) in [(1, 2), (2, 4)] {
        let ratio = error(coarse) / error(fine);
        assert!((12.0..20.0).contains(&ratio), "{coarse}: {ratio}");
    }
}

/// The applied wrench at each tick of a flight, and its verdicts.
struct ActuationRecorder {
    guarantees: Guarantees,
    applied: Vec<AppliedWrench>,
    commanded: Vec<AppliedWrench>,
}

impl Observer for ActuationRecorder {
    fn observe(&mut self, tick: &Tick) {
        self.guarantees.observe(tick);
        self.applied.push(tick.applied);
        self.commanded.push(tick.output.wrench.into());
    }
}

fn watched(name: &str, changes: &[&str], ticks: u64) -> ActuationRecorder {
    let changes: Vec<_> = changes.iter().map(ToString::to_string).collect();
    let loaded = LoadedScenario::open(name, &changes).unwrap_or_else(|error| panic!("{error}"));
    let scenario = loaded.scenario();
    let mut watch = ActuationRecorder {
        guarantees: scenario.monitors(),
        applied: Vec::new(),
        commanded: Vec::new(),
    };
    loaded.flight().expect("valid").observe(ticks, &mut watch);
    watch
}

fn row<'a>(rows: &'a [Verdict], start: &str) -> &'a Verdict {
    rows.iter().find(|row| row.name.starts_with(start)).unwrap_or_else(|| panic!("{start}"))
}

#[test]
fn samples_show_what_acts_at_their_instant() {
    let ideal = watched("paper-saturated", &[], 100);
    assert_eq!(ideal.applied, ideal.commanded);
    let late = watched("paper-saturated", &["actuation.delay=0.007"], 100);
    assert_eq!(late.applied[7..], late.commanded[..93]);
    assert!(late.applied[..7].iter().all(|wrench| wrench.torque_body == DVec3::ZERO));
    let lagging = watched("paper-saturated", &["actuation.rotor_lag=0.02"], 100);
    let (now, next) = (lagging.applied[50].thrust, lagging.applied[51].thrust);
    let dt = f64::from(0.001f32);
    let expected =
        lagging.commanded[50].thrust + (now - lagging.commanded[50].thrust) * (-dt / 0.02).exp();
    assert!((next - expected).abs() < 1e-12, "{next} {expected}");
}

#[test]
fn ticks_beyond_the_rotors_are_left_out_and_all_others_judged() {
    // Beyond this the free controller 1 asks for more only at the start of the paper's flight.
    let changes = ["actuation.torque_max=0.5"];
    let watch = watched("paper-robust-adaptive", &changes, 20_000);
    let rows = watch.guarantees.verdicts();
    let cut = row(&rows, "ticks with a command beyond the rotor limits").observed.unwrap();
    assert!((10.0..1_000.0).contains(&cut), "{cut}");
    assert_eq!(row(&rows, "ticks excluded from the balance check").observed, Some(cut));
    let balance = row(&rows, "Lyapunov balance residual");
    assert_eq!(balance.requirement, Requirement::AtMost(0.0));
    assert!(balance.pass, "{balance:?}");
    let torque = row(&rows, "applied torque");
    assert_eq!(torque.observed, Some(0.5));
    assert!(torque.pass);
}

#[test]
fn limits_do_not_hide_a_broken_balance() {
    // The evaluator believes in a vehicle whose rotors are never beyond their limits.
    let changes: Vec<_> = vec!["actuation.torque_max=0.1".to_owned()];
    let loaded = LoadedScenario::open("paper-robust-adaptive", &changes).expect("valid");
    let mut scenario = loaded.scenario().clone();
    scenario.actuation.torque_max = Some(DVec3::splat(10.0));
    let mut watch = ActuationRecorder {
        guarantees: scenario.monitors(),
        applied: Vec::new(),
        commanded: Vec::new(),
    };
    loaded.flight().expect("valid").observe(2_000, &mut watch);
    assert!(!row(&watch.guarantees.verdicts(), "Lyapunov balance residual").pass);
}

#[test]
fn under_delay_or_lag_v_is_information() {
    for change in ["actuation.delay=0.004", "actuation.rotor_lag=0.01"] {
        let rows = watched("paper-saturated", &[change], 3_000).guarantees.verdicts();
        let balance = row(&rows, "Lyapunov balance residual");
        assert_eq!(balance.requirement, Requirement::Information);
        assert!(
            balance.observed.unwrap() > 0.0,
            "{change}: the vehicle does otherwise: {balance:?}"
        );
        assert!(row(&rows, "increase of V over a window").pass);
        assert!(row(&rows, "disturbance term").requirement == Requirement::AtMost(0.0));
        assert!(row(&rows, "torque about x").pass, "the law keeps its own limit");
    }
}

#[test]
fn rows_about_the_rotors_appear_only_with_them() {
    let rows = watched("paper-saturated", &[], 10).guarantees.verdicts();
    assert!(rows.iter().all(|row| !row.name.starts_with("applied")));
    let rows = watched("paper-saturated", &["actuation.delay=0.01"], 10).guarantees.verdicts();
    assert_eq!(row(&rows, "applied thrust").requirement, Requirement::Information);
    assert!(rows.iter().all(|row| !row.name.starts_with("ticks with a command beyond")));
}

fn fault(change: &str) -> String {
    match LoadedScenario::open("paper-saturated", &[change.to_owned()]) {
        Ok(_) => panic!("`{change}` was accepted"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn impossible_actuation_is_named() {
    for (change, end) in [
        ("actuation.delay=-0.01", "actuation.delay: -0.01 must be in [0, 1] s"),
        ("actuation.delay=1.5", "actuation.delay: 1.5 must be in [0, 1] s"),
        ("actuation.delay=nan", "actuation.delay: NaN must be in [0, 1] s"),
        ("actuation.rotor_lag=inf", "actuation.rotor_lag: inf must be in [0, 10] s"),
        ("actuation.thrust_max=0", "actuation.thrust_max: 0 must be positive"),
        ("actuation.torque_max=-1", "actuation.torque_max: -1 must be positive"),
    ] {
        assert_eq!(fault(change), format!("--set {change}: {end}"));
    }
    assert!(fault("actuation.rotor_log=1").ends_with("did you mean `rotor_lag`?"));
    let built_in = BUILT_IN[0].text;
    let text = built_in.replace("[vehicle]", "[actuation]\ndelay = 2.0\n[vehicle]");
    let line = 2 + built_in.lines().position(|line| line == "[vehicle]").expect("a line");
    let error = LoadedScenario::parse("my.toml", &text, &[]).expect_err("refused").to_string();
    assert_eq!(error, format!("my.toml:{line}: actuation.delay: 2 must be in [0, 1] s"));
}

fn broken(name: &str, change: &str) -> Vec<String> {
    let loaded = LoadedScenario::open(name, &[change.to_owned()]).expect("valid");
    loaded.scenario().broken_assumptions()
}

#[test]
fn violated_assumptions_are_reported() {
    let none: Vec<String> = Vec::new();
    assert_eq!(broken("paper-saturated", "actuation={torque_max=0.05, thrust_max=12}"), none);
    assert_eq!(broken("paper-saturated", "actuation={delay=0, rotor_lag=0}"), none);
    assert_eq!(broken("paper-saturated", "actuation.delay=0.0004"), none, "less than half a step");
    assert_eq!(
        broken("paper-saturated", "actuation={torque_max=0.04, thrust_max=10}"),
        [
            "the rotors are limited to 10 N of thrust, the law may command 11.888",
            "the rotors are limited to 0.04 N m per axis, the law may command 0.05"
        ]
    );
    assert_eq!(
        broken("paper-saturated", "actuation.torque_max=[0.05, 0.06, 0.01]"),
        ["the rotors are limited to 0.01 N m about z, the law may command 0.05"]
    );
    assert_eq!(
        broken("paper-robust-adaptive", "actuation.torque_max=0.5"),
        ["the rotors are limited to 0.5 N m per axis, the law may command any"]
    );
    assert_eq!(
        broken("paper-saturated", "actuation={delay=0.0123, rotor_lag=0.02}"),
        [
            "commands act with a delay of 0.012 s",
            "thrust and torque follow the command with a time constant of 0.02 s"
        ]
    );
}

#[test]
fn the_documented_table_is_one() {
    let document = include_str!("../../docs/plant.md");
    let table = document.split("```toml").nth(1).and_then(|rest| rest.split("```").next());
    let text = format!("{}\n{}", BUILT_IN[0].text, table.expect("a table"));
    let loaded = LoadedScenario::parse("documented", &text, &[]).expect("valid");
    let ActuationConfig { thrust_max, torque_max, delay, rotor_lag } = loaded.scenario().actuation;
    assert_eq!(torque_max, Some(DVec3::splat(0.05)));
    assert_eq!([thrust_max, delay, rotor_lag], [Some(10.0), Some(0.008), Some(0.03)]);
}
