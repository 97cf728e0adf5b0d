//! Balance of V from one tick to the next: the theorem's decrease, plus every perturbation of it.
//!
//! ```text
//! V[k+1] - V[k] <= dt (-W + rho_d + rho_v) + A
//! rho_d = c G . (d1 - D1 h(G, delta_t)) + w_e . (d2 - D2 h(w_e, delta_r))    controller 1
//! rho_d = c G . (d1 - D1 h(G, delta_t)) + w_e . (d2/J - D2/J_lo h(w_e, delta_r))        2
//!      <= 0.3003 (3 c D1 delta_t + 3 D2 delta_r / J')            while |d1| <= D1, |d2| <= D2
//! rho_v = eps_e . R_e^T (w_d,used - w_d,true) - w_e . J'' (mu'_true - mu'_used)
//! ```
//! with `J' = 1`, `J'' = J` for controller 1 and `J' = J_lo`, `J'' = I` for controller 2; `_true` are
//! differences over the tick. `rho_v` also holds what an adaptation that is switched off leaves over.
//! With integral action `rho_d` has `d1 - d_c` and `d2 - t_c`: what lasts, its estimate answers for.
//! `A = A_h + A_r`: `A_h` bounds the effect of holding the wrench over the tick, is made of second-order
//! terms only, and so shrinks with `dt^2`; `A_r` bounds the rounding of the `f32` controller.
//! Derivation: `docs/guarantees.md`.

use glam::DVec3;

use super::attitude::turn;
use super::parameters::Parameters;
use super::rounding::rounding;
use super::translation::smooth_sign;
use crate::evaluation::Evaluation;
use crate::norm::Norm;
use crate::plant::Disturbance;
use crate::tick::Tick;

/// `max_x (x - x h(x, 1)) = sqrt((5 sqrt 5 - 11)/2)`: the smooth sign loses at most this times
/// `D delta` against the discontinuous one. The paper uses 1.
pub const SMOOTHING: f64 = 0.300_283_106_000_8;

/// The terms of the balance over one tick.
#[derive(Clone, Copy, Debug)]
pub struct Balance {
    /// `V[k+1] - V[k]`.
    pub change: f64,
    /// `W` (1/s).
    pub decrease: f64,
    /// `rho_d`: the true disturbances against the smooth signs (1/s).
    pub disturbance: f64,
    /// Bound of `rho_d` while the disturbances keep theirs (1/s).
    pub smoothing: f64,
    /// `rho_v`: model-based `v'`, and everything else that `w_d` and `mu'` leave out (1/s).
    pub model: f64,
    /// `A_h`: bound of the effect of holding the wrench over the tick.
    pub hold: f64,
    /// `A_r`: bound of the effect of rounding to `f32`.
    pub rounding: f64,
}

impl Balance {
    /// `A = A_h + A_r`.
    #[must_use]
    pub fn allowance(&self) -> f64 {
        self.hold + self.rounding
    }

    /// `rho = rho_d + rho_v` (1/s).
    #[must_use]
    pub fn perturbation(&self) -> f64 {
        self.disturbance + self.model
    }

    /// By how much V rose beyond what it may, per second; not positive while the law holds.
    #[must_use]
    pub fn excess(&self, dt: f64) -> f64 {
        (self.change - self.allowance()) / dt + self.decrease - self.perturbation()
    }
}

/// The balance from `from` to `to`, two ticks in a row.
pub(super) fn balance(p: &Parameters, tick: &Tick, to: &Tick) -> Balance {
    let (now, next) = (&tick.evaluation, &to.evaluation);
    let motion = Motion::new(tick, to);
    let (error, w_e) = (now.attitude_error, now.rate_error);
    let used = tick.intermediates.desired_rate.as_dvec3();
    let rate_mismatch = error.inverse() * (used - motion.desired_turn / p.dt);
    let mu_dot_true = (to.intermediates.mu - tick.intermediates.mu).as_dvec3() / p.dt;
    let acceleration_mismatch =
        p.rate_weight() * (mu_dot_true - tick.intermediates.mu_dot.as_dvec3());
    let model = error.xyz().dot(rate_mismatch) - w_e.dot(acceleration_mismatch);
    Balance {
        change: next.value - now.value,
        decrease: now.decrease,
        disturbance: disturbance(p, tick, now),
        smoothing: smoothing(p, now),
        model: model + unadapted(p, tick, now),
        hold: motion.translation_hold(p, now, next)
            + motion.attitude_hold(p, now)
            + motion.rate_hold(p, tick)
            + adaptation_hold(p, now),
        rounding: rounding(p, tick, now),
    }
}

