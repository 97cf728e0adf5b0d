//! Parameters: their short names, and those of the navigation.
//!
//! MAVLink's names have at most 16 characters, and 15 of the link's do not fit. [`NAMES`] is the one table
//! from one to the other. The controller's parameters are the vehicle's; the navigation's are its
//! configuration, under the names that ground stations know them by.

use ctrl_core::mode::navigation::NavigationConfig;

/// Most characters of a name in MAVLink.
pub(crate) const SHORT_MAX: usize = 16;

/// A parameter's names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterName {
    /// In MAVLink, at most 16 characters.
    pub short: &'static str,
    /// In the link and in a scenario file.
    pub long: &'static str,
}

const fn name(short: &'static str, long: &'static str) -> ParameterName {
    ParameterName { short, long }
}

/// Both names of every parameter.
pub const NAMES: &[ParameterName] = &[
    name("CTL_THRUST_MAX", "thrust_max"),
    name("CTL_TORQUE_MAX_X", "torque_max.x"),
    name("CTL_TORQUE_MAX_Y", "torque_max.y"),
    name("CTL_TORQUE_MAX_Z", "torque_max.z"),
    name("CTL_K1", "cascade.k1"),
    name("CTL_K2", "cascade.k2"),
    name("CTL_K3_X", "cascade.k3.x"),
    name("CTL_K3_Y", "cascade.k3.y"),
    name("CTL_K3_Z", "cascade.k3.z"),
    name("CTL_K4_X", "k4.x"),
    name("CTL_K4_Y", "k4.y"),
    name("CTL_K4_Z", "k4.z"),
    name("CTL_K5", "k5"),
    name("CTL_C", "cascade.c"),
    name("CTL_M1", "cascade.M1"),
    name("CTL_M2", "cascade.M2"),
    name("CTL_GAMMA1", "cascade.gamma1"),
    name("CTL_GAMMA2_X", "gamma2.x"),
    name("CTL_GAMMA2_Y", "gamma2.y"),
    name("CTL_GAMMA2_Z", "gamma2.z"),
    name("CTL_GAMMA3", "gamma3"),
    name("CTL_DELTA_1", "cascade.delta_1"),
    name("CTL_DELTA_MIN_T", "cascade.delta_min_translation"),
    name("CTL_DELTA_MIN_R", "cascade.delta_min_rotation"),
    name("CTL_REF_ACC_MAX", "reference_acceleration_max"),
    name("VEH_MASS_MIN", "uncertainty.mass.lower"),
    name("VEH_MASS_MAX", "uncertainty.mass.upper"),
    name("VEH_INERT_MIN_X", "uncertainty.inertia.lower.x"),
    name("VEH_INERT_MIN_Y", "uncertainty.inertia.lower.y"),
    name("VEH_INERT_MIN_Z", "uncertainty.inertia.lower.z"),
    name("VEH_INERT_MAX_X", "uncertainty.inertia.upper.x"),
    name("VEH_INERT_MAX_Y", "uncertainty.inertia.upper.y"),
    name("VEH_INERT_MAX_Z", "uncertainty.inertia.upper.z"),
    name("VEH_DIST_ACC", "uncertainty.disturbance_acceleration"),
    name("VEH_DIST_TRQ_X", "uncertainty.disturbance_torque.x"),
    name("VEH_DIST_TRQ_Y", "uncertainty.disturbance_torque.y"),
    name("VEH_DIST_TRQ_Z", "uncertainty.disturbance_torque.z"),
    name("VEH_MASS_INIT", "initial.mass"),
    name("VEH_INERTIA_X", "initial.inertia.x"),
    name("VEH_INERTIA_Y", "initial.inertia.y"),
    name("VEH_INERTIA_Z", "initial.inertia.z"),
    name("CTL_INT_ACC_MAX", "integral.acceleration_max"),
    name("CTL_INT_GAMMA_D", "integral.gamma_d"),
    name("CTL_INT_TRQ_MAX", "integral.torque_max"),
    name("CTL_INT_GAMMA_T", "integral.gamma_t"),
    name("CTL_ROTOR_LAG", "rotors.lag"),
    name("CTL_ROTOR_LEFT", "rotors.residual_lag"),
    name("MIS_TAKEOFF_ALT", "navigation.take_off_altitude"),
    name("RTL_RETURN_ALT", "navigation.return_altitude"),
    name("NAV_ACC_RAD", "navigation.acceptance_radius"),
    name("COM_OF_LOSS_T", "navigation.setpoint_timeout"),
    name("MPC_LAND_SPEED", "navigation.land_speed"),
    name("MPC_XY_VEL_MAX", "shaper.speed_max"),
    name("MPC_Z_VEL_MAX_UP", "shaper.climb_max"),
    name("MPC_Z_VEL_MAX_DN", "shaper.descent_max"),
    name("MPC_YAW_RATE_MAX", "shaper.yaw_rate_max"),
];

/// MAVLink's name of a parameter of the link.
#[must_use]
pub fn short_name(long: &str) -> Option<&'static str> {
    // wcet: at most 64 iterations
    // wcet: at most 48 bytes
    NAMES.iter().find(|name| name.long == long).map(|name| name.short)
}

/// The link's name of a parameter of MAVLink.
#[must_use]
pub fn long_name(short: &str) -> Option<&'static str> {
    // wcet: at most 64 iterations
    // wcet: at most 48 bytes
    NAMES.iter().find(|name| name.short == short).map(|name| name.long)
}

/// Long names of the navigation's parameters.
pub(crate) const NAVIGATION: [&str; 9] = [
    "navigation.take_off_altitude",
    "navigation.return_altitude",
    "navigation.acceptance_radius",
    "navigation.setpoint_timeout",
    "navigation.land_speed",
    "shaper.speed_max",
    "shaper.climb_max",
    "shaper.descent_max",
    "shaper.yaw_rate_max",
];

/// The field of the navigation's parameter at `index` of [`NAVIGATION`].
pub(crate) fn navigation_field(config: &mut NavigationConfig, index: usize) -> Option<&mut f32> {
    Some(match index {
        0 => &mut config.take_off_altitude,
        1 => &mut config.return_altitude,
        2 => &mut config.acceptance_radius,
        3 => &mut config.setpoint_timeout,
        4 => &mut config.land_speed,
        5 => &mut config.shaper.speed_max,
        6 => &mut config.shaper.climb_max,
        7 => &mut config.shaper.descent_max,
        8 => &mut config.shaper.yaw_rate_max,
        _ => return None,
    })
}
