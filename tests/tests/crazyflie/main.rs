//! The Crazyflie's app (`integrations/crazyflie`) in closed loop with the simulated vehicle: through the C
//! interface it gives the bits of the core in Rust, and recovers from 23 degrees of roll within the limits
//! of the Crazyflie's motors.

mod app;
mod gains;
mod motors;
mod set_point;
mod twin;

use ctrl_core::controller::{StepOutput, StepStatus};
use ctrl_core::trajectory::{CircleConfig, Heading, TrajectoryConfig};
use glam::{DVec3, Vec3};
use sil_host::tune::propose;
use sil_host::tune::request::WantedOptions;
use sim::closed_loop::ObservedController;
use sim::observer::Observer;
use sim::plant::PlantState;
use sim::scenario::{LoadedScenario, Scenario, flight_with};
use sim::tick::Tick;

use app::App;
use motors::{Motors, Use};
use twin::Twin;

const SANITIZERS: [&str; 2] = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"];

/// The scenario with the gains.
fn scenario(changes: &[&str]) -> Scenario {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../integrations/crazyflie/roll-recovery.toml");
    let changes: Vec<_> = changes.iter().map(ToString::to_string).collect();
    LoadedScenario::open(path, &changes).expect("a scenario").scenario().clone()
}

/// Every tick of a flight.
#[derive(Default)]
struct Recording {
    truth: Vec<PlantState>,
    outputs: Vec<StepOutput>,
}

impl Observer for Recording {
    fn observe(&mut self, tick: &Tick) {
        self.truth.push(tick.truth);
        self.outputs.push(tick.output);
    }
}

/// Flies `scenario` under `controller` with the Crazyflie's motors.
fn fly(controller: impl ObservedController, scenario: &Scenario) -> (Recording, Use) {
    let period = f64::from(controller.step_period());
    let ticks = (scenario.duration / period).round() as u64;
    let (motors, used) = Motors::new(scenario, period);
    let mut flight = flight_with(controller, scenario).expect("a flight").with_plant(motors);
    let mut recording = Recording::default();
    flight.observe(ticks, &mut recording);
    (recording, used.get())
}

/// The same flight through the C interface and in Rust: every output and every state has the same bits.
fn assert_same_bits(through_c: &Recording, in_rust: &Recording) {
    let bits = |output: &StepOutput| {
        let [x, y, z] = output.wrench.torque_body.to_array().map(f32::to_bits);
        (output.wrench.thrust.to_bits(), x, y, z, output.status)
    };
    assert_eq!(through_c.outputs.len(), in_rust.outputs.len());
    for (tick, (c, rust)) in through_c.outputs.iter().zip(&in_rust.outputs).enumerate() {
        assert_eq!(bits(c), bits(rust), "tick {tick}");
    }
    assert_eq!(through_c.truth, in_rust.truth);
}

/// Angle between body z and the vertical (deg).
fn tilt(state: &PlantState) -> f64 {
    (state.attitude * DVec3::Z).z.acos().to_degrees()
}

#[test]
fn recovers_from_23_degrees_of_roll_with_the_bits_of_rust() {
    let scenario = scenario(&[]);
    let (through_c, motors) = fly(App::start("plain", &[]), &scenario);
    let (in_rust, _) = fly(Twin::new(&scenario.controller), &scenario);
    assert_same_bits(&through_c, &in_rust);

    let first = &through_c.truth[0];
    assert!((tilt(first) - 23.0).abs() < 1e-3, "starts at {} degrees", tilt(first));
    assert!((first.attitude * DVec3::Z).y < -0.3, "a roll to the right");
    // Nearly level after a second, then back where it started: on the plant's truth.
    let distance = |state: &PlantState| state.position_world.distance(DVec3::Z);
    let drift = through_c.truth.iter().map(distance).fold(0.0, f64::max);
    let worst = through_c.truth[1000..].iter().map(tilt).fold(0.0, f64::max);
    let error = through_c.truth[20_000..].iter().map(distance).fold(0.0, f64::max);
    let saturated = |output: &&StepOutput| output.status.contains(StepStatus::TORQUE_SATURATED);
    let saturated = through_c.outputs.iter().filter(saturated).count();
    println!(
        "roll of 23 degrees: drift {drift:.3} m, {worst:.2} degrees after 1 s, {error:.4} m after 20 s, \
         torque saturated in {saturated} ticks; {motors:?}"
    );
    assert!(drift < 1.5, "drifts by {drift} m");
    assert!(worst < 6.0, "tilts by {worst} degrees after a second");
    assert!(error < 0.03, "hovers {error} m off");
    // The box is twice as large about x and y as one number for all axes would let it be.
    assert!(saturated > 5, "torque was saturated in {saturated} ticks only");
    assert!(!through_c.outputs.iter().any(|output| output.status.intersects(StepStatus::FAULT)));
    // The box of the gains lies inside what the motors give.
    assert_eq!(motors.limited, 0, "ticks in which a motor was at its limit");
}

#[test]
fn a_moving_set_point_gives_the_bits_of_rust_under_sanitizers() {
    let changes = [
        "duration=20",
        "initial.tilt_deg=60",
        "initial.tilt_direction_deg=40",
        "initial.rate_body=[2.0, -1.0, 0.5]",
    ];
    let mut scenario = scenario(&changes);
    scenario.trajectory = TrajectoryConfig::Circle(CircleConfig {
        centre_world: Vec3::Z,
        radius: 1.0,
        angular_rate: 0.5,
        heading: Heading::Tangent,
    });
    let (through_c, _) = fly(App::start("sanitized", &SANITIZERS), &scenario);
    let (in_rust, _) = fly(Twin::new(&scenario.controller), &scenario);
    assert_same_bits(&through_c, &in_rust);
    let last = through_c.truth.last().expect("a flight");
    assert!((last.position_world - DVec3::Z).length() < 1.3 && tilt(last) < 5.0, "{last:?}");
}

/// The comparison must be able to fail.
#[test]
fn other_gains_give_other_bits() {
    let scenario = scenario(&["duration=0.2"]);
    let (through_c, _) = fly(App::start("other", &[]), &scenario);
    let mut changed = scenario.controller;
    changed.cascade_mut().k3 *= 1.000_001;
    let (in_rust, _) = fly(Twin::new(&changed), &scenario);
    // The motors' steps may hide so small a difference from the vehicle.
    assert_ne!(through_c.outputs, in_rust.outputs);
}

#[test]
fn gains_of_the_scenario_are_those_that_tune_proposes() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../integrations/crazyflie/vehicle.toml");
    let proposal =
        propose(file, WantedOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scenario(&[]).controller, proposal.law);
}

#[test]
fn gains_of_the_app_are_those_of_the_scenario() {
    gains::check(&scenario(&[]).controller);
}
