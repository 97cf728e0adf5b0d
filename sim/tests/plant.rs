//! The plant against physics: what a free body conserves, how fast RK4 converges, and what the
//! disturbances promise.

use ctrl_core::vehicle::{GRAVITY, Wrench};
use glam::{DQuat, DVec3, Vec3};
use sim::plant::disturbance::{
    Constant, DisturbanceConfig, DisturbanceProcess, DisturbanceSource, Gust, Noise, Sinusoid,
};
use sim::plant::rigid_body::RigidBody;
use sim::plant::{Disturbance, PlantParameters, PlantState};

const BODY: PlantParameters = PlantParameters::new(0.85, DVec3::new(0.03, 0.05, 0.1));
const CALM: Disturbance = Disturbance::NONE;

fn tumbling() -> PlantState {
    PlantState {
        position_world: DVec3::new(1.0, -2.0, 3.0),
        velocity_world: DVec3::new(4.0, 5.0, -6.0),
        attitude: DQuat::from_xyzw(0.1, -0.7, 0.4, 0.58).normalize(),
        rate_body: DVec3::new(3.0, 0.1, -2.0),
    }
}

fn fly(body: &RigidBody, wrench: &Wrench, ticks: u32) -> PlantState {
    (0..ticks).fold(tumbling(), |state, _| body.advance(&state, wrench, &CALM))
}

fn energy(state: &PlantState) -> f64 {
    let gravity = f64::from(GRAVITY);
    0.5 * BODY.mass * state.velocity_world.length_squared()
        + BODY.mass * gravity * state.position_world.z
        + 0.5 * state.rate_body.dot(BODY.inertia * state.rate_body)
}

fn angular_momentum_world(state: &PlantState) -> DVec3 {
    state.attitude * (BODY.inertia * state.rate_body)
}

#[test]
fn free_body_conserves_energy_and_momentum() {
    let body = RigidBody::new(&BODY, 1e-3, 1);
    let (start, end) = (tumbling(), fly(&body, &Wrench::default(), 10_000));
    assert!((energy(&end) - energy(&start)).abs() < 1e-9 * energy(&start).abs());
    let drift = angular_momentum_world(&end) - angular_momentum_world(&start);
    assert!(drift.length() < 1e-10 * angular_momentum_world(&start).length(), "{drift}");
    assert!((end.attitude.length() - 1.0).abs() < 4.0 * f64::EPSILON);
    // It did tumble: momentum is conserved in the world frame, not in the body.
    let body_momentum = |state: &PlantState| BODY.inertia * state.rate_body;
    assert!((body_momentum(&end) - body_momentum(&start)).length() > 0.05);
}

#[test]
fn free_fall_is_the_textbook_parabola() {
    let end = fly(&RigidBody::new(&BODY, 1e-3, 1), &Wrench::default(), 2_000);
    let (start, time) = (tumbling(), 2.0);
    let fall = DVec3::Z * (0.5 * f64::from(GRAVITY) * time * time);
    let expected = start.position_world + time * start.velocity_world - fall;
    assert!((end.position_world - expected).length() < 1e-10);
}

#[test]
fn level_thrust_of_the_weight_hovers() {
    let body = RigidBody::new(&BODY, 1e-3, 1);
    let level = PlantState {
        attitude: DQuat::IDENTITY,
        velocity_world: DVec3::ZERO,
        rate_body: DVec3::ZERO,
        ..tumbling()
    };
    let weight = Wrench { thrust: BODY.mass as f32 * GRAVITY, torque_body: Vec3::ZERO };
    let end = (0..1_000).fold(level, |state, _| body.advance(&state, &weight, &CALM));
    assert!((end.position_world - level.position_world).length() < 1e-6);
}

#[test]
fn constant_torque_spins_a_principal_axis_linearly() {
    let body = RigidBody::new(&BODY, 1e-3, 1);
    let still = PlantState { rate_body: DVec3::ZERO, attitude: DQuat::IDENTITY, ..tumbling() };
    let held = Disturbance { torque_body: DVec3::new(0.0, 0.0, 0.2), ..CALM };
    let end = (0..1_000).fold(still, |state, _| body.advance(&state, &Wrench::default(), &held));
    assert!((end.rate_body.z - 0.2 / 0.1).abs() < 1e-12);
    let turned = DQuat::from_rotation_z(0.5 * 0.2 / 0.1);
    assert!(end.attitude.angle_between(turned) < 1e-7);
}

/// Halving the step divides the error of a fourth-order method by 16.
#[test]
fn converges_with_fourth_order() {
    let wrench = Wrench { thrust: 9.0, torque_body: Vec3::new(0.05, -0.02, 0.04) };
    let end = |ticks: u32| fly(&RigidBody::new(&BODY, 1.0 / f64::from(ticks), 1), &wrench, ticks);
    let exact = end(6_400);
    let error = |ticks| {
        let state = end(ticks);
        [
            (state.position_world - exact.position_world).length(),
            (state.velocity_world - exact.velocity_world).length(),
            (state.attitude - exact.attitude).length(),
            (state.rate_body - exact.rate_body).length(),
        ]
    };
    for (coarse, fine) in error(50).iter().zip(error(100)) {
        let ratio = coarse / fine;
        assert!((13.0..20.0).contains(&ratio), "error ratio {ratio}: {coarse:e} to {fine:e}");
    }
}

