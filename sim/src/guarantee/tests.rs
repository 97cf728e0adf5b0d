//! The simple monitors on samples that break one guarantee each.

use ctrl_core::controller::StepStatus;
use glam::{DQuat, DVec3, Vec3};

use super::lyapunov::Evaluator;
use super::test_flight::{VEHICLE, both, fly_either, sample};
use super::*;

const CONFIG: GuaranteeConfig = GuaranteeConfig {
    settle_time: 0.0,
    position_error_max: 3.0,
    attitude_error_max: 3.0,
    tilt_error_max: 0.5,
    heading_error_max: 0.5,
    lyapunov_window: 1.0,
    state_error: None,
};

/// Names of the rows that fail after one sample, changed by `change`.
fn failing(config: &ControllerConfig, change: impl FnOnce(&mut Tick)) -> Vec<&'static str> {
    let mut sample = sample(config);
    change(&mut sample);
    let mut guarantees = Guarantees::new(&CONFIG, config, &VEHICLE, &ActuationConfig::default());
    guarantees.observe(&Evaluator::new(config, &VEHICLE).evaluated(&sample));
    let rows = guarantees.verdicts();
    // The balance of V needs two ticks.
    let of_v = |row: &&Verdict| row.name.contains('V') || row.name.contains("Lyapunov");
    let judged = rows.iter().filter(|row| !of_v(row));
    judged.filter(|row| !row.pass).map(|row| row.name).collect()
}

#[test]
fn an_honest_sample_passes() {
    for config in both(0.001) {
        assert_eq!(failing(&config, |_| {}), [""; 0]);
    }
}

#[test]
fn thrust_and_torque_beyond_their_bounds_fail() {
    let [first, second] = both(0.001);
    let thrust = |thrust| move |sample: &mut Tick| sample.output.wrench.thrust = thrust;
    assert_eq!(failing(&first, thrust(1.05)), ["thrust, lowest"]);
    assert_eq!(failing(&first, thrust(24.2)), ["thrust, highest"]);
    assert_eq!(failing(&second, thrust(11.95)), ["thrust, highest"]);
    let beyond = ["thrust, highest", "thrust, highest, against M_f"];
    assert_eq!(failing(&second, thrust(12.01)), beyond);
    assert_eq!(failing(&first, thrust(f32::NAN)), ["thrust, lowest", "thrust, highest"]);
    let torque = |sample: &mut Tick| sample.output.wrench.torque_body.y = -0.050_001;
    assert_eq!(failing(&second, torque), ["torque about y, peak"]);
    assert_eq!(failing(&first, torque), [""; 0], "controller 1 has no such bound");
}

#[test]
fn estimates_outside_their_sets_fail() {
    let [first, second] = both(0.001);
    assert_eq!(failing(&first, |s| s.estimates.inverse_mass = 0.999), ["mass estimate"]);
    assert_eq!(failing(&first, |s| s.estimates.inertia.z = 0.0299), ["inertia estimate"]);
    let theta = |s: &mut Tick| s.estimates.inverse_inertia.x = 1.0 / 0.1201;
    assert_eq!(failing(&second, theta), ["inertia estimate"]);
    let ratio = |s: &mut Tick| s.estimates.gyroscopic_ratio = Vec3::new(0.0, -1.0001, 0.0);
    assert_eq!(failing(&second, ratio), ["gyroscopic ratio estimate"]);
}

#[test]
fn errors_of_the_true_vehicle_and_faults_fail() {
    let [first, _] = both(0.001);
    let moved = |s: &mut Tick| s.truth.position_world += DVec3::new(6.0, 0.0, 0.0);
    assert_eq!(failing(&first, moved), ["position error after settling"]);
    let tilted = |s: &mut Tick| s.truth.attitude *= DQuat::from_rotation_y(0.6);
    assert_eq!(failing(&first, tilted), ["tilt error (b3, b3d) after settling"]);
    let yawed = |s: &mut Tick| s.truth.attitude *= DQuat::from_rotation_z(0.6);
    assert_eq!(failing(&first, yawed), ["heading error (b2, b2d) after settling"]);
    let fault = |s: &mut Tick| s.output.status |= StepStatus::STATE_INVALID;
    assert_eq!(failing(&first, fault), ["steps with a fault"]);
}

#[test]
fn a_flight_that_ends_before_it_may_settle_fails() {
    let [first, _] = both(0.001);
    let config = GuaranteeConfig { settle_time: 1.0, ..CONFIG };
    let mut guarantees = Guarantees::new(&config, &first, &VEHICLE, &ActuationConfig::default());
    let sample = sample(&first);
    guarantees.observe(&Evaluator::new(&first, &VEHICLE).evaluated(&sample));
    let rows = guarantees.verdicts();
    let row = rows.iter().find(|row| row.name.starts_with("position error")).unwrap();
    assert!(!row.pass && row.observed.is_none());
}

#[test]
fn blocks_of_ticks_end_in_the_rows_of_single_ones() {
    let short = GuaranteeConfig { lyapunov_window: 0.05, ..CONFIG };
    for config in both(0.001) {
        let mut ticks = Vec::new();
        fly_either(&config, 0.203, |_| {}, |tick| ticks.push(*tick));
        let rows = |size: usize| {
            let mut monitors =
                Guarantees::new(&short, &config, &VEHICLE, &ActuationConfig::default());
            ticks.chunks(size).for_each(|ticks| monitors.observe_ticks(ticks));
            assert_eq!(monitors.verdicts(), monitors.verdicts(), "asking changes nothing");
            monitors.verdicts()
        };
        let single = rows(1);
        assert!(single.iter().all(|row| row.observed.is_some()), "{single:#?}");
        for size in [2, 3, 4, 5] {
            assert_eq!(rows(size), single, "{size}");
        }
    }
}
