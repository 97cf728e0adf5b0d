//! Balance of V from one tick to the next: the theorem's decrease, plus every perturbation of it.
//!
//! ```text
//! V[k+1] - V[k] <= dt (-W + rho_d + rho_v) + A
//! rho_d = c G . (d1 - D1 h(G, delta_t)) + w_e . (d2 - D2 h(w_e, delta_r))    controller 1
//! rho_d = c G . (d1 - D1 h(G, delta_t)) + w_e . (d2/J - D2/J_lo h(w_e, delta_r))        2
//!      <= 0.3003 (3 c D1 delta_t + sum(D2/J') delta_r)           while |d1| <= D1, |d2| <= D2
//! rho_v = eps_e . R_e^T (w_d,used - w_d,true) - w_e . J'' (mu'_true - mu'_used)
//! ```
//! with `J' = 1`, `J'' = J` for controller 1 and `J' = J_lo`, `J'' = I` for controller 2; `_true` are
//! differences over the tick. Behind rotors that lag `rho_v` has what the thrust and the modelled torque miss of what
//! acts, and `eps_e . w_a` for controller 1. `rho_v` also holds what an adaptation that is switched off leaves over.
//! With integral action `rho_d` has `d1 - d_c` and `d2 - t_c`: what lasts, its estimate answers for.
//! `A = A_h + A_r`: `A_h` bounds the effect of holding the wrench over the tick, is made of second-order
//! terms only, and so shrinks with `dt^2`; `A_r` bounds the rounding of the `f32` controller.
//! Derivation: `docs/guarantees.md`.

use glam::DVec3;

use super::attitude::turn;
use super::function::{Evaluated, EvaluatedBlock, over, over_each, products};
use super::parameters::Parameters;
use super::rounding::rounding;
use super::translation::smooth_sign;
use crate::guarantee::block::Block;
use crate::lanes::{Scalars, Vectors, all, later};

/// `max_x (x - x h(x, 1)) = sqrt((5 sqrt 5 - 11)/2)`: the smooth sign loses at most this times
/// `D delta` against the discontinuous one. The paper uses 1.
pub const SMOOTHING: f64 = 0.300_283_106_000_8;

/// The terms of the balance over one tick, for each tick of a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Balance {
    /// `V[k+1] - V[k]`.
    pub change: Scalars,
    /// `W` (1/s).
    pub decrease: Scalars,
    /// `rho_d`: the true disturbances against the smooth signs (1/s).
    pub disturbance: Scalars,
    /// Bound of `rho_d` while the disturbances keep theirs (1/s).
    pub smoothing: Scalars,
    /// `rho_v`: model-based `v'`, and everything else that `w_d` and `mu'` leave out (1/s).
    pub model: Scalars,
    /// `A_h`: bound of the effect of holding the wrench over the tick.
    pub hold: Scalars,
    /// `A_r`: bound of the effect of rounding to `f32`.
    pub rounding: Scalars,
}

impl Balance {
    /// From each tick of a block to the one after it, the last of which is the first of `next`.
    pub fn new(p: &Parameters, from: &EvaluatedBlock, next: &EvaluatedBlock) -> Self {
        let (now, law) = (&from.v, &from.ticks.law);
        let motion = Motion::new(from, next);
        let (error, w_e) = (now.attitude.error, now.rate_error);
        let rate_mismatch = error.inverse() * (law.desired_rate - motion.desired_turn / all(p.dt));
        let mu_dot_true = law.mu_change.later(next.ticks.law.mu_change) / all(p.dt);
        let acceleration_mismatch = Vectors::all(p.rate_weight()) * (mu_dot_true - law.mu_dot);
        let model = error.xyz().dot(rate_mismatch) - w_e.dot(acceleration_mismatch);
        Self {
            change: later(now.value, next.v.value) - now.value,
            decrease: now.decrease,
            disturbance: disturbance(p, &from.ticks, now),
            smoothing: smoothing(p, now),
            model: model + unadapted(p, &from.ticks, now) + behind_rotors(p, &from.ticks, now),
            hold: motion.translation_hold(p, now)
                + motion.attitude_hold(p, now)
                + motion.rate_hold(p, &from.ticks, now)
                + adaptation_hold(p, now),
            rounding: rounding(p, &from.ticks, now),
        }
    }

    /// `A = A_h + A_r`.
    pub fn allowance(&self) -> Scalars {
        self.hold + self.rounding
    }

    /// `rho = rho_d + rho_v` (1/s).
    pub fn perturbation(&self) -> Scalars {
        self.disturbance + self.model
    }

    /// By how much V rose beyond what it may, per second; not positive while the law holds.
    pub fn excess(&self, dt: f64) -> Scalars {
        (self.change - self.allowance()) / all(dt) + self.decrease - self.perturbation()
    }
}

