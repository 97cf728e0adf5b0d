//! PX4's topics under their names: NED and FRD, quaternions from body to world.
//!
//! Each has those of PX4's fields whose meaning we have, under PX4's names, types and units.

use ctrl_core::vehicle::WrenchBounds;
use glam::{DQuat, DVec3, Quat, Vec3};

use super::frame::{frd, ned, ned_from_frd, yaw};
use super::moment::{MOTORS, Moment, reference_attitude};
use sim::plant::rotors::BatteryState;
use sim::quantity::Quantity;
use sim::quantity::Value::{self, Quaternion, Single, Time, Vector};

/// A field of a topic.
pub type Field = Quantity<Moment>;

/// Fields that are written together, after the time.
#[derive(Debug)]
pub struct Px4Topic {
    /// Name.
    pub name: &'static str,
    /// Meaning.
    pub meaning: &'static str,
    /// Fields in the order of writing.
    pub fields: &'static [Field],
    /// Fields of types that PX4's topics alone have, after the others.
    pub more: &'static [More],
}

/// A field of a type that PX4's topics alone have.
#[derive(Debug)]
pub struct More {
    /// Name.
    pub name: &'static str,
    /// Unit, `-` for none.
    pub unit: &'static str,
    /// Meaning.
    pub meaning: &'static str,
    /// Type, and the function that reads it.
    pub value: MoreValue,
}

/// The type of such a field together with the function that reads it.
#[derive(Clone, Copy, Debug)]
pub enum MoreValue {
    /// A number for each motor.
    Motors(fn(&Moment) -> [f32; MOTORS]),
    /// A state of an enumeration of PX4.
    State(fn(&Moment) -> u8),
}

const fn field(
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
    value: Value<Moment>,
) -> Field {
    Field { name, field: name, unit, meaning, value }
}

/// The topics for a controller with these bounds; the torque is normalised by its bound, hence left out
/// without one, and so is the battery where there is none.
pub fn topics(bounds: &WrenchBounds, battery: bool) -> impl Iterator<Item = &'static Px4Topic> {
    let limited = bounds.torque_max.max_element() < f32::MAX;
    let torque = limited.then_some(&VEHICLE_TORQUE_SETPOINT);
    ALL.iter().copied().chain(torque).chain(battery.then_some(&BATTERY_STATUS))
}

const ALL: &[&Px4Topic] = &[
    &VEHICLE_ATTITUDE,
    &VEHICLE_ANGULAR_VELOCITY,
    &VEHICLE_LOCAL_POSITION,
    &VEHICLE_ATTITUDE_SETPOINT,
    &VEHICLE_RATES_SETPOINT,
    &VEHICLE_LOCAL_POSITION_SETPOINT,
    &TRAJECTORY_SETPOINT,
    &VEHICLE_THRUST_SETPOINT,
    &ACTUATOR_MOTORS,
    &VEHICLE_STATUS,
];

const SAMPLED: Field = field("timestamp_sample", "us", "as timestamp", Time(|m| m.tick.time));

const VEHICLE_ATTITUDE: Px4Topic = Px4Topic {
    name: "vehicle_attitude",
    meaning: "true attitude",
    fields: &[
        SAMPLED,
        field(
            "q",
            "-",
            "FRD to NED",
            Quaternion(|m| rotation(ned_from_frd(m.tick.truth.attitude))),
        ),
    ],
    more: &[],
};

const VEHICLE_ANGULAR_VELOCITY: Px4Topic = Px4Topic {
    name: "vehicle_angular_velocity",
    meaning: "true body rate",
    fields: &[
        SAMPLED,
        field("xyz", "rad/s", "FRD", Vector(|m| vector(frd(m.tick.truth.rate_body)))),
    ],
    more: &[],
};

const VEHICLE_LOCAL_POSITION: Px4Topic = Px4Topic {
    name: "vehicle_local_position",
    meaning: "true position and velocity",
    fields: &[
        SAMPLED,
        field("x", "m", "north", Single(|m| position(m).x)),
        field("y", "m", "east", Single(|m| position(m).y)),
        field("z", "m", "down", Single(|m| position(m).z)),
        field("vx", "m/s", "north", Single(|m| velocity(m).x)),
        field("vy", "m/s", "east", Single(|m| velocity(m).y)),
        field("vz", "m/s", "down", Single(|m| velocity(m).z)),
        field(
            "heading",
            "rad",
            "from north, positive towards east",
            Single(|m| yaw(ned_from_frd(m.tick.truth.attitude)) as f32),
        ),
    ],
    more: &[],
};

const VEHICLE_ATTITUDE_SETPOINT: Px4Topic = Px4Topic {
    name: "vehicle_attitude_setpoint",
    meaning: "attitude at which the law's error is none, and thrust",
    fields: &[
        field(
            "q_d",
            "-",
            "`q_d`, controller 2 `q_a q_d`; FRD to NED",
            Quaternion(|m| rotation(ned_from_frd(m.attitude_setpoint()))),
        ),
        field("thrust_body", "-", "as vehicle_thrust_setpoint", Vector(normalised_thrust)),
    ],
    more: &[],
};

const VEHICLE_RATES_SETPOINT: Px4Topic = Px4Topic {
    name: "vehicle_rates_setpoint",
    meaning: "body rate at which the law's error is none, and thrust",
    fields: &[
        field(
            "roll",
            "rad/s",
            "`mu` (31), (49), controller 2 with `w_a`; FRD",
            Single(|m| rates(m).x),
        ),
        field("pitch", "rad/s", "the same", Single(|m| rates(m).y)),
        field("yaw", "rad/s", "the same", Single(|m| rates(m).z)),
        field("thrust_body", "-", "as vehicle_thrust_setpoint", Vector(normalised_thrust)),
    ],
    more: &[],
};

