//! A proposal: the gains, a complete scenario around them, and its predicted errors.

use std::fmt::Write;

use super::design::design;
use super::digits::rounded_up;
use super::hover::Hover;
use super::infeasible::Infeasible;
use super::request::Request;
use super::survey::{LoopSurvey, Which};
use super::ultimate::Ultimate;
use ctrl_core::controller::ControllerConfig;

/// Time constants of the slowest mode after which the start counts as forgotten.
const FORGOTTEN: f64 = 10.0;

/// Time for which flights are judged after that, in units of the position bandwidth's inverse: three periods.
const JUDGED: f64 = 20.0;

/// Errors [m, rad] below which a flight is not judged: rounding, and what is left of the start.
const FLOOR: f64 = 1e-3;

/// Gains, and the predictions for the vehicle with them.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// Request that it meets.
    pub request: Request,
    /// The controller, complete.
    pub law: ControllerConfig,
    /// The loops at hover over the corners of the uncertainty.
    pub surveys: Vec<LoopSurvey>,
    /// Predicted ultimate bounds.
    pub ultimate: Ultimate,
    /// Time from which on the bounds hold in the check flights (s).
    pub settle_time: f64,
    /// Length of the check flights (s).
    pub duration: f64,
}

impl Proposal {
    /// Gains for `request`.
    ///
    /// # Errors
    /// The inequality that no choice of gains meets.
    pub fn new(request: Request) -> Result<Self, Infeasible> {
        let law = design(&request)?;
        let surveys = Which::ALL.map(|which| LoopSurvey::new(which, &law)).to_vec();
        let ultimate = Ultimate::new(&law, request.lasting_torque);
        if let Some(error) = out_of_range(&law, &ultimate) {
            return Err(error);
        }
        let decay = surveys.iter().map(|it| it.decay.value).fold(f64::INFINITY, f64::min);
        let cascade = law.cascade();
        let width = f64::from(cascade.delta_min_translation.min(cascade.delta_min_rotation));
        let smoothing = (20.0 / width).ln() / f64::from(cascade.delta_1);
        let settle_time = (FORGOTTEN / decay).max(smoothing).ceil();
        let duration = (settle_time + JUDGED / request.wanted.position_bandwidth).ceil();
        Ok(Self { request, law, surveys, ultimate, settle_time, duration })
    }

    /// Bounds of the check: position (m), `q_e`, tilt and heading (rad).
    #[must_use]
    pub fn bounds(&self) -> [f64; 4] {
        let peak = &self.ultimate.peak;
        [peak.position, peak.attitude, peak.tilt, peak.heading]
            .map(|bound| rounded_up(bound.unwrap_or(f64::INFINITY).max(FLOOR)))
    }

    /// A complete scenario: hover beside the reference, noise at the disturbances' bounds.
    #[must_use]
    pub fn scenario(&self) -> String {
        let Self { request, settle_time, duration, .. } = self;
        let known = &request.known;
        let [position, attitude, tilt, heading] = self.bounds();
        let offset = 0.5 * request.wanted.position_range;
        let inertia = request.initial.inertia;
        format!(
            "# Gains proposed by `sil-host tune`. SI units unless the key says otherwise.

name = \"{name}\"
description = \"Hover with the gains that sil-host tune proposes.\"
duration = {duration:?}                 # how long to fly [s]
seed = 1                        # of every random number
plant_steps_per_tick = 1        # RK4 steps of the plant between two control ticks

# The true vehicle; the controller does not know it.
[vehicle]
mass = {mass:?}                 # [kg]
inertia = [{jx:?}, {jy:?}, {jz:?}]   # principal moments [kg m^2]

[initial]
position = [{offset:?}, -{offset:?}, {height:?}]    # world frame [m]
velocity = [0.0, 0.0, 0.0]      # world frame [m/s]
rate_body = [0.0, 0.0, 0.0]     # body axes [rad/s]
heading_deg = 0.0
tilt_deg = 0.0
tilt_direction_deg = 0.0

[disturbance.noise]             # uniform, drawn anew at every tick
acceleration = {d1:?}           # largest magnitude of each component of d1 [m/s^2]
torque = {d2:?}                 # largest magnitude of each component of d2 [N m]

[trajectory.hover]
position_world = [0.0, 0.0, 5.0]    # [m]
yaw = 0.0                           # [rad]

{controller}
# What the flight must achieve: the predicted peaks.
[guarantees]
settle_time = {settle_time:?}   # errors are judged from here on [s]
position_error_max = {position:?}       # [m]
attitude_error_max = {attitude:?}       # angle of q_e [rad]
tilt_error_max = {tilt:?}           # between body z and the reference's b3d [rad]
heading_error_max = {heading:?}        # between body y and the reference's b2d [rad]
lyapunov_window = 1.0           # V may not rise over it outside its ultimate set [s]
",
            name = request.name,
            mass = request.initial.mass,
            jx = inertia.x,
            jy = inertia.y,
            jz = inertia.z,
            height = 5.0 - offset,
            d1 = known.disturbance_acceleration,
            d2 = known.disturbance_torque,
            controller = controller(&self.law),
        )
    }
}

