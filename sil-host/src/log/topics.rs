//! Our own topics, in every format: SI units, world east-north-up, body forward-left-up,
//! attitudes from body to world. Equation numbers are the paper's.

use super::topic::Value::{Bits, Count, Double, Float, Quaternion, Vector};
use super::topic::{Topic, field, scalar_first, single};
use crate::trace::inertia_estimate;

/// What comes before a topic's name where other topics might be.
pub const PREFIX: &str = "gyrfalcon";

/// Every topic.
pub const TOPICS: &[&Topic] = &[
    &STATE,
    &REFERENCE,
    &ERRORS,
    &WRENCH,
    &DISTURBANCE,
    &ESTIMATES,
    &AUXILIARY,
    &LYAPUNOV,
    &STATUS,
];

const STATE: Topic = Topic {
    name: "state",
    what: "the vehicle's true state",
    fields: &[
        field("position", "m", "`p`, world", Vector(|m| single(m.tick.truth.position_world))),
        field("velocity", "m/s", "`v`, world", Vector(|m| single(m.tick.truth.velocity_world))),
        field("attitude", "-", "`q`", Quaternion(|m| scalar_first(m.tick.truth.attitude))),
        field("rate", "rad/s", "`w`, body", Vector(|m| single(m.tick.truth.rate_body))),
    ],
};

const REFERENCE: Topic = Topic {
    name: "reference",
    what: "what the vehicle should do",
    fields: &[
        field("position", "m", "`p_d`, world", Vector(|m| m.tick.reference.position_world)),
        field("velocity", "m/s", "`p_d'`, world", Vector(|m| m.tick.reference.velocity_world)),
        field(
            "acceleration",
            "m/s^2",
            "`p_d''`, world",
            Vector(|m| m.tick.reference.acceleration_world),
        ),
        field(
            "left",
            "-",
            "`b2d`, desired direction of body y, world",
            Vector(|m| m.tick.reference.left_world),
        ),
    ],
};

const ERRORS: Topic = Topic {
    name: "errors",
    what: "errors of the law, from the truth",
    fields: &[
        field(
            "position",
            "m",
            "`e_p`, world",
            Vector(|m| single(m.tick.evaluation.position_error)),
        ),
        field(
            "attitude",
            "-",
            "`q_e` (27), (46), with the sign that the law chose",
            Quaternion(|m| scalar_first(m.tick.evaluation.attitude_error)),
        ),
        field("rate", "rad/s", "`w_e`, body", Vector(|m| single(m.tick.evaluation.rate_error))),
    ],
};

const WRENCH: Topic = Topic {
    name: "wrench",
    what: "the command, held until the next tick",
    fields: &[
        field("thrust", "N", "`f` (21), along body z", Float(|m| m.tick.output.wrench.thrust)),
        field(
            "torque_demand",
            "N m",
            "`tau_d` (50) before saturation, body; controller 1: the torque itself",
            Vector(|m| m.tick.output.torque_demand_body),
        ),
        field(
            "torque",
            "N m",
            "`tau` (34), (37), body",
            Vector(|m| m.tick.output.wrench.torque_body),
        ),
        field(
            "applied_thrust",
            "N",
            "what acts: the command, unless the scenario has an `[actuation]`",
            Float(|m| m.tick.applied.thrust as f32),
        ),
        field(
            "applied_torque",
            "N m",
            "likewise, body",
            Vector(|m| m.tick.applied.torque_body.as_vec3()),
        ),
    ],
};

const DISTURBANCE: Topic = Topic {
    name: "disturbance",
    what: "what pushes the vehicle until the next tick",
    fields: &[
        field(
            "acceleration",
            "m/s^2",
            "`d1`, world",
            Vector(|m| single(m.tick.disturbance.acceleration_world)),
        ),
        field("torque", "N m", "`d2`, body", Vector(|m| single(m.tick.disturbance.torque_body))),
    ],
};

const ESTIMATES: Topic = Topic {
    name: "estimates",
    what: "what the law used for the unknown parameters",
    fields: &[
        field("mass", "kg", "`1/beta` (14)", Float(|m| 1.0 / m.tick.estimates.inverse_mass)),
        field(
            "inertia",
            "kg m^2",
            "`a_hat` (35), controller 1; `1/theta_hat` (51), controller 2",
            Vector(|m| single(inertia_estimate(&m.tick.estimates))),
        ),
        field(
            "gyroscopic_ratio",
            "-",
            "`Pi_hat` (52), controller 2; zero for controller 1",
            Vector(|m| m.tick.estimates.gyroscopic_ratio),
        ),
    ],
};

const AUXILIARY: Topic = Topic {
    name: "auxiliary",
    what: "auxiliary system of controller 2; at rest for controller 1",
    fields: &[
        field(
            "attitude",
            "-",
            "`q_a` (38)",
            Quaternion(|m| scalar_first(m.tick.auxiliary.attitude.as_dquat())),
        ),
        field("rate", "rad/s", "`w_a` (39)", Vector(|m| m.tick.auxiliary.rate)),
    ],
};

const LYAPUNOV: Topic = Topic {
    name: "lyapunov",
    what: "Lyapunov function, from the truth",
    fields: &[
        field(
            "value",
            "-",
            "V3 (controller 1) or V5 (controller 2)",
            Double(|m| m.tick.evaluation.value),
        ),
        field(
            "parameter_part",
            "-",
            "the part that the parameter errors make up",
            Double(|m| m.tick.evaluation.parameter_part),
        ),
        field(
            "decrease",
            "1/s",
            "the decrease that the theorem promises, (36) or (53)",
            Double(|m| m.tick.evaluation.decrease),
        ),
    ],
};

const STATUS: Topic = Topic {
    name: "status",
    what: "the control tick and what happened in it",
    fields: &[
        field("tick", "-", "control ticks since the start", Count(|m| m.tick.tick)),
        field("bits", "-", "status bits, as in trace.md", Bits(|m| m.tick.output.status.bits())),
    ],
};