/// `rho_d`.
fn disturbance(p: &Parameters, ticks: &Block, now: &Evaluated) -> Scalars {
    let (d1, d2) = (ticks.disturbance_acceleration, ticks.disturbance_torque);
    let (g, w_e) = (now.translation.g, now.rate_error);
    let [d_c, t_c] = p
        .integral
        .map_or(Default::default(), |integral| [integral.acceleration, integral.torque])
        .map(Vectors::all);
    let sign = smooth_sign(w_e, now.delta.1.value);
    let torque = match p.saturated {
        None => d2 - sign * Vectors::all(p.d2),
        Some(saturated) => {
            Vectors::all(saturated.inverse_inertia) * d2
                - sign * Vectors::all(p.d2 / p.inertia_set.0)
        }
    };
    all(p.c) * g.dot(d1 - d_c - now.translation.sign * p.d1) + w_e.dot(torque - t_c)
}

/// `3 c D1 delta_t + sum(D2/J') delta_r` over the axes, with the exact constant.
fn smoothing(p: &Parameters, now: &Evaluated) -> Scalars {
    let inverse_inertia = if p.saturated.is_some() { p.inertia_set.0.recip() } else { DVec3::ONE };
    let d2 = (p.d2 * inverse_inertia).element_sum();
    all(SMOOTHING) * (all(3.0 * p.c * p.d1) * now.delta.0.value + all(d2) * now.delta.1.value)
}

/// Effect of a parameter error whose adaptation is switched off.
fn unadapted(p: &Parameters, ticks: &Block, now: &Evaluated) -> Scalars {
    let w = ticks.rate;
    let mut left = all(0.0);
    if p.gamma1 == 0.0 {
        let force = now.body_z * now.lengths.alpha;
        left += all(p.c) * now.inverse_mass_error * now.translation.g.dot(force);
    }
    let off = DVec3::select(p.gamma2.cmpeq(DVec3::ZERO), DVec3::ONE, DVec3::ZERO);
    if off != DVec3::ZERO {
        let regressor = match p.saturated {
            None => {
                -(w.cross(w * now.inertia_error) + ticks.law.regressor_rate * now.inertia_error)
            }
            Some(_) => now.inertia_error * ticks.law.torque,
        };
        left += now.rate_error.dot(Vectors::all(off) * regressor);
    }
    if let Some(saturated) = p.saturated.filter(|saturated| saturated.gamma3 == 0.0) {
        let error = Vectors::all(saturated.gyroscopic_ratio) - ticks.law.gyroscopic_ratio;
        left += now.rate_error.dot(error * products(w));
    }
    left
}

/// Effect of rotors that lag: of the thrust that acts against the commanded one, of the torque that acts against
/// what the law takes it for, and for controller 1 of the rate `w_a`.
fn behind_rotors(p: &Parameters, ticks: &Block, now: &Evaluated) -> Scalars {
    let mut left = all(0.0);
    if p.saturated.is_none() {
        left += now.attitude.error.xyz().dot(ticks.law.auxiliary_rate);
    }
    if p.left_in_the_mean > 0.0 {
        let mean = all(p.left_in_the_mean);
        let thrust = mean * (ticks.applied_thrust - ticks.thrust);
        let force = now.body_z * (thrust * all(p.inverse_mass));
        left += all(p.c) * now.translation.g.dot(force);
        let acting = ticks.torque + (ticks.applied_torque - ticks.torque) * mean;
        let missing = (acting - ticks.law.torque) * Vectors::all(p.rate_weight() / p.inertia);
        left += now.rate_error.dot(missing);
    }
    left
}

/// Motion of the vehicle over each tick.
struct Motion {
    position_error_change: Vectors,
    velocity_error_change: Vectors,
    rate_change: Vectors,
    rate_error_change: Vectors,
    /// Largest body rate over the tick (rad/s).
    rate: Scalars,
    /// Largest jerk of the reference over the tick (m/s^3).
    jerk: Scalars,
    /// Turn of the desired attitude, in its own axes (rad).
    desired_turn: Vectors,
    /// Turn of the auxiliary attitude (rad).
    auxiliary_turn: Scalars,
    /// Turn of the attitude error (rad).
    error_turn: Scalars,
    gyroscopic_change: Vectors,
}

