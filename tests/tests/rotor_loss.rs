//! A hexarotor under the firmware's flight control, by its sensors and in wind, loses a rotor: found by the motion, and flown on.

use ctrl_core::allocation::{RotorSet, RotorWatchConfig, slabs};
use ctrl_core::controller::TrackingController;
use ctrl_core::mode::{Command, Mode};
use ctrl_core::trajectory::Trajectory;
use ctrl_core::vehicle::VehicleState;
use firmware::flight_control::{FlightControl, Health, Inputs};
use firmware::state_sample::StateSample;
use firmware::vehicle::VEHICLE;
use glam::Vec3;
use rayon::prelude::*;
use sim::plant::disturbance::{DisturbanceProcess, DisturbanceSource};
use sim::plant::vehicle::Plant;
use sim::scenario::{LoadedScenario, Scenario};
use sim::state_source::StateSource;

const HEXA: &str = r#"frame={ring={spins=["anticlockwise","anticlockwise","clockwise","clockwise","anticlockwise","clockwise"], arm=0.25, first_angle_deg=30.0, torque_ratio=0.016, thrust={lower=0.05, upper=4.0}}}"#;

/// What is known of the scenarios' vehicle: their inertia, the bound of their torques, and their rotors.
const WATCH: RotorWatchConfig = RotorWatchConfig {
    inertia: Vec3::new(0.0486, 0.0486, 0.098),
    disturbance_torque: 0.05,
    rotor_lag: 0.03,
    smoothing_time: 0.05,
    share: 0.6,
    time: 0.03,
};

/// Flights of each case.
const FLIGHTS: u64 = if cfg!(feature = "exhaustive") { 50 } else { 2 };
/// Time of the failure and end of a flight (s): long enough for the errors to settle before and after.
const FAILURE: f64 = 45.0;
const END: f64 = 60.0;

/// Rotors without which this frame keeps its yaw; without the others it keeps roll, pitch and thrust, and the tracking is lost.
const KEEPS_YAW: usize = 4;
/// Time before the start (s).
const STANDS: f64 = 10.0;

/// What a flight showed.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    /// Time of the first detection (s) and the rotors that were found.
    found_at: Option<f64>,
    failed: RotorSet,
    /// Largest distance of the truth from the reference over the last 5 s (m).
    error: f64,
}

/// The scenario `name` as a hexarotor with a rotor that is dead from [`FAILURE`] on, if there is one.
fn scenario(name: &str, changes: &[&str], dead: Option<usize>, seed: u64) -> Scenario {
    let failure = dead.map_or(String::new(), |rotor| {
        format!(", failures=[{{rotor={rotor}, time={FAILURE}, thrust_left=0}}]")
    });
    let mut all = vec![format!("rotors={{{HEXA}{failure}}}"), format!("seed={seed}")];
    all.extend(changes.iter().map(|change| (*change).to_owned()));
    LoadedScenario::open(name, &all).unwrap_or_else(|error| panic!("{error}")).scenario().clone()
}

