//! PX4's topics, for tools that know them by name: NED and FRD, quaternions from body to world.
//!
//! Each has those of PX4's fields whose meaning we have, under PX4's names, types and units.

use ctrl_core::vehicle::WrenchBounds;
use glam::{DVec3, Vec3};

use super::frame::{frd, ned, ned_from_frd, yaw};
use super::moment::{Moment, microseconds, reference_attitude};
use super::topic::Value::{Count, Float, Quaternion, Vector};
use super::topic::{Field, Topic, field, scalar_first, single};

/// The topics for a controller with these bounds: without a bound of the torque there is nothing to
/// normalise it by.
pub fn topics(bounds: &WrenchBounds) -> impl Iterator<Item = &'static Topic> {
    let torque = (bounds.torque_max < f32::MAX).then_some(&VEHICLE_TORQUE_SETPOINT);
    ALL.iter().copied().chain(torque)
}

const ALL: &[&Topic] = &[
    &VEHICLE_ATTITUDE,
    &VEHICLE_ANGULAR_VELOCITY,
    &VEHICLE_LOCAL_POSITION,
    &VEHICLE_ATTITUDE_SETPOINT,
    &VEHICLE_RATES_SETPOINT,
    &VEHICLE_LOCAL_POSITION_SETPOINT,
    &TRAJECTORY_SETPOINT,
    &VEHICLE_THRUST_SETPOINT,
];

const SAMPLED: Field =
    field("timestamp_sample", "us", "as timestamp", Count(|m| microseconds(m.tick.time)));

const VEHICLE_ATTITUDE: Topic = Topic {
    name: "vehicle_attitude",
    what: "true attitude",
    fields: &[
        SAMPLED,
        field(
            "q",
            "-",
            "FRD to NED",
            Quaternion(|m| scalar_first(ned_from_frd(m.tick.truth.attitude))),
        ),
    ],
};

const VEHICLE_ANGULAR_VELOCITY: Topic = Topic {
    name: "vehicle_angular_velocity",
    what: "true body rate",
    fields: &[
        SAMPLED,
        field("xyz", "rad/s", "FRD", Vector(|m| single(frd(m.tick.truth.rate_body)))),
    ],
};

const VEHICLE_LOCAL_POSITION: Topic = Topic {
    name: "vehicle_local_position",
    what: "true position and velocity",
    fields: &[
        SAMPLED,
        field("x", "m", "north", Float(|m| position(m).x)),
        field("y", "m", "east", Float(|m| position(m).y)),
        field("z", "m", "down", Float(|m| position(m).z)),
        field("vx", "m/s", "north", Float(|m| velocity(m).x)),
        field("vy", "m/s", "east", Float(|m| velocity(m).y)),
        field("vz", "m/s", "down", Float(|m| velocity(m).z)),
        field(
            "heading",
            "rad",
            "from north, positive towards east",
            Float(|m| yaw(ned_from_frd(m.tick.truth.attitude)) as f32),
        ),
    ],
};

const VEHICLE_ATTITUDE_SETPOINT: Topic = Topic {
    name: "vehicle_attitude_setpoint",
    what: "attitude at which the law's error is none, and thrust",
    fields: &[
        field(
            "q_d",
            "-",
            "`q_d`, controller 2 `q_a q_d`; FRD to NED",
            Quaternion(|m| scalar_first(ned_from_frd(m.attitude_setpoint()))),
        ),
        field("thrust_body", "-", "as vehicle_thrust_setpoint", Vector(normalised_thrust)),
    ],
};

const VEHICLE_RATES_SETPOINT: Topic = Topic {
    name: "vehicle_rates_setpoint",
    what: "body rate at which the law's error is none, and thrust",
    fields: &[
        field(
            "roll",
            "rad/s",
            "`mu` (31), (49), controller 2 with `w_a`; FRD",
            Float(|m| rates(m).x),
        ),
        field("pitch", "rad/s", "the same", Float(|m| rates(m).y)),
        field("yaw", "rad/s", "the same", Float(|m| rates(m).z)),
        field("thrust_body", "-", "as vehicle_thrust_setpoint", Vector(normalised_thrust)),
    ],
};

const VEHICLE_LOCAL_POSITION_SETPOINT: Topic = Topic {
    name: "vehicle_local_position_setpoint",
    what: "the reference",
    fields: &[
        field("x", "m", "north", Float(|m| wanted(m.tick.reference.position_world).x)),
        field("y", "m", "east", Float(|m| wanted(m.tick.reference.position_world).y)),
        field("z", "m", "down", Float(|m| wanted(m.tick.reference.position_world).z)),
        field("vx", "m/s", "north", Float(|m| wanted(m.tick.reference.velocity_world).x)),
        field("vy", "m/s", "east", Float(|m| wanted(m.tick.reference.velocity_world).y)),
        field("vz", "m/s", "down", Float(|m| wanted(m.tick.reference.velocity_world).z)),
        field(
            "acceleration",
            "m/s^2",
            "NED",
            Vector(|m| wanted(m.tick.reference.acceleration_world)),
        ),
        field("yaw", "rad", "heading of the reference", Float(wanted_yaw)),
    ],
};

const TRAJECTORY_SETPOINT: Topic = Topic {
    name: "trajectory_setpoint",
    what: "the reference, as PX4's offboard control takes it",
    fields: &[
        field("position", "m", "NED", Vector(|m| wanted(m.tick.reference.position_world))),
        field("velocity", "m/s", "NED", Vector(|m| wanted(m.tick.reference.velocity_world))),
        field(
            "acceleration",
            "m/s^2",
            "NED",
            Vector(|m| wanted(m.tick.reference.acceleration_world)),
        ),
        field("jerk", "m/s^3", "NED", Vector(|m| wanted(m.tick.reference.jerk_world))),
        field("yaw", "rad", "heading of the reference", Float(wanted_yaw)),
    ],
};

const VEHICLE_THRUST_SETPOINT: Topic = Topic {
    name: "vehicle_thrust_setpoint",
    what: "thrust over its upper bound (20)",
    fields: &[SAMPLED, field("xyz", "-", "FRD", Vector(normalised_thrust))],
};

const VEHICLE_TORQUE_SETPOINT: Topic = Topic {
    name: "vehicle_torque_setpoint",
    what: "torque over `M_tau`; controller 2 only",
    fields: &[SAMPLED, field("xyz", "-", "FRD", Vector(normalised_torque))],
};

fn position(m: &Moment<'_>) -> Vec3 {
    single(ned(m.tick.truth.position_world))
}

fn velocity(m: &Moment<'_>) -> Vec3 {
    single(ned(m.tick.truth.velocity_world))
}

fn rates(m: &Moment<'_>) -> Vec3 {
    single(frd(m.rate_setpoint_body()))
}

fn wanted(world: Vec3) -> Vec3 {
    single(ned(world.as_dvec3()))
}

fn wanted_yaw(m: &Moment<'_>) -> f32 {
    yaw(ned_from_frd(reference_attitude(&m.tick.reference))) as f32
}

fn normalised_thrust(m: &Moment<'_>) -> Vec3 {
    let thrust = f64::from(m.tick.output.wrench.thrust / m.bounds.thrust_max);
    single(frd(thrust * DVec3::Z))
}

fn normalised_torque(m: &Moment<'_>) -> Vec3 {
    single(frd((m.tick.output.wrench.torque_body / m.bounds.torque_max).as_dvec3()))
}