const VEHICLE_LOCAL_POSITION_SETPOINT: Px4Topic = Px4Topic {
    name: "vehicle_local_position_setpoint",
    meaning: "the reference",
    fields: &[
        field("x", "m", "north", Single(|m| wanted(m.tick.reference.position_world).x)),
        field("y", "m", "east", Single(|m| wanted(m.tick.reference.position_world).y)),
        field("z", "m", "down", Single(|m| wanted(m.tick.reference.position_world).z)),
        field("vx", "m/s", "north", Single(|m| wanted(m.tick.reference.velocity_world).x)),
        field("vy", "m/s", "east", Single(|m| wanted(m.tick.reference.velocity_world).y)),
        field("vz", "m/s", "down", Single(|m| wanted(m.tick.reference.velocity_world).z)),
        field(
            "acceleration",
            "m/s^2",
            "NED",
            Vector(|m| wanted(m.tick.reference.acceleration_world)),
        ),
        field("yaw", "rad", "heading of the reference", Single(wanted_yaw)),
    ],
    more: &[],
};

const TRAJECTORY_SETPOINT: Px4Topic = Px4Topic {
    name: "trajectory_setpoint",
    meaning: "the reference, as PX4's offboard control takes it",
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
        field("yaw", "rad", "heading of the reference", Single(wanted_yaw)),
    ],
    more: &[],
};

const VEHICLE_THRUST_SETPOINT: Px4Topic = Px4Topic {
    name: "vehicle_thrust_setpoint",
    meaning: "thrust over its upper bound (20)",
    fields: &[SAMPLED, field("xyz", "-", "FRD", Vector(normalised_thrust))],
    more: &[],
};

const ACTUATOR_MOTORS: Px4Topic = Px4Topic {
    name: "actuator_motors",
    meaning: "rotors of the firmware's vehicle, from the allocation of the command",
    fields: &[SAMPLED],
    more: &[More {
        name: "control",
        unit: "-",
        meaning: "thrust over the rotor's limit; NaN while it stands still, and for rotors that are not there",
        value: MoreValue::Motors(|m| m.motors),
    }],
};

const VEHICLE_STATUS: Px4Topic = Px4Topic {
    name: "vehicle_status",
    meaning: "mode, in PX4's numbers",
    fields: &[],
    more: &[
        More {
            name: "arming_state",
            unit: "-",
            meaning: "1 disarmed, 2 armed",
            value: MoreValue::State(|m| m.status.arming_state()),
        },
        More {
            name: "nav_state",
            unit: "-",
            meaning: "3 mission, 4 hold, 5 return, 14 offboard (a flight along a trajectory, too), 17 take-off, 18 land",
            value: MoreValue::State(|m| m.status.navigation_state()),
        },
        More {
            name: "vehicle_type",
            unit: "-",
            meaning: "1, rotary wing",
            value: MoreValue::State(|_| 1),
        },
    ],
};

const VEHICLE_TORQUE_SETPOINT: Px4Topic = Px4Topic {
    name: "vehicle_torque_setpoint",
    meaning: "torque over `M_tau`; controller 2 only",
    fields: &[SAMPLED, field("xyz", "-", "FRD", Vector(normalised_torque))],
    more: &[],
};

const BATTERY_STATUS: Px4Topic = Px4Topic {
    name: "battery_status",
    meaning: "the plant's battery; with `[rotors.battery]` only",
    fields: &[
        field("voltage_v", "V", "at the terminals", Single(|m| battery(m).voltage as f32)),
        field("current_a", "A", "drawn by the rotors", Single(|m| battery(m).current as f32)),
        field("remaining", "-", "rest of the charge", Single(|m| battery(m).charge as f32)),
    ],
    more: &[More {
        name: "connected",
        unit: "-",
        meaning: "1, there is one",
        value: MoreValue::State(|_| 1),
    }],
};

fn battery(m: &Moment) -> BatteryState {
    let none = BatteryState { voltage: f64::NAN, current: f64::NAN, charge: f64::NAN };
    m.tick.battery.unwrap_or(none)
}

fn vector(v: DVec3) -> Vec3 {
    v.as_vec3()
}

fn rotation(q: DQuat) -> Quat {
    q.as_quat()
}

fn position(m: &Moment) -> Vec3 {
    vector(ned(m.tick.truth.position_world))
}

fn velocity(m: &Moment) -> Vec3 {
    vector(ned(m.tick.truth.velocity_world))
}

fn rates(m: &Moment) -> Vec3 {
    vector(frd(m.rate_setpoint_body()))
}

fn wanted(world: Vec3) -> Vec3 {
    vector(ned(world.as_dvec3()))
}

fn wanted_yaw(m: &Moment) -> f32 {
    yaw(ned_from_frd(reference_attitude(&m.tick.reference))) as f32
}

fn normalised_thrust(m: &Moment) -> Vec3 {
    let thrust = f64::from(m.tick.output.wrench.thrust / m.bounds.thrust_max);
    vector(frd(thrust * DVec3::Z))
}

fn normalised_torque(m: &Moment) -> Vec3 {
    vector(frd((m.tick.output.wrench.torque_body / m.bounds.torque_max).as_dvec3()))
}