/// `rho_d`.
fn disturbance(p: &Parameters, tick: &Tick, now: &Evaluation) -> f64 {
    let Disturbance { acceleration_world: d1, torque_body: d2 } = tick.disturbance;
    let (g, w_e) = (now.translation.g, now.rate_error);
    let [d_c, t_c] =
        p.integral.map_or(Default::default(), |integral| [integral.acceleration, integral.torque]);
    let sign = smooth_sign(w_e, now.delta.1.value);
    let torque = match p.saturated {
        None => d2 - p.d2 * sign,
        Some(saturated) => saturated.inverse_inertia * d2 - p.d2 / p.inertia_set.0 * sign,
    };
    p.c * g.dot(d1 - d_c - p.d1 * now.translation.sign) + w_e.dot(torque - t_c)
}

/// `3 c D1 delta_t + 3 D2 delta_r / J'` with the exact constant.
fn smoothing(p: &Parameters, now: &Evaluation) -> f64 {
    let inverse_inertia = if p.saturated.is_some() { 1.0 / p.inertia_set.0 } else { 1.0 };
    3.0 * SMOOTHING * (p.c * p.d1 * now.delta.0.value + p.d2 * inverse_inertia * now.delta.1.value)
}

/// Effect of a parameter error whose adaptation is switched off.
fn unadapted(p: &Parameters, tick: &Tick, now: &Evaluation) -> f64 {
    let w = tick.truth.rate_body;
    let mut left = 0.0;
    if p.gamma1 == 0.0 {
        let force = now.lengths.alpha * (tick.truth.attitude * DVec3::Z);
        left += p.c * now.inverse_mass_error * now.translation.g.dot(force);
    }
    if p.gamma2 == 0.0 {
        let regressor = match p.saturated {
            None => {
                let mu_dot = tick.intermediates.mu_dot.as_dvec3();
                -(w.cross(w * now.inertia_error) + mu_dot * now.inertia_error)
            }
            Some(_) => now.inertia_error * tick.output.wrench.torque_body.as_dvec3(),
        };
        left += now.rate_error.dot(regressor);
    }
    if let Some(saturated) = p.saturated.filter(|saturated| saturated.gamma3 == 0.0) {
        let estimate = tick.estimates.gyroscopic_ratio.as_dvec3();
        let products = DVec3::new(w.y * w.z, w.x * w.z, w.x * w.y);
        left += now.rate_error.dot((saturated.gyroscopic_ratio - estimate) * products);
    }
    left
}

/// Motion of the vehicle over the tick.
struct Motion {
    velocity_error_change: DVec3,
    rate_change: DVec3,
    rate_error_change: DVec3,
    /// Largest body rate over the tick (rad/s).
    rate: f64,
    /// Turn of the desired attitude, in its own axes (rad).
    desired_turn: DVec3,
    /// Turn of the auxiliary attitude (rad).
    auxiliary_turn: f64,
    /// Turn of the attitude error (rad).
    error_turn: f64,
    gyroscopic_change: DVec3,
}

impl Motion {
    fn new(tick: &Tick, to: &Tick) -> Self {
        let (now, next) = (&tick.evaluation, &to.evaluation);
        let auxiliary = tick.auxiliary.attitude.as_dquat();
        let next_auxiliary = to.auxiliary.attitude.as_dquat();
        Self {
            velocity_error_change: next.translation.velocity_error - now.translation.velocity_error,
            rate_change: to.truth.rate_body - tick.truth.rate_body,
            rate_error_change: next.rate_error - now.rate_error,
            rate: now.lengths.rate.max(next.lengths.rate),
            desired_turn: turn(now.attitude.desired, next.attitude.desired),
            auxiliary_turn: if auxiliary == next_auxiliary {
                0.0
            } else {
                turn(auxiliary, next_auxiliary).norm()
            },
            error_turn: turn(now.attitude_error, next.attitude_error).norm(),
            gyroscopic_change: next.gyroscopic - now.gyroscopic,
        }
    }

