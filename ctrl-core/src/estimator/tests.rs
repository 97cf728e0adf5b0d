use core::f32::consts::FRAC_PI_2;
use std::vec::Vec;
use std::{assert, assert_eq, vec};

use glam::{Mat3, Quat, Vec2, Vec3};
use proptest::prelude::*;

use super::alignment::{Alignment, NotAligned};
use super::covariance::{Covariance, Jacobian, Row, STATES};
use super::*;
use crate::rotation::rotate_back;
use crate::vehicle::GRAVITY;

fn estimator() -> Estimator {
    Estimator::new(&EstimatorConfig::EXAMPLE).unwrap()
}

fn resting(index: u32) -> InertialSample {
    // Not twice the same, as of a sensor with noise.
    let noise = 1e-4 * ((index % 7) as f32 - 3.0);
    InertialSample {
        rate_body: Vec3::splat(0.1 * noise),
        specific_force_body: Vec3::new(noise, -noise, GRAVITY + noise),
    }
}

fn capture(index: u32, position: Vec3) -> Measurement {
    Measurement::CapturePosition(position + Vec3::splat(1e-5 * (index % 5) as f32))
}

/// Flies `steps` at rest with motion capture every 10th, which sees `position`.
fn rest(
    estimator: &Estimator,
    state: &mut EstimatorState,
    steps: u32,
    position: Vec3,
) -> Vec<Verdict> {
    let mut verdicts = vec![];
    for index in 0..steps {
        estimator.predict(state, &resting(index));
        if index % 10 == 0 {
            verdicts.push(estimator.correct(state, &capture(index / 10, position)));
        }
    }
    verdicts
}

fn is_finite(state: &EstimatorState) -> bool {
    state.position_world.is_finite()
        && state.velocity_world.is_finite()
        && state.attitude.is_finite()
        && state.rate_body.is_finite()
        && state.gyro_bias.is_finite()
        && state.accelerometer_bias.is_finite()
        && state.covariance_matrix().as_flattened().iter().all(|x| x.is_finite())
}

#[test]
fn prediction_follows_a_turn_under_constant_force() {
    let estimator = estimator();
    let mut state = estimator.start(&VehicleState::at_rest(Vec3::ZERO));
    let (rate, acceleration) = (Vec3::new(0.0, 0.0, FRAC_PI_2), Vec3::new(0.3, -0.2, 0.1));
    for step in 0..1000 {
        let middle = (step as f32 + 0.5) * 1e-3 * FRAC_PI_2;
        let attitude = Quat::from_rotation_z(middle);
        let specific_force_body = rotate_back(attitude, acceleration + GRAVITY * Vec3::Z);
        estimator.predict(&mut state, &InertialSample { rate_body: rate, specific_force_body });
    }
    let vehicle = state.vehicle();
    assert!((vehicle.attitude.dot(Quat::from_rotation_z(FRAC_PI_2)).abs() - 1.0).abs() < 1e-6);
    assert!((vehicle.velocity_world - acceleration).length() < 2e-4, "{vehicle:?}");
    assert!((vehicle.position_world - 0.5 * acceleration).length() < 2e-4);
}

/// `F P F^T + q e_j e_j^T` and a Joseph update with full matrices in f64.
type Dense = [[f64; STATES]; STATES];

fn dense(covariance: &Covariance) -> Dense {
    core::array::from_fn(|i| core::array::from_fn(|j| covariance.element(i, j).into()))
}

fn product(a: &Dense, b: &Dense) -> Dense {
    core::array::from_fn(|i| core::array::from_fn(|j| (0..STATES).map(|k| a[i][k] * b[k][j]).sum()))
}

fn transposed(a: &Dense) -> Dense {
    core::array::from_fn(|i| core::array::from_fn(|j| a[j][i]))
}