fn fly(scenario: &Scenario, watch: Option<&RotorWatchConfig>) -> Seen {
    let law = scenario.controller.build().expect("valid");
    let geometry = scenario.rotors.as_ref().expect("rotors").frame.geometry();
    let mut control =
        FlightControl::<{ slabs(6) }>::new(&law, &VEHICLE.supervisor, &geometry).expect("valid");
    if let Some(watch) = watch {
        control.set_rotor_watch(watch, &geometry).expect("valid");
    }
    let period = f64::from(law.step_period());
    let start = scenario.initial.state();
    let mut vehicle = scenario.vehicle(start, period).expect("valid");
    let mut source = StateSource::new(scenario, law.step_period(), &start).expect("valid");
    let mut disturbance = DisturbanceProcess::new(&scenario.disturbance, scenario.seed, period);
    let trajectory = scenario.trajectory.build(law.step_period()).expect("valid");
    let inputs = |state: VehicleState, reference, command| Inputs {
        sample: Some(StateSample { state, age_ticks: 0 }),
        reference,
        command,
        overrun: false,
        fault: false,
        outputs_off: false,
        kill: false,
        health: Health::default(),
    };
    // It stands at its start until the estimate has settled: the height at which it stood tells when it is in the air.
    for _ in 0..(STANDS / period) as u64 {
        let measured = source.measure(vehicle.truth());
        control.tick(&inputs(measured, trajectory.reference(0), None));
    }
    let measured = source.measure(vehicle.truth());
    control.tick(&inputs(measured, trajectory.reference(0), Some(Command::Arm)));
    let mut seen = Seen::default();
    for tick in 0..(END / period) as u64 {
        let time = tick as f64 * period;
        let reference = trajectory.reference(tick);
        let wanted = reference.position_world.as_dvec3();
        let measured = source.measure(vehicle.truth());
        let reference = source.shifted(&reference).unwrap_or(reference);
        let command = (tick == 0).then_some(Command::Start);
        let outputs = control.tick(&inputs(measured, reference, command));
        assert_eq!(outputs.mode, Mode::Flying);
        seen.failed = control.failed_rotors();
        if !seen.failed.is_empty() {
            seen.found_at.get_or_insert(time);
        }
        let mut held = disturbance.advance(vehicle.truth());
        vehicle.command_thrusts(outputs.thrusts.as_ref()).expect("rotors");
        vehicle.add_drag(&mut held);
        vehicle.advance(&held);
        if time > END - 5.0 {
            let error = (vehicle.truth().position_world - wanted).length();
            seen.error = if error.is_nan() { f64::INFINITY } else { seen.error.max(error) };
        }
    }
    seen
}

/// Hover in 8 m/s of Dryden wind and 5 m/s along a figure of eight in gusts, by GNSS and either inertial unit.
const CASES: [(&str, &[&str]); 3] = [
    ("sensors-wind", &[]),
    ("sensors-lemniscate", &[]),
    ("sensors-lemniscate", &["sensors.imu=\"bmi088\"", "vehicle.inertia=[0.042, 0.055, 0.09]"]),
];

fn flights() -> impl ParallelIterator<Item = (&'static str, &'static [&'static str], u64)> {
    let all =
        CASES.iter().flat_map(|(name, changes)| (0..FLIGHTS).map(|seed| (*name, *changes, seed)));
    all.collect::<Vec<_>>().into_par_iter()
}

#[test]
fn a_dead_rotor_is_found_within_a_fifth_of_a_second_and_the_flight_goes_on() {
    flights().for_each(|(name, changes, seed)| {
        let dead = (seed % 6) as usize;
        let scenario = scenario(name, changes, Some(dead), seed);
        let seen = fly(&scenario, Some(&WATCH));
        println!("{name}, seed {seed}: {seen:?}");
        assert_eq!(seen.failed, RotorSet::rotor(dead), "{name}, seed {seed}");
        let after = seen.found_at.expect("found") - FAILURE;
        assert!((0.0..0.2).contains(&after), "{name}, seed {seed}: found after {after} s");
        let most = scenario.guarantees.position_error_max;
        assert!(dead >= KEEPS_YAW || seen.error < most, "{name}, seed {seed}: {} m", seen.error);
    });
}

#[test]
fn a_whole_hexarotor_in_the_same_wind_raises_no_alarm() {
    flights().for_each(|(name, changes, seed)| {
        let seen = fly(&scenario(name, changes, None, 1000 + seed), Some(&WATCH));
        assert_eq!(seen.found_at, None, "{name}, seed {seed}: {:?}", seen.failed);
    });
}

#[test]
fn without_the_detection_the_same_failure_costs_the_tracking() {
    let seen = fly(&scenario("sensors-wind", &[], Some(0), 0), None);
    let found = fly(&scenario("sensors-wind", &[], Some(0), 0), Some(&WATCH));
    assert!(seen.failed.is_empty() && seen.error > 5.0 * found.error, "{seen:?} {found:?}");
}
