//! Rounding error of V over one tick, `A_r` of the balance: the law is evaluated in `f32`, on a state and
//! a reference rounded to `f32`.
//!
//! The error of each quantity of the law is bounded by a few units in the last place of the largest terms
//! of its sum; V changes by that error times its factor in V'.

use super::function::Evaluated;
use super::lengths::Lengths;
use super::parameters::Parameters;
use crate::guarantee::block::Block;
use crate::lanes::{Scalars, all};

/// Twice the relative error of one operation.
const ULP: f64 = f32::EPSILON as f64;

/// `A_r`.
pub(super) fn rounding(p: &Parameters, block: &Block, now: &Evaluated) -> Scalars {
    let Lengths { g, rate_error: w_e, attitude_error: eps, .. } = now.lengths;
    let error = Errors::new(p, block, now);
    // While the auxiliary attitude is away from rest, its own rounding turns R_d at every tick.
    let away = block.law.auxiliary_attitude.w.simd_lt(all(1.0));
    let auxiliary = away.select(all(4.0 * ULP), all(0.0));
    // Integral action adds two squares to the sum.
    let of_value = if p.integral.is_some() { 6.0 } else { 2.0 };
    all(p.c) * (error.stepping + all(p.dt) * error.acceleration * g)
        + all(p.dt) * (error.rate_dot * w_e + error.virtual_rate * eps)
        + auxiliary * eps
        + all(of_value * f64::EPSILON) * now.value // of V itself
}

/// Rounding errors of the law's quantities.
struct Errors {
    /// Of the commanded acceleration (m/s^2).
    acceleration: Scalars,
    /// Of `mu` (rad/s).
    virtual_rate: Scalars,
    /// Of the torque, in the unit of the rate term of V'.
    rate_dot: Scalars,
    /// Of V1 through a reference that moves in steps of `f32`.
    stepping: Scalars,
}

impl Errors {
    fn new(p: &Parameters, block: &Block, now: &Evaluated) -> Self {
        let reference = &block.reference;
        let position = reference.position.norm() + now.translation.position_error.norm();
        let velocity = block.velocity.norm() + reference.velocity.norm();
        let specific_force = now.lengths.alpha * now.inverse_mass;
        let sigma = all(ULP)
            * (all(p.m1) * (all(p.k1) * position + all(p.k2) * velocity)
                + all(p.m2 * p.k2) * velocity);
        let g = all(p.k2) * sigma + all(p.k1 * ULP) * velocity; // (16)
        let acceleration = all(8.0 * ULP) * specific_force
            + sigma
            + all(p.d1) * (now.delta.0.sign_error + g / now.delta.0.value); // (13)
        let turn = all(8.0 * ULP) + acceleration / specific_force; // of R_d and q_e [rad]
        Self {
            acceleration,
            virtual_rate: virtual_rate(p, block, now, turn, g),
            rate_dot: rate_dot(p, block, now, turn),
            // The reference is evaluated in f32, with errors of a few units.
            stepping: all(4.0 * ULP)
                * (all(p.k1) * now.lengths.sigma_1 * position + now.lengths.g * velocity),
        }
    }
}

/// Error of `mu` (31), (49).
fn virtual_rate(
    p: &Parameters,
    block: &Block,
    now: &Evaluated,
    turn: Scalars,
    g: Scalars,
) -> Scalars {
    let coupling = all(2.0 * p.c) * now.lengths.alpha * now.inverse_mass;
    let desired_rate = block.law.desired_rate.norm();
    all(16.0 * ULP) * now.lengths.virtual_rate
        + turn * (all(p.k3.max_element()) + desired_rate + coupling * now.lengths.g)
        + coupling * g
}

/// Error of the torque (34), (50), per unit of the weight of `w_e` in V.
fn rate_dot(p: &Parameters, block: &Block, now: &Evaluated, turn: Scalars) -> Scalars {
    let torque = block.law.torque_demand;
    let (demand, d2) = match p.saturated {
        None => (torque, p.d2.max_element()),
        Some(_) => (torque * block.law.inverse_inertia, (p.d2 / p.inertia_set.0).max_element()),
    };
    let rate = all(4.0 * ULP) * (now.lengths.rate + now.lengths.virtual_rate);
    all(16.0 * ULP) * demand.norm()
        + turn
        + rate * (all(p.k4.max_element()) + all(d2) / now.delta.1.value)
        + all(d2) * now.delta.1.sign_error
}
