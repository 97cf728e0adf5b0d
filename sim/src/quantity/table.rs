//! Definition of every quantity. World axes are east, north, up; body axes forward, left, up;
//! attitudes take body to world.

use ctrl_core::controller::Auxiliary;
use glam::{DQuat, DVec3, Quat, Vec3};

use super::Quantity;
use super::Value::{Bits, Count, Double, Quaternion, Single, Time, Vector};
use crate::guarantee::tracking;

macro_rules! quantities {
    ($($constant:ident: $name:literal, $field:literal, $unit:literal, $meaning:literal, $value:expr;)*) => {
        $(
            #[doc = concat!("`", $name, "` (", $unit, "): ", $meaning, ".")]
            pub const $constant: Quantity = Quantity {
                name: $name,
                field: $field,
                unit: $unit,
                meaning: $meaning,
                value: $value,
            };
        )*
    };
}

// Constant, name, field of its topic, unit, meaning, type with the function that reads it.
quantities! {
    TICK: "tick", "tick", "-", "control ticks since the start", Count(|t| t.tick);
    TIME: "time", "time", "s", "`tick` times the step period", Time(|t| t.time);

    POSITION: "position", "position", "m", "`p`, world",
        Vector(|t| vector(t.truth.position_world));
    HEIGHT: "height", "height", "m", "`z` component of `p`", Double(|t| t.truth.position_world.z);
    VELOCITY: "velocity", "velocity", "m/s", "`v`, world",
        Vector(|t| vector(t.truth.velocity_world));
    ATTITUDE: "attitude", "attitude", "-", "`q`", Quaternion(|t| quaternion(t.truth.attitude));
    RATE: "rate", "rate", "rad/s", "`w`, body", Vector(|t| vector(t.truth.rate_body));

    REFERENCE_POSITION: "reference_position", "position", "m", "`p_d`, world",
        Vector(|t| t.reference.position_world);
    REFERENCE_HEIGHT: "reference_height", "height", "m", "`z` component of `p_d`",
        Single(|t| t.reference.position_world.z);
    REFERENCE_VELOCITY: "reference_velocity", "velocity", "m/s", "`p_d'`, world",
        Vector(|t| t.reference.velocity_world);
    REFERENCE_ACCELERATION: "reference_acceleration", "acceleration", "m/s^2", "`p_d''`, world",
        Vector(|t| t.reference.acceleration_world);
    REFERENCE_LEFT: "reference_left", "left", "-", "`b2d`, desired direction of body y, world",
        Vector(|t| t.reference.left_world);

    POSITION_ERROR: "position_error", "position", "m", "`e_p`, world",
        Vector(|t| vector(t.evaluation.position_error));
    ATTITUDE_ERROR: "attitude_error", "attitude", "-",
        "`q_e` (27), (46), with the sign that the law chose",
        Quaternion(|t| quaternion(t.evaluation.attitude_error));
    RATE_ERROR: "rate_error", "rate", "rad/s", "`w_e`, body",
        Vector(|t| vector(t.evaluation.rate_error));
    TILT_ERROR: "tilt_error", "tilt", "rad", "angle between body z and `b3d`",
        Double(|t| tracking::tilt_error(t.truth.attitude, &t.reference));

    THRUST: "thrust", "thrust", "N", "`f` (21), along body z", Single(|t| t.output.wrench.thrust);
    TORQUE_DEMAND: "torque_demand", "torque_demand", "N m",
        "`tau_d` (50) before saturation, body; controller 1: the torque itself",
        Vector(|t| t.output.torque_demand_body);
    TORQUE: "torque", "torque", "N m", "`tau` (34), (37), body",
        Vector(|t| t.output.wrench.torque_body);
    APPLIED_THRUST: "applied_thrust", "applied_thrust", "N",
        "what acts: the command, unless the scenario has an `[actuation]`",
        Single(|t| t.applied.thrust as f32);
    APPLIED_TORQUE: "applied_torque", "applied_torque", "N m", "likewise, body",
        Vector(|t| vector(t.applied.torque_body));
    MODELLED_TORQUE: "modelled_torque", "modelled_torque", "N m",
        "what acts as the law takes it, body: the command, unless it has a model of the rotors; zero without a law of the paper",
        Vector(|t| t.intermediates.acting_torque_body);

    DISTURBANCE_ACCELERATION: "disturbance_acceleration", "acceleration", "m/s^2", "`d1`, world",
        Vector(|t| vector(t.disturbance.acceleration_world));
    DISTURBANCE_TORQUE: "disturbance_torque", "torque", "N m", "`d2`, body",
        Vector(|t| vector(t.disturbance.torque_body));

    MASS_ESTIMATE: "mass_estimate", "mass", "kg", "`1/beta` (14)",
        Single(|t| 1.0 / t.estimates.inverse_mass);
    INERTIA_ESTIMATE: "inertia_estimate", "inertia", "kg m^2",
        "`a_hat` (35), controller 1; `1/theta_hat` (51), controller 2",
        Vector(|t| if t.estimates.inverse_inertia == Vec3::ZERO {
            t.estimates.inertia
        } else {
            t.estimates.inverse_inertia.recip()
        });
    GYROSCOPIC_RATIO_ESTIMATE: "gyroscopic_ratio_estimate", "gyroscopic_ratio", "-",
        "`Pi_hat` (52), controller 2; zero for controller 1",
        Vector(|t| t.estimates.gyroscopic_ratio);

    LASTING_ACCELERATION_ESTIMATE: "lasting_acceleration_estimate", "lasting_acceleration", "m/s^2",
        "`d_hat` of the integral action, world; zero without",
        Vector(|t| t.lasting.acceleration_world);
    LASTING_TORQUE_ESTIMATE: "lasting_torque_estimate", "lasting_torque", "N m",
        "`t_hat` of the integral action, controller 1; `s_hat/theta_hat`, controller 2; body",
        Vector(|t| t.lasting.torque(&t.estimates));

    AUXILIARY_ATTITUDE: "auxiliary_attitude", "attitude", "-", "`q_a` (38)",
        Quaternion(|t| t.auxiliary.attitude);
    AUXILIARY_RATE: "auxiliary_rate", "rate", "rad/s", "`w_a` (39)", Vector(|t| t.auxiliary.rate);
    AUXILIARY_ANGLE: "auxiliary_angle", "angle", "rad", "rotation angle of `q_a`",
        Double(|t| if t.auxiliary == Auxiliary::REST {
            0.0
        } else {
            tracking::rotation_angle(t.auxiliary.attitude.as_dquat())
        });

    LYAPUNOV: "lyapunov", "value", "-", "V3 (controller 1) or V5 (controller 2)",
        Double(|t| t.evaluation.value);
    LYAPUNOV_PARAMETERS: "lyapunov_parameters", "parameter_part", "-",
        "the part that the parameter errors make up",
        Double(|t| t.evaluation.parameter_part);
    LYAPUNOV_STATE: "lyapunov_state", "state_part", "-", "V without its parameter terms",
        Double(|t| t.evaluation.value - t.evaluation.parameter_part);
    LYAPUNOV_DECREASE: "lyapunov_decrease", "decrease", "1/s",
        "the decrease that the theorem promises, (36) or (53)",
        Double(|t| t.evaluation.decrease);

    STATUS: "status", "bits", "-", "status bits, as in trace.md", Bits(|t| t.output.status.bits());
}

#[inline]
fn vector(v: DVec3) -> Vec3 {
    v.as_vec3()
}

#[inline]
fn quaternion(q: DQuat) -> Quat {
    q.as_quat()
}
