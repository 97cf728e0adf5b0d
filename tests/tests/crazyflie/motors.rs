//! The Crazyflie's four motors between wrench and vehicle: how its firmware shares a wrench among them,
//! what they can give, and the wrench that is left.

use std::cell::Cell;
use std::rc::Rc;

use ctrl_core::vehicle::Wrench;
use glam::{DVec3, Vec3};
use sim::plant::rigid_body::RigidBody;
use sim::plant::vehicle::{Plant, Vehicle};
use sim::plant::{AppliedWrench, Disturbance, PlantParameters, PlantState};
use sim::scenario::Scenario;

/// Most thrust of a motor (N).
const MOTOR_MAX: f64 = 0.12;
/// Distance of a motor from the body's x and y axes: 46 mm arms at 45 degrees (m).
const LEVER: f64 = 0.046 * std::f64::consts::FRAC_1_SQRT_2;
/// Torque about body z per thrust of a motor (m).
const DRAG: f64 = 0.006_992_895;
/// Steps of a motor's command.
const STEPS: f64 = 65_535.0;

/// Signs with which each motor's thrust turns the body: about x, y and z. Front right, rear right, rear
/// left, front left.
const SIGNS: [DVec3; 4] = [
    DVec3::new(-1.0, -1.0, -1.0),
    DVec3::new(-1.0, 1.0, 1.0),
    DVec3::new(1.0, 1.0, -1.0),
    DVec3::new(1.0, -1.0, 1.0),
];

/// The motors' use in a flight.
#[derive(Clone, Copy, Debug)]
pub struct Use {
    /// Ticks in which a motor was at its limit.
    pub limited: u64,
    /// Least thrust of a motor (N).
    pub lowest: f64,
    /// Most thrust of a motor (N).
    pub highest: f64,
}

/// A vehicle behind the motors.
pub struct Motors {
    vehicle: Vehicle,
    used: Rc<Cell<Use>>,
}

impl Motors {
    /// The scenario's vehicle at its start, with ticks of `period` (s); and the motors' use, as it goes.
    pub fn new(scenario: &Scenario, period: f64) -> (Self, Rc<Cell<Use>>) {
        let parameters = PlantParameters::from(scenario.vehicle);
        let body = RigidBody::new(&parameters, period, scenario.plant_steps_per_tick);
        let vehicle = Vehicle::new(body, None, scenario.initial.state());
        let used = Rc::new(Cell::new(Use { limited: 0, lowest: MOTOR_MAX, highest: 0.0 }));
        (Self { vehicle, used: used.clone() }, used)
    }
}

/// Thrust that each motor is asked for (N).
fn share(wrench: &Wrench) -> [f64; 4] {
    let torque = wrench.torque_body.as_dvec3() / DVec3::new(LEVER, LEVER, DRAG);
    SIGNS.map(|signs| 0.25 * (f64::from(wrench.thrust) + signs.dot(torque)))
}

/// Thrust that each motor gives (N): none below zero; if one is asked for more than it can give, all are
/// lowered by the excess, which keeps the torque; in steps of 16 bits.
fn limit(asked: [f64; 4]) -> [f64; 4] {
    let highest = asked.into_iter().fold(0.0, f64::max);
    let excess = (highest - MOTOR_MAX).max(0.0);
    asked.map(|thrust| {
        let given = (thrust.max(0.0) - excess).max(0.0);
        (given / MOTOR_MAX * STEPS).floor() * MOTOR_MAX / STEPS
    })
}

/// The wrench of all motors together.
fn join(thrusts: [f64; 4]) -> Wrench {
    let parts = SIGNS.iter().zip(thrusts).map(|(signs, thrust)| *signs * thrust);
    let torque = parts.sum::<DVec3>() * DVec3::new(LEVER, LEVER, DRAG);
    let torque_body: Vec3 = torque.as_vec3();
    Wrench { thrust: thrusts.iter().sum::<f64>() as f32, torque_body }
}

impl Plant for Motors {
    fn truth(&self) -> &PlantState {
        self.vehicle.truth()
    }

    fn command(&mut self, wrench: &Wrench) -> AppliedWrench {
        let asked = share(wrench);
        let given = limit(asked);
        let mut used = self.used.get();
        let possible = 0.0..=MOTOR_MAX;
        used.limited += u64::from(asked.iter().any(|thrust| !possible.contains(thrust)));
        used.lowest = given.into_iter().fold(used.lowest, f64::min);
        used.highest = given.into_iter().fold(used.highest, f64::max);
        self.used.set(used);
        self.vehicle.command(&join(given))
    }

    fn advance(&mut self, disturbance: &Disturbance) {
        self.vehicle.advance(disturbance);
    }
}

#[test]
fn a_wrench_within_the_limits_comes_out_as_it_went_in() {
    let wrench = Wrench { thrust: 0.28, torque_body: Vec3::new(2e-4, -1e-4, 5e-5) };
    let out = join(limit(share(&wrench)));
    assert!((out.thrust - wrench.thrust).abs() < 1e-5);
    assert!((out.torque_body - wrench.torque_body).abs().max_element() < 5e-7);
}

#[test]
fn the_box_of_the_gains_is_possible_and_more_is_not() {
    let worst = Vec3::new(1.0, 1.0, -1.0); // all three ask most of the rear left motor
    let corner = |thrust, torque| share(&Wrench { thrust, torque_body: worst * torque });
    let most = |thrusts: [f64; 4]| thrusts.into_iter().fold(0.0, f64::max);
    assert!(most(corner(0.42, 2.9e-4)) <= MOTOR_MAX);
    assert!(most(corner(0.42, 3.0e-4)) > MOTOR_MAX);
    // Too much thrust is given up, the torque kept.
    let out = join(limit(corner(0.45, 4e-4)));
    assert!((out.torque_body - worst * 4e-4).abs().max_element() < 5e-7, "{out:?}");
    assert!(out.thrust < 0.43);
}
