//! The logged quantities by topic.

use super::Quantity;
use super::table::*;

/// Quantities of one instant that a log writes together.
#[derive(Clone, Copy, Debug)]
pub struct Topic {
    /// Name, lower case with underscores.
    pub name: &'static str,
    /// Meaning.
    pub meaning: &'static str,
    /// Quantities in the order of writing.
    pub quantities: &'static [Quantity],
}

/// Every topic.
pub const TOPICS: &[Topic] = &[
    Topic {
        name: "state",
        meaning: "the vehicle's true state",
        quantities: &[POSITION, VELOCITY, ATTITUDE, RATE],
    },
    Topic {
        name: "reference",
        meaning: "desired motion",
        quantities: &[
            REFERENCE_POSITION,
            REFERENCE_VELOCITY,
            REFERENCE_ACCELERATION,
            REFERENCE_LEFT,
        ],
    },
    Topic {
        name: "errors",
        meaning: "errors of the law, from the truth",
        quantities: &[POSITION_ERROR, ATTITUDE_ERROR, RATE_ERROR],
    },
    Topic {
        name: "wrench",
        meaning: "the command, held until the next tick",
        quantities: &[
            THRUST,
            TORQUE_DEMAND,
            TORQUE,
            APPLIED_THRUST,
            APPLIED_TORQUE,
            MODELLED_TORQUE,
        ],
    },
    Topic {
        name: "disturbance",
        meaning: "disturbance of the vehicle, held until the next tick",
        quantities: &[DISTURBANCE_ACCELERATION, DISTURBANCE_TORQUE],
    },
    Topic {
        name: "estimates",
        meaning: "estimates of the unknown parameters that the law used",
        quantities: &[
            MASS_ESTIMATE,
            INERTIA_ESTIMATE,
            GYROSCOPIC_RATIO_ESTIMATE,
            LASTING_ACCELERATION_ESTIMATE,
            LASTING_TORQUE_ESTIMATE,
        ],
    },
    Topic {
        name: "auxiliary",
        meaning: "auxiliary system of controller 2; at rest for controller 1",
        quantities: &[AUXILIARY_ATTITUDE, AUXILIARY_RATE],
    },
    Topic {
        name: "lyapunov",
        meaning: "Lyapunov function, from the truth",
        quantities: &[LYAPUNOV, LYAPUNOV_PARAMETERS, LYAPUNOV_DECREASE],
    },
    Topic {
        name: "status",
        meaning: "the control tick and its events",
        quantities: &[TICK, STATUS],
    },
];