fn assert_close(found: &Covariance, expected: &Dense) {
    for i in 0..STATES {
        for j in 0..STATES {
            let scale = (expected[i][i] * expected[j][j]).sqrt();
            let (x, y) = (f64::from(found.element(i, j)), expected[i][j]);
            assert!((x - y).abs() <= 1e-5 * scale, "P[{i}][{j}] = {x}, expected {y}");
        }
    }
}

fn sample_covariance() -> Covariance {
    let mut covariance = Covariance::diagonal(&core::array::from_fn(|k| 0.1 + k as f32));
    let turn = Mat3::from_rotation_y(0.7);
    let jacobian =
        Jacobian { step_period: 0.1, gain_world: Vec3::new(1.0, -0.4, 0.9), bias: -0.1 * turn };
    (0..9).for_each(|_| covariance.propagate(&jacobian));
    covariance
}

#[test]
fn propagation_is_that_of_full_matrices() {
    let mut covariance = sample_covariance();
    let (dt, gain) = (0.1, Vec3::new(0.3, 0.7, -1.0));
    let bias = -0.1 * Mat3::from_rotation_x(1.2);
    let mut f: Dense =
        core::array::from_fn(|i| core::array::from_fn(|j| f64::from(u8::from(i == j))));
    let half = dt / 2.0;
    for k in 0..3 {
        f[1 + k][4 + k] = dt;
        for l in 0..3 {
            let unit = Vec3::from_array(core::array::from_fn(|i| f32::from(u8::from(i == l))));
            let effect = f64::from(unit.cross(gain)[k]);
            f[4 + k][7 + l] = effect;
            f[1 + k][7 + l] = half * effect;
            f[7 + k][10 + l] = bias.col(l)[k].into();
            f[4 + k][13 + l] = bias.col(l)[k].into();
            f[1 + k][13 + l] = half * f64::from(bias.col(l)[k]);
        }
    }
    let expected = product(&product(&f, &dense(&covariance)), &transposed(&f));
    covariance.propagate(&Jacobian { step_period: dt as f32, gain_world: gain, bias });
    assert_close(&covariance, &expected);
}

#[test]
fn noise_of_each_state_is_added_to_its_variance_alone() {
    for j in 0..STATES {
        let mut covariance = sample_covariance();
        let mut expected = dense(&covariance);
        expected[j][j] += 0.75;
        covariance.add_noise(j, 0.75);
        assert_close(&covariance, &expected);
    }
    let mut covariance = sample_covariance();
    covariance.add_noise(STATES, 1.0);
    assert!(covariance.is_sound());
}

#[test]
fn a_correction_is_that_of_joseph() {
    let rows = [
        Row::Position { axis: 0, rate: 0.0 },
        Row::Position { axis: 1, rate: -0.4 },
        Row::Position { axis: 2, rate: 0.2 },
        Row::Velocity(0),
        Row::Velocity(1),
        Row::Velocity(2),
        Row::PastVelocity { axis: 1, attitude: Vec3::new(0.9, 0.0, -0.1), bias: Vec3::splat(0.1) },
        Row::Attitude(Vec3::new(-1.1, 0.4, 1.0)),
        Row::Attitude(Vec3::Y),
        Row::Barometer { bias: 1.0, rate: -0.1 },
        Row::Barometer { bias: 0.0, rate: 0.0 },
        Row::Range { rate: -0.1, attitude: Vec2::new(0.4, -0.3) },
        Row::Flow {
            height: -0.4,
            velocity: Vec3::new(0.8, 0.1, -0.2),
            attitude: Vec3::new(0.5, -0.2, 0.3),
            bias: Vec2::new(0.0, 0.7),
        },
    ];
    for row in rows {
        let mut covariance = sample_covariance();
        let p = dense(&covariance);
        let unit = |k: usize| core::array::from_fn(|i| f32::from(u8::from(i == k)));
        let h: [f64; STATES] = core::array::from_fn(|k| f64::from(row.of(&unit(k))));
        let ph: [f64; STATES] = core::array::from_fn(|i| (0..STATES).map(|j| p[i][j] * h[j]).sum());
        let s = 0.3 + (0..STATES).map(|i| h[i] * ph[i]).sum::<f64>();
        let projection = covariance.project(&row, 0.3);
        assert!((f64::from(projection.variance) - s).abs() < 1e-5 * s);
        let gain = covariance.correct(&projection);
        let mut shrink: Dense =
            core::array::from_fn(|i| core::array::from_fn(|j| f64::from(u8::from(i == j))));
        for i in 0..STATES {
            assert!((f64::from(gain[i]) - ph[i] / s).abs() < 1e-4 * (p[i][i] / s).sqrt());
            for j in 0..STATES {
                shrink[i][j] -= ph[i] / s * h[j];
            }
        }
        let mut expected = product(&product(&shrink, &p), &transposed(&shrink));
        for i in 0..STATES {
            for j in 0..STATES {
                expected[i][j] += ph[i] / s * 0.3 * ph[j] / s;
            }
        }
        for i in 0..STATES {
            for j in 0..STATES {
                let scale = (p[i][i] * p[j][j]).sqrt();
                let found = f64::from(covariance.element(i, j));
                assert!((found - expected[i][j]).abs() < 2e-5 * scale, "{i} {j}");
            }
        }
    }
}

