use super::*;
use crate::plant::PlantParameters;
use crate::plant::contact::{ContactConfig, QUADROTOR};
use crate::plant::rigid_body::RigidBody;

const PARAMETERS: PlantParameters = PlantParameters::new(1.0, DVec3::new(0.05, 0.05, 0.1));
const G: f64 = 9.81;
const CALM: Disturbance = Disturbance::NONE;

fn state(height: f64) -> PlantState {
    PlantState {
        position_world: DVec3::new(1.0, 2.0, height),
        velocity_world: DVec3::ZERO,
        attitude: DQuat::from_rotation_z(0.7),
        rate_body: DVec3::ZERO,
    }
}

fn vehicle_in(truth: PlantState, config: &ContactConfig) -> GroundedVehicle {
    vehicle_every(1e-3, truth, config)
}

fn vehicle_every(dt: f64, truth: PlantState, config: &ContactConfig) -> GroundedVehicle {
    let body = RigidBody::new(&PARAMETERS, dt, 1);
    let contact = Contact::new(config, PARAMETERS.mass, 0.0, dt);
    GroundedVehicle::new(Vehicle::new(body, None, truth), contact)
}

fn vehicle(height: f64) -> GroundedVehicle {
    vehicle_in(state(height), &QUADROTOR)
}

fn fly(vehicle: &mut GroundedVehicle, thrust: f32, held: &Disturbance, ticks: u32) {
    for _ in 0..ticks {
        vehicle.command(&Wrench { thrust, ..Wrench::default() });
        vehicle.advance(held);
    }
}

fn push(x: f64) -> Disturbance {
    Disturbance { acceleration_world: DVec3::X * x, ..CALM }
}

/// Angle between body z and the vertical (rad).
fn tilt(vehicle: &GroundedVehicle) -> f64 {
    libm::acos((vehicle.truth().attitude * DVec3::Z).z.min(1.0))
}

#[test]
fn stands_without_creeping_and_rises_on_its_springs_as_thrust_takes_the_weight() {
    let mut vehicle = vehicle(0.0);
    let start = *vehicle.truth();
    for thrust in [0.0f32, 5.0, 9.0] {
        fly(&mut vehicle, thrust, &CALM, 2000);
        assert!(vehicle.stands());
        let moved = vehicle.truth().position_world - start.position_world;
        let expected = 1e-3 * f64::from(thrust) / G;
        assert!((moved - DVec3::Z * expected).length() < 1e-6, "{thrust} N: {moved}");
    }
    fly(&mut vehicle, 10.0, &CALM, 500);
    assert!(!vehicle.stands() && vehicle.truth().position_world.z > 0.01);
}

#[test]
fn touches_down_with_the_speed_of_a_fall_and_comes_to_rest_on_its_feet_with_its_heading() {
    let mut vehicle = vehicle(1.0);
    fly(&mut vehicle, 0.0, &CALM, 3000);
    let truth = vehicle.truth();
    assert!(vehicle.stands());
    assert!((truth.position_world - DVec3::new(1.0, 2.0, 0.0)).length() < 1e-6, "{truth:?}");
    assert!(tilt(&vehicle) < 1e-6);
    let forward = truth.attitude * DVec3::X;
    assert!((forward - DVec3::new(0.7f64.cos(), 0.7f64.sin(), 0.0)).length() < 1e-6);
    // The feet reach the surface a sag above where it rests.
    let expected = (2.0 * G * (1.0 - 1e-3)).sqrt();
    assert!((vehicle.touchdown_speed() - expected).abs() < 0.01, "{}", vehicle.touchdown_speed());
}

#[test]
fn leaves_the_ground_with_the_restitution_of_its_springs_and_dampers() {
    // Stiff against the weight: x'' + 2 z w x' + w^2 x = 0 until the force, not the place, is zero.
    for damping in [0.05f64, 0.2, 0.5] {
        let config = ContactConfig { damping, ..QUADROTOR };
        let mut vehicle = vehicle_every(2e-4, state(2.0), &config);
        let (mut before, mut after) = (0.0f64, 0.0f64);
        for _ in 0..3500 {
            fly(&mut vehicle, 0.0, &CALM, 1);
            let climb = vehicle.truth().velocity_world.z;
            (before, after) = (before.min(climb), after.max(climb));
        }
        let damped = (1.0 - damping * damping).sqrt();
        let restitution = libm::exp(
            -damping / damped * libm::atan2(2.0 * damping * damped, 2.0 * damping * damping - 1.0),
        );
        let seen = -after / before;
        assert!((seen - restitution).abs() < 0.02, "{damping}: {seen}, expected {restitution}");
    }
}