    /// Position and velocity: curvature of V1, and the drift of `e_v` and `e_v'` over the tick.
    fn translation_hold(&self, p: &Parameters, now: &Evaluation, next: &Evaluation) -> f64 {
        let change = self.velocity_error_change.norm();
        let position_change = (next.position_error - now.position_error).norm();
        let jerk = now.lengths.jerk.max(next.lengths.jerk);
        let force = now.lengths.alpha * p.inverse_mass;
        // |e_v'(t) - e_v'(t_k)| <= t (f/m |w| + |p_d'''|)
        let velocity_drift = 0.5 * p.dt * p.dt * (force * self.rate + jerk);
        let position_drift = 0.5 * p.dt * (change + 2.0 * velocity_drift);
        let l1_change = p.k1 * position_change + p.k2 * change;
        let curvature =
            p.m1 * l1_change.powi(2) + p.m2 * (p.k2 * change).powi(2) + p.k1 * change.powi(2);
        let drift = p.k1 * now.lengths.sigma_1 * position_drift + now.lengths.g * velocity_drift;
        p.c * (0.5 * curvature + drift)
    }

    /// Attitude: curvature of `2 (1 - eta_e)`, drift of `w`, and turns that do not commute.
    fn attitude_hold(&self, p: &Parameters, now: &Evaluation) -> f64 {
        let (body, desired) = (p.dt * self.rate, self.desired_turn.norm());
        let auxiliary = self.auxiliary_turn;
        let eps = now.attitude_error.xyz();
        let commutators = 0.55 * (body * desired + body * auxiliary + desired * auxiliary);
        let coning = 0.25 * p.dt * body * self.rate_change.norm();
        let turn = self.error_turn;
        0.5 * p.dt * eps.dot(self.rate_change)
            + now.lengths.attitude_error * (commutators + coning + auxiliary.powi(3) / 12.0)
            + 0.25 * turn * turn
            + turn.powi(3) / 24.0
    }

    /// Rate: curvature of the kinetic term, drift of the gyroscopic torque, implicit decay of `w_a`.
    fn rate_hold(&self, p: &Parameters, tick: &Tick) -> f64 {
        let now = &tick.evaluation;
        let change = self.rate_error_change;
        let kinetic = 0.5 * change.dot(p.rate_weight() * change);
        let gyroscopic = p.dt * self.gyroscopic_change.norm();
        let auxiliary = if p.saturated.is_some() {
            let excess = tick.output.wrench.torque_body - tick.output.torque_demand_body;
            let rate = excess.as_dvec3() * tick.estimates.inverse_inertia.as_dvec3()
                - p.k4 * tick.auxiliary.rate.as_dvec3();
            p.k4 * p.dt * p.dt * rate.norm()
        } else {
            0.0
        };
        kinetic + now.lengths.rate_error * (gyroscopic + auxiliary)
    }
}

/// Adaptation: curvature of the parameter terms.
fn adaptation_hold(p: &Parameters, now: &Evaluation) -> f64 {
    let over = |square: f64, gamma: f64| if gamma > 0.0 { 0.5 * square / gamma } else { 0.0 };
    let increments = &now.increments;
    p.c * over(increments.inverse_mass.powi(2), p.gamma1)
        + over(increments.inertia.length_squared(), p.gamma2)
        + p.saturated.map_or(0.0, |saturated| {
            over(increments.gyroscopic_ratio.length_squared(), saturated.gamma3)
        })
        + p.integral.map_or(0.0, |integral| {
            let [force, torque] = increments.lasting;
            p.c * over(force.length_squared(), integral.gamma_d)
                + over(torque.length_squared(), integral.gamma_t)
        })
}