#[test]
fn the_estimate_settles_on_what_is_measured() {
    let estimator = estimator();
    let mut state = estimator.start(&VehicleState::at_rest(Vec3::ZERO));
    let position = Vec3::new(1.0, -0.7, 0.4);
    let verdicts = rest(&estimator, &mut state, 20_000, position);
    assert!(verdicts.iter().all(|verdict| matches!(verdict, Verdict::Accepted { .. })));
    let estimate = estimator.estimate(&state);
    assert!((estimate.vehicle.position_world - position).length() < 1e-3);
    assert!(estimate.vehicle.velocity_world.length() < 1e-2);
    assert!(estimate.validity.contains(Validity::RATE | Validity::POSITION | Validity::VELOCITY));
    assert!(estimate.position_deviation.max_element() < 2e-3);
    assert_eq!(estimate.faults[Source::CapturePosition as usize], None);
    assert_eq!(estimate.faults[Source::Barometer as usize], Some(Fault::Missing));
    assert_eq!(estimate.age, 0.0);
}

#[test]
fn a_stuck_source_is_named_and_no_longer_taken() {
    let estimator = estimator();
    let mut state = estimator.start(&VehicleState::at_rest(Vec3::ZERO));
    let mut verdicts = vec![];
    for index in 0..40 {
        (0..10).for_each(|k| estimator.predict(&mut state, &resting(k + index)));
        verdicts.push(estimator.correct(&mut state, &Measurement::Barometer(0.25)));
    }
    let stuck = verdicts.iter().position(|verdict| *verdict == Verdict::Stuck);
    assert_eq!(stuck, Some(usize::from(EstimatorConfig::EXAMPLE.faults.repetitions) - 1));
    let fault =
        |state: &EstimatorState| estimator.estimate(state).faults[Source::Barometer as usize];
    assert_eq!(fault(&state), Some(Fault::Stuck));
    let verdict = estimator.correct(&mut state, &Measurement::Barometer(0.2));
    assert!(matches!(verdict, Verdict::Accepted { .. }));
    assert_eq!(fault(&state), None);
}

