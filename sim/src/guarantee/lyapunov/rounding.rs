//! Rounding error of V over one tick, `A_r` of the balance: the law is evaluated in `f32`, on a state and
//! a reference rounded to `f32`.
//!
//! The error of each quantity of the law is bounded by a few units in the last place of the largest terms
//! of its sum; V changes by that error times its factor in V'.

use super::parameters::Parameters;
use crate::evaluation::{Evaluation, Lengths};
use crate::norm::Norm;
use crate::tick::Tick;

/// Twice the relative error of one operation.
const ULP: f64 = f32::EPSILON as f64;

/// `A_r`.
pub(super) fn rounding(p: &Parameters, tick: &Tick, now: &Evaluation) -> f64 {
    let Lengths { g, rate_error: w_e, attitude_error: eps, .. } = now.lengths;
    let error = Errors::new(p, tick, now);
    // While the auxiliary attitude is away from rest, its own rounding turns R_d at every tick.
    let auxiliary = if tick.auxiliary.attitude.w < 1.0 { 4.0 * ULP } else { 0.0 };
    // Integral action adds two squares to the sum.
    let of_value = if p.integral.is_some() { 6.0 } else { 2.0 };
    p.c * (error.stepping + p.dt * error.acceleration * g)
        + p.dt * (error.rate_dot * w_e + error.virtual_rate * eps)
        + auxiliary * eps
        + of_value * f64::EPSILON * now.value // of V itself
}

/// Rounding errors of the law's quantities.
struct Errors {
    /// Of the commanded acceleration (m/s^2).
    acceleration: f64,
    /// Of `mu` (rad/s).
    virtual_rate: f64,
    /// Of the torque, in the unit of the rate term of V'.
    rate_dot: f64,
    /// Of V1 through a reference that moves in steps of `f32`.
    stepping: f64,
}

impl Errors {
    fn new(p: &Parameters, tick: &Tick, now: &Evaluation) -> Self {
        let (truth, reference) = (&tick.truth, &tick.reference);
        let position = reference.position_world.as_dvec3().norm() + now.position_error.norm();
        let velocity = truth.velocity_world.norm() + reference.velocity_world.as_dvec3().norm();
        let specific_force = now.lengths.alpha * now.inverse_mass;
        let sigma = ULP * (p.m1 * (p.k1 * position + p.k2 * velocity) + p.m2 * p.k2 * velocity);
        let g = p.k2 * sigma + p.k1 * ULP * velocity; // (16)
        let acceleration = 8.0 * ULP * specific_force
            + sigma
            + p.d1 * (now.delta.0.sign_error + g / now.delta.0.value); // (13)
        let turn = 8.0 * ULP + acceleration / specific_force; // of R_d and q_e [rad]
        let virtual_rate = virtual_rate(p, tick, now, turn, g);
        Self {
            acceleration,
            virtual_rate,
            rate_dot: rate_dot(p, tick, now, turn),
            // The reference is evaluated in f32, with errors of a few units.
            stepping: 4.0
                * ULP
                * (p.k1 * now.lengths.sigma_1 * position + now.lengths.g * velocity),
        }
    }
}

/// Error of `mu` (31), (49).
fn virtual_rate(p: &Parameters, tick: &Tick, now: &Evaluation, turn: f64, g: f64) -> f64 {
    let coupling = 2.0 * p.c * now.lengths.alpha * now.inverse_mass;
    let desired_rate = tick.intermediates.desired_rate.as_dvec3().norm();
    16.0 * ULP * now.lengths.virtual_rate
        + turn * (p.k3 + desired_rate + coupling * now.lengths.g)
        + coupling * g
}

/// Error of the torque (34), (50), per unit of the weight of `w_e` in V.
fn rate_dot(p: &Parameters, tick: &Tick, now: &Evaluation, turn: f64) -> f64 {
    let torque = tick.output.torque_demand_body.as_dvec3();
    let (demand, d2) = match p.saturated {
        None => (torque, p.d2),
        Some(_) => (torque * tick.estimates.inverse_inertia.as_dvec3(), p.d2 / p.inertia_set.0),
    };
    let rate = 4.0 * ULP * (now.lengths.rate + now.lengths.virtual_rate);
    16.0 * ULP * demand.norm()
        + turn
        + rate * (p.k4 + d2 / now.delta.1.value)
        + d2 * now.delta.1.sign_error
}