#[test]
fn sub_steps_equal_shorter_ticks() {
    let wrench = Wrench { thrust: 9.0, torque_body: Vec3::new(0.05, -0.02, 0.04) };
    let split = fly(&RigidBody::new(&BODY, 4e-3, 4), &wrench, 100);
    let short = fly(&RigidBody::new(&BODY, 1e-3, 1), &wrench, 400);
    assert_eq!(split, short);
}

fn every_disturbance() -> DisturbanceConfig {
    DisturbanceConfig {
        constant: Some(Constant {
            acceleration: DVec3::new(0.1, -0.2, 0.0),
            torque: DVec3::new(0.0, 0.0, 0.01),
        }),
        noise: Some(Noise { acceleration: 0.05, torque: DVec3::new(0.02, 0.01, 0.02) }),
        sinusoid: Some(Sinusoid {
            frequency: 3.0,
            acceleration: DVec3::new(0.0, 0.3, 0.0),
            torque: DVec3::splat(0.01),
        }),
        gust: Some(Gust { hold: 0.1, acceleration: 0.4, torque: DVec3::splat(0.03) }),
        dryden: None,
    }
}

fn sequence(config: &DisturbanceConfig, seed: u64) -> Vec<Disturbance> {
    let mut process = DisturbanceProcess::new(config, seed, 1e-3);
    (0..20_000).map(|_| process.advance(&tumbling())).collect()
}

#[test]
fn disturbances_stay_inside_their_bounds_and_use_them() {
    let (acceleration_bound, torque_bound) = every_disturbance().bounds();
    assert_eq!(acceleration_bound, 0.2 + 0.05 + 0.3 + 0.4);
    let z = 0.01 + 0.02 + 0.01 + 0.03;
    assert_eq!(torque_bound, DVec3::new(0.02 + 0.01 + 0.03, 0.01 + 0.01 + 0.03, z));
    let start = (0.0f64, DVec3::ZERO);
    let largest = sequence(&every_disturbance(), 1).iter().fold(start, |max, now| {
        let acceleration = now.acceleration_world.abs().max_element();
        (max.0.max(acceleration), max.1.max(now.torque_body.abs()))
    });
    assert!(largest.0 <= acceleration_bound && largest.0 > 0.8 * acceleration_bound);
    let share = largest.1 / torque_bound;
    assert!(share.max_element() <= 1.0 && share.min_element() > 0.8, "{largest:?}");
}

#[test]
fn disturbances_repeat_with_their_seed_only() {
    let config = every_disturbance();
    assert_eq!(sequence(&config, 7), sequence(&config, 7));
    assert_ne!(sequence(&config, 7), sequence(&config, 8));
}

#[test]
fn an_added_gust_leaves_the_noise_as_it_was() {
    let noise = DisturbanceConfig { noise: every_disturbance().noise, ..Default::default() };
    let with_gust = DisturbanceConfig {
        gust: Some(Gust { hold: 0.1, acceleration: 0.0, torque: DVec3::splat(0.0) }),
        ..noise
    };
    assert_eq!(sequence(&noise, 7), sequence(&with_gust, 7));
}

/// The first draw of seed 0, so that a new version of a crate cannot change flights unnoticed.
#[test]
fn noise_is_pinned_to_the_bit() {
    let noise = Noise { acceleration: 1.0, torque: DVec3::splat(1.0) };
    let config = DisturbanceConfig { noise: Some(noise), ..Default::default() };
    let first = DisturbanceProcess::new(&config, 0, 1e-3).advance(&tumbling());
    // Xoshiro256++ from SplitMix64(0): 0x53175d61490b23df, 0x61da6f3dc380d507, ...
    let halves = [0x490b_23df_u32, 0x5317_5d61, 0xc380_d507, 0x61da_6f3d];
    let expected = halves.map(|bits| f64::from(bits as i32) / 2f64.powi(31));
    let DVec3 { x, y, z } = first.acceleration_world;
    assert_eq!([x, y, z, first.torque_body.x], expected);
}

#[test]
fn noise_is_centred_and_uniform() {
    let noise = Noise { acceleration: 1.0, torque: DVec3::splat(1.0) };
    let draws = sequence(&DisturbanceConfig { noise: Some(noise), ..Default::default() }, 3);
    let count = draws.len() as f64;
    for axis in 0..3 {
        let mean = draws.iter().map(|d| d.acceleration_world[axis]).sum::<f64>() / count;
        let square = draws.iter().map(|d| d.torque_body[axis].powi(2)).sum::<f64>() / count;
        assert!(mean.abs() < 0.015, "mean {mean}");
        assert!((square - 1.0 / 3.0).abs() < 0.01, "mean square {square}");
    }
}