#[test]
fn a_jump_is_rejected_named_and_believed_only_when_nothing_else_is_left() {
    let estimator = estimator();
    let mut state = estimator.start(&VehicleState::at_rest(Vec3::ZERO));
    rest(&estimator, &mut state, 5_000, Vec3::ZERO);
    let before = state.vehicle();
    // Another position source is healthy: the jump is never believed.
    for index in 0..300 {
        (0..10).for_each(|k| estimator.predict(&mut state, &resting(k + index)));
        let far = Vec3::new(40.0 + 0.01 * index as f32, 0.0, 0.0);
        let verdict = estimator.correct(&mut state, &Measurement::GnssPosition(far));
        assert_eq!(verdict, Verdict::Rejected);
        estimator.correct(&mut state, &capture(index, Vec3::ZERO));
    }
    let estimate = estimator.estimate(&state);
    assert_eq!(estimate.faults[Source::GnssPosition as usize], Some(Fault::Jumping));
    assert!((estimate.vehicle.position_world - before.position_world).length() < 2e-3);
    assert_eq!(estimate.restart.count, 0);
    // Motion capture itself jumps to another origin and stays there.
    let moved = Vec3::new(3.0, 0.0, 0.0);
    let verdicts = rest(&estimator, &mut state, 300, moved);
    assert!(verdicts.contains(&Verdict::Rejected) && verdicts.contains(&Verdict::Restarted));
    let restart = estimator.estimate(&state).restart;
    assert_eq!(restart.count, 1);
    assert!((restart.position_shift_world - moved).length() < 0.02, "{restart:?}");
    assert!((state.vehicle().position_world - moved).length() < 0.02);
}

#[test]
fn a_moving_vehicle_restarts_once_where_it_is_now_not_where_it_was_measured() {
    let estimator = estimator();
    let velocity = Vec3::new(2.0, -1.0, 0.5);
    let start = VehicleState { velocity_world: velocity, ..VehicleState::at_rest(Vec3::ZERO) };
    let mut state = estimator.start(&start);
    let (delay, dt) = (EstimatorConfig::EXAMPLE.capture_position.delay, 1e-3);
    assert!(delay >= 0.01, "{delay}");
    for (steps, aside) in [(3_000, Vec3::ZERO), (1_000, Vec3::new(3.0, 0.0, 1.0))] {
        for _ in 0..steps {
            let step = state.step + 1;
            estimator.predict(&mut state, &resting(step));
            if step.is_multiple_of(10) {
                let then = velocity * (dt * step as f32 - delay) + aside;
                estimator.correct(&mut state, &capture(step / 10, then));
            }
        }
        let now = velocity * (dt * state.step as f32) + aside;
        let error = state.vehicle().position_world - now;
        assert!(error.length() < 2e-3, "{aside}: {error}");
    }
    let restart = estimator.estimate(&state).restart;
    assert_eq!(restart.count, 1);
    assert!((restart.position_shift_world - Vec3::new(3.0, 0.0, 1.0)).length() < 5e-3);
}

#[test]
fn inertial_samples_that_stop_or_freeze_cost_validity_and_nothing_else() {
    let estimator = estimator();
    for bad in [InertialSample { rate_body: Vec3::NAN, ..resting(0) }, resting(3)] {
        let mut state = estimator.start(&VehicleState::at_rest(Vec3::ZERO));
        rest(&estimator, &mut state, 5_000, Vec3::ZERO);
        for _ in 0..100 {
            estimator.predict(&mut state, &bad);
        }
        let estimate = estimator.estimate(&state);
        assert!(!estimate.validity.contains(Validity::RATE));
        assert!(matches!(estimate.inertial_fault, Some(Fault::NotFinite | Fault::Stuck)));
        assert!(estimate.age > 0.08 && is_finite(&state));
        rest(&estimator, &mut state, 100, Vec3::ZERO);
        let estimate = estimator.estimate(&state);
        assert!(estimate.validity.contains(Validity::RATE) && estimate.inertial_fault.is_none());
    }
}