#[test]
fn slides_to_rest_over_the_distance_of_dry_friction() {
    for friction in [0.2, 0.7] {
        let config = ContactConfig { friction, ..QUADROTOR };
        let start = PlantState { velocity_world: DVec3::new(1.0, 0.0, 0.0), ..state(1e-9) };
        let mut vehicle = vehicle_in(start, &config);
        fly(&mut vehicle, 0.0, &CALM, 3000);
        let way = vehicle.truth().position_world.x - 1.0;
        let expected = 1.0 / (2.0 * friction * G);
        assert!(
            vehicle.stands() && (way - expected).abs() < 0.02 * expected + 1e-3,
            "{way}, {expected}"
        );
    }
}

#[test]
fn sticks_below_the_limit_of_friction_and_accelerates_by_what_is_beyond_it() {
    let mut sticking = vehicle(0.0);
    fly(&mut sticking, 0.0, &push(0.9 * 0.7 * G), 3000);
    let moved = sticking.truth().position_world - DVec3::new(1.0, 2.0, 0.0);
    // The springs along the ground stretch by the push over their stiffness, and the vehicle leans; no more.
    assert!(moved.length() < 3e-3 && sticking.stands(), "{moved}");
    // Low friction, so that it does not topple.
    let slippery = ContactConfig { friction: 0.2, ..QUADROTOR };
    let mut sliding = vehicle_in(state(0.0), &slippery);
    fly(&mut sliding, 0.0, &push(3.0), 1000);
    let speed = sliding.truth().velocity_world.x;
    assert!((speed - (3.0 - 0.2 * G)).abs() < 0.02, "{speed}");
}

#[test]
fn tips_over_a_pair_of_feet_where_the_push_passes_them() {
    // Feet 0.1 m aside along x as along y and 0.1 m below: with the heading along x the weight holds up to a push of g.
    let level = PlantState { attitude: DQuat::IDENTITY, ..state(0.0) };
    let grippy = ContactConfig { friction: 2.0, ..QUADROTOR };
    for (part, tips) in [(0.9, false), (1.15, true)] {
        let mut vehicle = vehicle_in(level, &grippy);
        // Slowly: a sudden push swings further on the springs.
        for i in 0..2000 {
            fly(&mut vehicle, 0.0, &push(part * G * f64::from(i) / 2000.0), 1);
        }
        fly(&mut vehicle, 0.0, &push(part * G), 1500);
        assert_eq!(tilt(&vehicle) > 0.5, tips, "{part}: {}", tilt(&vehicle));
    }
}

#[test]
fn lies_where_it_falls_upside_down_and_does_not_right_itself() {
    let falling = PlantState { attitude: DQuat::from_rotation_x(3.0), ..state(0.5) };
    let mut vehicle = vehicle_in(falling, &QUADROTOR);
    fly(&mut vehicle, 0.0, &CALM, 4000);
    assert!(vehicle.stands() && tilt(&vehicle) > 3.0, "{}", tilt(&vehicle));
    // The rotors push it into the ground.
    fly(&mut vehicle, 10.0, &CALM, 1000);
    assert!(vehicle.stands() && tilt(&vehicle) > 3.0);
}

#[test]
fn above_the_ground_every_bit_is_that_of_a_vehicle_without_it() {
    let mut free = vehicle(0.5).vehicle().clone();
    let mut grounded = vehicle(0.5);
    let gust = Disturbance { torque_body: DVec3::new(0.1, -0.2, 0.05), ..push(0.3) };
    for _ in 0..200 {
        let command = Wrench { thrust: 9.0, ..Wrench::default() };
        free.command(&command);
        free.advance(&gust);
        fly(&mut grounded, 9.0, &gust, 1);
        assert_eq!(free.truth(), grounded.truth());
    }
    assert!(!grounded.stands());
}
