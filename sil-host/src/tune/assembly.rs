//! Assembly of a controller's configuration from gains and request.

use ctrl_core::config::{CascadeGains, RobustAdaptiveConfig, SaturatedConfig};
use ctrl_core::controller::ControllerConfig;

use glam::DVec3;

use super::digits::rounded;
use super::request::{Limits, Request};
use super::steady::HorizontalBounds;

/// Share of the attitude loop's speed at which inertia and gyroscopic ratios adapt in a brisk
/// manoeuvre (one radian of amplitude at the attitude's bandwidth, or the whole torque).
const ADAPTATION: f64 = 0.02;

/// The controller with these gains; `attitude` is the speed of its attitude loop about
/// each axis (rad/s).
pub(super) fn assembled(
    request: &Request,
    cascade: CascadeGains,
    k4: DVec3,
    k5: f64,
    attitude: DVec3,
) -> ControllerConfig {
    let &Request { known, initial, reference_acceleration_max, step_period, limits, .. } = request;
    let rotors = request.rotor_model();
    let bounds = HorizontalBounds::new(&known, reference_acceleration_max);
    let integral = request.steady.bounded(&bounds);
    let in_motion = ADAPTATION * k4 / (attitude * attitude * attitude);
    let rounded_each = |it: DVec3| it.map(rounded).as_vec3();
    match limits {
        None => ControllerConfig::RobustAdaptive(RobustAdaptiveConfig {
            step_period,
            reference_acceleration_max,
            uncertainty: known,
            initial,
            cascade,
            k4: k4.as_vec3(),
            gamma2: rounded_each(in_motion),
            integral,
            rotors,
        }),
        Some(Limits { thrust_max, torque_max }) => ControllerConfig::Saturated(SaturatedConfig {
            step_period,
            reference_acceleration_max,
            uncertainty: known,
            initial,
            cascade,
            thrust_max,
            torque_max,
            k4: k4.as_vec3(),
            k5: k5 as f32,
            gamma2: rounded_each(
                ADAPTATION * attitude * k4 / (torque_max.as_dvec3() * torque_max.as_dvec3()),
            ),
            gamma3: rounded(in_motion.min_element()) as f32,
            integral,
            rotors,
        }),
    }
}