#[test]
fn heading_follows_the_field_whatever_the_dip() {
    for dip in [-2.2, 0.0, 1.0] {
        let mut config = EstimatorConfig::EXAMPLE;
        config.magnetic_field_world = Vec3::new(0.3, 2.0, dip * 2.022);
        // A tilt that is not known better takes its part of the innovation where the field dips.
        (config.initial.tilt, config.initial.accelerometer_bias) = (1e-3, 1e-3);
        let estimator = Estimator::new(&config).unwrap();
        let mut state = estimator.start(&VehicleState::at_rest(Vec3::ZERO));
        let north = Vec2::new(0.3, 2.0).normalize();
        let truth = Quat::from_rotation_z(0.1);
        for index in 0..4_000 {
            estimator.predict(&mut state, &resting(index));
            if index % 10 == 0 {
                let field = Vec3::new(north.x, north.y, dip) * (1.0 + 1e-4 * (index % 3) as f32);
                let verdict = estimator
                    .correct(&mut state, &Measurement::Magnetometer(rotate_back(truth, field)));
                assert!(matches!(verdict, Verdict::Accepted { .. }), "{verdict:?}");
                estimator.correct(&mut state, &capture(index, Vec3::ZERO));
            }
        }
        let error = state.vehicle().attitude.conjugate() * truth;
        assert!(error.z.abs() < 5e-3, "dip {dip}: {error}");
    }
}

#[test]
fn alignment_at_rest_finds_attitude_and_gyro_bias() {
    let estimator = estimator();
    for (k, attitude) in [
        Quat::IDENTITY,
        Quat::from_rotation_z(2.0) * Quat::from_rotation_x(0.2),
        Quat::from_rotation_z(-1.1) * Quat::from_rotation_y(-0.3),
    ]
    .into_iter()
    .enumerate()
    {
        let bias = Vec3::new(0.01, -0.02, 0.005);
        let mut alignment = Alignment::default();
        for index in 0..500 {
            let noise = resting(index + k as u32);
            alignment.add(&InertialSample {
                rate_body: bias + noise.rate_body,
                specific_force_body: rotate_back(attitude, noise.specific_force_body),
            });
            alignment.add_field(rotate_back(attitude, Vec3::new(0.0, 20.0, -40.0)));
        }
        let place = Vec3::new(1.0, 2.0, 3.0);
        let state = estimator.aligned(&alignment, 400, place).unwrap();
        let vehicle = state.vehicle();
        assert!((vehicle.attitude.dot(attitude).abs() - 1.0).abs() < 1e-5, "{vehicle:?}");
        assert!((state.gyro_bias() - bias).length() < 1e-4);
        assert_eq!(vehicle.position_world, place);
    }
}

#[test]
fn alignment_refuses_motion_wrong_gravity_and_too_little() {
    let estimator = estimator();
    let with = |sample: &dyn Fn(u32) -> InertialSample| {
        let mut alignment = Alignment::default();
        (0..100).for_each(|index| alignment.add(&sample(index)));
        estimator.aligned(&alignment, 50, Vec3::ZERO).err()
    };
    assert_eq!(with(&resting), None);
    let turning = |_| InertialSample { rate_body: Vec3::X, ..resting(0) };
    assert_eq!(with(&turning), Some(NotAligned::Moving));
    let shaking = |k: u32| InertialSample {
        specific_force_body: Vec3::new(5.0 * ((k % 2) as f32 - 0.5), 0.0, GRAVITY),
        ..resting(k)
    };
    assert_eq!(with(&shaking), Some(NotAligned::Moving));
    let falling = |k| InertialSample { specific_force_body: Vec3::X, ..resting(k) };
    assert_eq!(with(&falling), Some(NotAligned::NotGravity));
    let broken = |k| InertialSample { rate_body: Vec3::NAN, ..resting(k) };
    assert_eq!(with(&broken), Some(NotAligned::Moving));
    let estimator_error = estimator.aligned(&Alignment::default(), 0, Vec3::ZERO).err();
    assert_eq!(estimator_error, Some(NotAligned::TooFew));
}