/// The controller's tables as a scenario has them.
#[must_use]
pub fn controller(law: &ControllerConfig) -> String {
    let mut text = String::new();
    let kind = law.key();
    let mut line = |value: f32, name: &str, comment: &str| {
        let assignment = format!("{name} = {value:?}");
        let _ = writeln!(text, "{assignment:<40}# {comment}");
    };
    match law {
        ControllerConfig::RobustAdaptive(config) => {
            line(config.step_period, "step_period", "dt [s]");
            line(config.reference_acceleration_max, ACCELERATION, "M_p, each component [m/s^2]");
            line(config.k4, "k4", "rate gain [N m s]");
            line(config.gamma2, "gamma2", "adaptation gain of the inertia");
        }
        ControllerConfig::Saturated(config) => {
            line(config.step_period, "step_period", "dt [s]");
            line(config.reference_acceleration_max, ACCELERATION, "M_p, each component [m/s^2]");
            line(config.thrust_max, "thrust_max", "M_f [N]");
            line(config.torque_max, "torque_max", "M_tau, each component [N m]");
            line(config.k4, "k4", "rate gain [1/s]");
            line(config.k5, "k5", "attitude gain of the auxiliary system [1/s]");
            line(config.gamma2, "gamma2", "adaptation gain of the inverse inertia");
            line(config.gamma3, "gamma3", "adaptation gain of the gyroscopic ratios");
        }
    }
    let own = std::mem::take(&mut text);
    let (known, initial, cascade) = (law.uncertainty(), law.initial(), law.cascade());
    let mut line = |value: f32, name: &str, comment: &str| {
        let assignment = format!("{name} = {value:?}");
        let _ = writeln!(text, "{assignment:<40}# {comment}");
    };
    line(cascade.k1, "k1", "position gain inside the saturations [1/m]");
    line(cascade.k2, "k2", "velocity gain inside the saturations [s/m]");
    line(cascade.k3, "k3", "attitude gain [1/s]");
    line(cascade.c, "c", "weight of the translational Lyapunov function");
    line(cascade.m1, "M1", "limit of the position part of the acceleration [m/s^2]");
    line(cascade.m2, "M2", "limit of the velocity part of the acceleration [m/s^2]");
    line(cascade.gamma1, "gamma1", "adaptation gain of the inverse mass");
    line(cascade.delta_1, "delta_1", "decay rate of the smoothing width (17) [1/s]");
    line(cascade.delta_min_translation, "delta_min_translation", "floor of the width of G");
    line(cascade.delta_min_rotation, "delta_min_rotation", "floor of the width of w_e [rad/s]");
    let [jx, jy, jz] = initial.inertia.to_array();
    format!(
        "[controller.{kind}]
{own}
# What the controller is told of the vehicle.
[controller.{kind}.uncertainty]
mass = {{ lower = {:?}, upper = {:?} }}       # [kg]
inertia = {{ lower = {:?}, upper = {:?} }}    # each principal moment [kg m^2]
disturbance_acceleration = {:?}     # D1, each component [m/s^2]
disturbance_torque = {:?}           # D2, each component [N m]

# Estimates at the first tick.
[controller.{kind}.initial]
mass = {:?}                         # [kg]
inertia = [{jx:?}, {jy:?}, {jz:?}]  # [kg m^2]

[controller.{kind}.cascade]
{text}",
        known.mass.lower,
        known.mass.upper,
        known.inertia.lower,
        known.inertia.upper,
        known.disturbance_acceleration,
        known.disturbance_torque,
        initial.mass,
    )
}

const ACCELERATION: &str = "reference_acceleration_max";

/// The disturbances drive the position loop to the limits of its saturation, where nothing is predicted.
fn out_of_range(law: &ControllerConfig, ultimate: &Ultimate) -> Option<Infeasible> {
    let peak = &ultimate.peak;
    if [peak.position, peak.attitude, peak.tilt, peak.heading].iter().all(Option::is_some) {
        return None;
    }
    let hover = Hover::new(law);
    let known = hover.known;
    Some(Infeasible {
        inequality: "acceleration that the disturbances make the position loop ask for, within M1"
            .to_owned(),
        left: ultimate.position_demand,
        right: hover.cascade.m1.into(),
        unit: "m/s^2",
        remedies: vec![
            format!("a disturbance_torque below {:?} N m", known.disturbance_torque),
            format!("a disturbance_acceleration below {:?} m/s^2", known.disturbance_acceleration),
            "a larger wanted.attitude_bandwidth".to_owned(),
            "a larger wanted.position_range".to_owned(),
        ],
        remedy: None,
    })
}
