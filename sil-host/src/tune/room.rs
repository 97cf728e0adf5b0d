//! Headroom that thrust and torque leave to the gains, less the margin.

use ctrl_core::config::CascadeGains;
use ctrl_core::vehicle::GRAVITY;
use glam::{DVec3, Vec3};
use sim::guarantee::bounds::ThrustBounds;

use super::assembly::assembled;
use super::digits::rounded_down;
use super::infeasible::{Infeasible, Remedy};
use super::request::Request;
use super::survey::Which;
use sim::number::number;

const G: f64 = GRAVITY as f64;

/// `M1` is at least so many times `D1`, so that a lasting push takes it only half to its limit.
const PUSH: f64 = 2.0;

/// Share of the margin that rounding to `f32` may take.
const ROUNDING: f64 = 1e-6;

/// `M1 + M2` (m/s^2): as much as thrust and torque leave with margin.
pub(super) fn acceleration(request: &Request, bandwidth: f64) -> Result<f64, Infeasible> {
    let free = (1.0 - request.wanted.margin) * (1.0 - ROUNDING);
    let d1 = f64::from(request.known.disturbance_acceleration);
    // What lasts is held by M1 until the estimate has it.
    let push = request.steady.acceleration;
    let held = if push > 0.0 { d1 + push } else { 0.0 };
    let held = (PUSH * d1).max(held);
    let needed = (2.0 * bandwidth.powi(2) * request.wanted.position_range).max(2.0 * held);
    let why = if push > 0.0 {
        "M1 + M2 >= 2 max(position_range bandwidth^2, 2 D1, D1 + steady_acceleration)"
    } else {
        "M1 + M2 >= 2 max(position_range bandwidth^2, 2 D1)"
    };
    let room = thrust_room(request);
    let lift = free * room.lift;
    if needed > lift {
        let spared = number(needed / free - room.lift);
        return Err(Infeasible {
            inequality: format!("{why} within the lower thrust bound (19)"),
            left: needed,
            right: lift,
            unit: "m/s^2",
            remedies: vec![
                format!(
                    "reference_acceleration_max + disturbance_acceleration less by {spared} m/s^2"
                ),
                "a smaller wanted.position_bandwidth or wanted.position_range".to_owned(),
            ],
            deciding: vec![],
        });
    }
    let Some(limits) = request.limits else { return Ok(lift) };
    let thrust = free * room.thrust;
    if needed > thrust {
        return Err(Infeasible {
            inequality: format!("{why} within the upper thrust bound (54)"),
            left: needed,
            right: thrust,
            unit: "m/s^2",
            remedies: vec![lower_demand()],
            deciding: vec![(Remedy::ThrustMax, room.thrust_for(needed / free))],
        });
    }
    let mut room = lift.min(thrust);
    for axis in Which::Lateral.axes().iter().copied() {
        let per_acceleration =
            f64::from(request.known.inertia.upper[axis]) * bandwidth * bandwidth / G;
        let lasting = request.torque_that_lasts()[axis];
        let torque = lasting + per_acceleration * (needed + d1);
        let most = free * f64::from(limits.torque_max[axis]);
        if torque > most {
            return Err(Infeasible {
                inequality: format!(
                    "lasting_torque + J_hi bandwidth^2 (M1 + M2 + D1)/g within torque_max{}",
                    about(request, axis)
                ),
                left: torque,
                right: most,
                unit: "N m",
                remedies: vec![lower_demand()],
                deciding: vec![(torque_max(request, axis), torque / free)],
            });
        }
        room = room.min((most - lasting) / per_acceleration - d1);
    }
    Ok(room)
}

/// The axis in words, where they are unlike.
fn about(request: &Request, axis: usize) -> &'static str {
    if request.axes_alike() { "" } else { [" about x", " about y", " about z"][axis] }
}

/// The torque limit as what decides: of the axis, where they are unlike.
fn torque_max(request: &Request, axis: usize) -> Remedy {
    Remedy::TorqueMax((!request.axes_alike()).then_some(axis))
}

fn lower_demand() -> String {
    "a smaller wanted.position_bandwidth, wanted.position_range or disturbance_acceleration"
        .to_owned()
}

/// Headroom for `M1 + M2` (m/s^2).
struct ThrustRoom {
    /// Below (19).
    lift: f64,
    /// Below (54).
    thrust: f64,
    /// `(20)` without `M1 + M2`, and what each m/s^2 of it adds (N).
    upper: (f64, f64),
}

impl ThrustRoom {
    /// Thrust that `sum` needs (20) (N).
    fn thrust_for(&self, sum: f64) -> f64 {
        self.upper.0 + self.upper.1 * sum
    }
}

/// Gains that ask for nothing.
const IDLE: CascadeGains = CascadeGains {
    k1: 0.0,
    k2: 0.0,
    k3: Vec3::ZERO,
    c: 0.0,
    m1: 0.0,
    m2: 0.0,
    gamma1: 0.0,
    delta_1: 0.0,
    delta_min_translation: 1.0,
    delta_min_rotation: 1.0,
};

/// From the bounds (19) and (20) as the monitors have them: both are linear in `M1 + M2`.
fn thrust_room(request: &Request) -> ThrustRoom {
    let with = |m1: f32| {
        let mut law = assembled(request, IDLE, DVec3::ONE, 1.0, DVec3::ONE);
        law.cascade_mut().m1 = m1;
        law
    };
    let (none, one) = (with(0.0), with(1.0));
    let (lower, upper) = (none.thrust_lower_bound(), none.thrust_upper_bound());
    let slope = one.thrust_upper_bound() - upper;
    let thrust_max = request.limits.map_or(f64::INFINITY, |limits| limits.thrust_max.into());
    ThrustRoom {
        lift: lower / (lower - one.thrust_lower_bound()),
        thrust: (thrust_max - upper) / slope,
        upper: (upper, slope),
    }
}

/// `k5`, with which half the torque to spare can follow the auxiliary attitude back from half a turn:
/// `J_hi pi (k5/2)^2` is the most that this takes. At most half the attitude's speed; the least of the axes.
pub(super) fn auxiliary_gain(request: &Request, attitude: DVec3) -> Result<f64, Infeasible> {
    let mut gain = f64::INFINITY;
    for axis in 0..3 {
        gain = gain.min(auxiliary_gain_about(request, axis, attitude[axis])?);
    }
    Ok(gain)
}

fn auxiliary_gain_about(request: &Request, axis: usize, attitude: f64) -> Result<f64, Infeasible> {
    let Some(limits) = request.limits else { return Ok(0.0) };
    let inertia = f64::from(request.known.inertia.upper[axis]);
    let lasting = request.torque_that_lasts()[axis];
    let free = (1.0 - request.wanted.margin) * (1.0 - ROUNDING);
    let most = free * f64::from(limits.torque_max[axis]);
    let torque = lasting + inertia * attitude * attitude * request.wanted.attitude_range;
    if torque > most {
        let remedies = vec![
            "a smaller wanted.attitude_bandwidth, wanted.attitude_range or lasting_torque"
                .to_owned(),
        ];
        return Err(Infeasible {
            inequality: format!(
                "lasting_torque + J_hi bandwidth^2 attitude_range within torque_max{}, \
                 the attitude's poles at {} rad/s",
                about(request, axis),
                number(attitude)
            ),
            left: torque,
            right: most,
            unit: "N m",
            remedies,
            deciding: vec![(torque_max(request, axis), torque / free)],
        });
    }
    let followed = ((most - lasting) / (inertia * core::f64::consts::TAU)).sqrt();
    Ok(rounded_down((2.0 * followed).min(0.5 * attitude)))
}