#[test]
fn configurations_out_of_range_are_refused_by_name() {
    let refused = |change: &dyn Fn(&mut EstimatorConfig)| {
        let mut config = EstimatorConfig::EXAMPLE;
        change(&mut config);
        Estimator::new(&config).err().map(|error| error.parameter)
    };
    assert_eq!(refused(&|_| {}), None);
    assert_eq!(refused(&|c| c.step_period = 0.0), Some("step_period"));
    assert_eq!(refused(&|c| c.inertial.gyro = f32::NAN), Some("inertial.gyro"));
    assert_eq!(refused(&|c| c.initial.tilt = -1.0), Some("initial.tilt"));
    assert_eq!(refused(&|c| c.gnss_position.delay = 5.0), Some("gnss_position"));
    assert_eq!(refused(&|c| c.barometer.deviation = 0.0), Some("barometer"));
    assert_eq!(refused(&|c| c.faults.repetitions = 1), Some("faults.repetitions"));
    assert_eq!(refused(&|c| c.magnetic_field_world = Vec3::Z), Some("magnetic_field_world"));
}

#[test]
fn the_covariance_stays_positive_over_a_long_flight_and_without_measurements() {
    let estimator = estimator();
    let mut state = estimator.start(&VehicleState::at_rest(Vec3::ZERO));
    rest(&estimator, &mut state, 200_000, Vec3::ZERO);
    assert!(state.covariance.is_sound());
    assert_eq!(state.covariance_restarts, 0);
    for index in 0..1_000_000 {
        estimator.predict(&mut state, &resting(index));
        if index % 100_000 == 0 {
            assert!(state.covariance.is_sound() && is_finite(&state));
            let variances: Vec<_> = (0..STATES).map(|k| state.covariance.element(k, k)).collect();
            assert!(variances.iter().all(|variance| *variance > 0.0), "{variances:?}");
        }
    }
    assert!(!estimator.estimate(&state).validity.contains(Validity::POSITION));
}

fn hostile() -> impl Strategy<Value = f32> {
    prop_oneof![
        Just(0.0f32),
        Just(f32::NAN),
        Just(f32::INFINITY),
        Just(f32::NEG_INFINITY),
        Just(f32::MAX),
        Just(f32::MIN_POSITIVE),
        Just(1e-40f32),
        -300.0f32..300.0,
        -1e7f32..1e7,
        any::<f32>(),
    ]
}

fn hostile_vector() -> impl Strategy<Value = Vec3> {
    (hostile(), hostile(), hostile()).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

fn hostile_measurement() -> impl Strategy<Value = Measurement> {
    prop_oneof![
        hostile().prop_map(Measurement::Barometer),
        hostile_vector().prop_map(Measurement::Magnetometer),
        hostile_vector().prop_map(Measurement::GnssPosition),
        hostile_vector().prop_map(Measurement::GnssVelocity),
        hostile_vector().prop_map(Measurement::CapturePosition),
        (hostile_vector(), hostile())
            .prop_map(|(v, w)| Measurement::CaptureAttitude(Quat::from_xyzw(v.x, v.y, v.z, w))),
        hostile().prop_map(Measurement::Rangefinder),
        hostile_vector().prop_map(|v| Measurement::OpticalFlow(v.truncate())),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn no_input_makes_the_estimate_infinite_or_the_covariance_indefinite(
        inputs in prop::collection::vec(
            (hostile_vector(), hostile_vector(), prop::option::of(hostile_measurement()), 1u32..40),
            1..60,
        ),
        start in (hostile_vector(), hostile_vector()),
    ) {
        let estimator = estimator();
        let vehicle = VehicleState {
            position_world: start.0,
            rate_body: start.1,
            ..VehicleState::at_rest(Vec3::ZERO)
        };
        let mut state = estimator.start(&vehicle);
        for (rate_body, specific_force_body, measurement, times) in inputs {
            let sample = InertialSample { rate_body, specific_force_body };
            (0..times).for_each(|_| estimator.predict(&mut state, &sample));
            if let Some(measurement) = measurement {
                estimator.correct(&mut state, &measurement);
            }
            prop_assert!(is_finite(&state), "{:?}", state.vehicle());
            prop_assert!((0..STATES).all(|k| state.covariance.element(k, k) > 0.0));
            let q = state.vehicle().attitude;
            prop_assert!((q.dot(q) - 1.0).abs() < 1e-5);
        }
    }
}