impl Motion {
    fn new(from: &EvaluatedBlock, to: &EvaluatedBlock) -> Self {
        let (now, next) = (&from.v, &to.v);
        let change = |now: Vectors, next: Vectors| now.later(next) - now;
        let (rate, jerk) = (now.lengths.rate, now.lengths.jerk);
        let (desired, error) = (now.attitude.desired, now.attitude.error);
        let (here, there) = (&now.translation, &next.translation);
        Self {
            position_error_change: change(here.position_error, there.position_error),
            velocity_error_change: change(here.velocity_error, there.velocity_error),
            rate_change: change(from.ticks.rate, to.ticks.rate),
            rate_error_change: change(now.rate_error, next.rate_error),
            rate: rate.max(later(rate, next.lengths.rate)),
            jerk: jerk.max(later(jerk, next.lengths.jerk)),
            desired_turn: turn(desired, desired.later(next.attitude.desired)),
            auxiliary_turn: auxiliary_turn(&from.ticks, &to.ticks),
            error_turn: turn(error, error.later(next.attitude.error)).norm(),
            gyroscopic_change: change(now.gyroscopic, next.gyroscopic),
        }
    }

    /// Position and velocity: curvature of V1, and the drift of `e_v` and `e_v'` over the tick.
    fn translation_hold(&self, p: &Parameters, now: &Evaluated) -> Scalars {
        let change = self.velocity_error_change.norm();
        let position_change = self.position_error_change.norm();
        let force = now.lengths.alpha * all(p.inverse_mass);
        // |e_v'(t) - e_v'(t_k)| <= t (f/m |w| + |p_d'''|)
        let velocity_drift = all(0.5 * p.dt * p.dt) * (force * self.rate + self.jerk);
        let position_drift = all(0.5 * p.dt) * (change + all(2.0) * velocity_drift);
        let l1_change = all(p.k1) * position_change + all(p.k2) * change;
        let l2_change = all(p.k2) * change;
        let curvature = all(p.m1) * (l1_change * l1_change)
            + all(p.m2) * (l2_change * l2_change)
            + all(p.k1) * (change * change);
        let drift =
            all(p.k1) * now.lengths.sigma_1 * position_drift + now.lengths.g * velocity_drift;
        all(p.c) * (all(0.5) * curvature + drift)
    }

    /// Attitude: curvature of `2 (1 - eta_e)`, drift of `w`, and turns that do not commute.
    fn attitude_hold(&self, p: &Parameters, now: &Evaluated) -> Scalars {
        let (body, desired) = (all(p.dt) * self.rate, self.desired_turn.norm());
        let auxiliary = self.auxiliary_turn;
        let eps = now.attitude.error.xyz();
        let commutators = all(0.55) * (body * desired + body * auxiliary + desired * auxiliary);
        let coning = all(0.25 * p.dt) * body * self.rate_change.norm();
        let turn = self.error_turn;
        let cube = |x: Scalars| x * x * x;
        all(0.5 * p.dt) * eps.dot(self.rate_change)
            + now.lengths.attitude_error * (commutators + coning + cube(auxiliary) / all(12.0))
            + all(0.25) * turn * turn
            + cube(turn) / all(24.0)
    }

    /// Rate: curvature of the kinetic term, drift of the gyroscopic torque, implicit decay of `w_a`.
    fn rate_hold(&self, p: &Parameters, ticks: &Block, now: &Evaluated) -> Scalars {
        let change = self.rate_error_change;
        let kinetic = all(0.5) * change.dot(Vectors::all(p.rate_weight()) * change);
        let gyroscopic = all(p.dt) * self.gyroscopic_change.norm();
        let auxiliary = if p.saturated.is_some() {
            let law = &ticks.law;
            let rate =
                law.torque_excess * law.inverse_inertia - law.auxiliary_rate * Vectors::all(p.k4);
            all(p.k4.max_element() * p.dt * p.dt) * rate.norm()
        } else {
            // k4 acts on w_a one step ahead; nothing without a model of the rotors.
            let rate = ticks.law.regressor_rate - ticks.law.mu_dot;
            all(p.k4.max_element() * p.dt * p.dt) * rate.norm()
        };
        kinetic + now.lengths.rate_error * (gyroscopic + auxiliary)
    }
}

/// Turn of the auxiliary attitude (rad); none while it rests.
fn auxiliary_turn(from: &Block, to: &Block) -> Scalars {
    let now = from.law.auxiliary_attitude;
    let next = now.later(to.law.auxiliary_attitude);
    let rests = now.equal(next);
    if rests.all() { all(0.0) } else { rests.select(all(0.0), turn(now, next).norm()) }
}

/// Adaptation: curvature of the parameter terms.
fn adaptation_hold(p: &Parameters, now: &Evaluated) -> Scalars {
    let increments = &now.increments;
    all(p.c) * over(increments.inverse_mass * increments.inverse_mass, p.gamma1)
        + over_each(increments.inertia, p.gamma2)
        + p.saturated.map_or(all(0.0), |saturated| {
            over(increments.gyroscopic_ratio.length_squared(), saturated.gamma3)
        })
        + p.integral.map_or(all(0.0), |integral| {
            let [force, torque] = increments.lasting;
            all(p.c) * over(force.length_squared(), integral.gamma_d)
                + over(torque.length_squared(), integral.gamma_t)
        })
}
