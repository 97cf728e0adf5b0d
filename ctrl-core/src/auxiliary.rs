//! The auxiliary system (38) to (41) of controller 2: state, terms in step 3, and one fixed step.
//!
//! ```text
//! R_ta = R_a^T R                                                             (40)
//! W_a  = R_ta w_a - k5 eps_a                                                 (41)
//! q_a' = 1/2 A(q_a) W_a                                                      (38)
//! w_a' = -k4 w_a + diag(theta_hat)(tau - tau_d)                              (39)
//! ```
//! The terms are simplest in body axes. As `R_a eps_a = eps_a`, let `E = R_ta^T eps_a = R^T eps_a` and
//! `o = R_ta^T W_a = w_a - k5 E`; then `q_a` moves with the world-frame rate `R_a W_a = R o`, and
//! `E' = 1/2 (eta_a o + E × o) - (w - o) × E = 1/2 eta_a o + E × (w - o/2)`.

use glam::{Mat3, Quat, Vec3};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::controller::StepStatus;
use crate::rotation::{renormalised, rotate_back, transpose_mul, vector_part};
use crate::saturation::clip;

/// Largest turn of the auxiliary attitude in one step (rad) that its integration follows; a larger
/// auxiliary rate is clipped. Beyond every rate of a vehicle: 500 rad/s at 1 kHz.
const TURN_MAX: f32 = 0.5;

/// Below this sum of squares of `w_a` (rad/s) and `eps_a` the auxiliary system counts as at rest: 1e-7
/// is the rounding of a unit quaternion, and an exponential decay would end in subnormal numbers. Not
/// while a torque saturates or lags: dropped tick after tick, what that takes would never enter (39).
const REST_SQUARE: f32 = 1e-14;

/// The auxiliary system (38), (39) of controller 2; at rest for controller 1.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct Auxiliary {
    /// `q_a`: auxiliary attitude.
    pub attitude: Quat,
    /// `w_a`: auxiliary rate (rad/s).
    pub rate: Vec3,
}

impl Auxiliary {
    /// Identity attitude, zero rate: where it starts and stays while no torque saturates.
    pub const REST: Self = Self { attitude: Quat::IDENTITY, rate: Vec3::ZERO };
}

/// The auxiliary system as step 3 uses it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AuxiliaryTerms {
    /// `eta_a`.
    eta: f32,
    /// `E = R^T eps_a`.
    eps_body: Vec3,
    /// `w_a` (rad/s).
    rate: Vec3,
    /// `k5` (1/s).
    k5: f32,
}

impl AuxiliaryTerms {
    /// The terms at `auxiliary`, for a vehicle with attitude matrix `r`.
    #[inline(always)]
    pub fn new(auxiliary: &Auxiliary, k5: f32, r: &Mat3) -> Self {
        let eps_body = transpose_mul(r, vector_part(auxiliary.attitude));
        Self { eta: auxiliary.attitude.w, eps_body, rate: auxiliary.rate, k5 }
    }

    /// `o = R_ta^T W_a` (rad/s).
    #[inline(always)]
    pub fn rate_body(&self) -> Vec3 {
        self.rate - self.k5 * self.eps_body
    }

    /// `k5 R_ta^T eps_a`: what (49) takes off `mu` (rad/s).
    #[inline(always)]
    pub fn attitude_term(&self) -> Vec3 {
        self.k5 * self.eps_body
    }

    /// Derivative of [`attitude_term`](Self::attitude_term) at body rate `w` (rad/s^2).
    #[inline(always)]
    pub fn attitude_term_dot(&self, w: Vec3) -> Vec3 {
        let (eps, o) = (self.eps_body, self.rate_body());
        self.k5 * ((0.5 * self.eta) * o + eps.cross(w - 0.5 * o))
    }
}

/// Integration of the auxiliary system at a fixed step, prepared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AuxiliaryIntegrator {
    /// `1/(1 + k4 dt)`: one implicit step of the decay in (39), about each axis.
    decay: Vec3,
    /// Largest auxiliary rate that a step follows (rad/s).
    pub rate_max: f32,
}

impl AuxiliaryIntegrator {
    /// Prepares steps of `step_period` (s) with rate gain `k4` about each axis (1/s).
    pub fn new(k4: Vec3, step_period: f32) -> Self {
        Self { decay: 1.0 / (1.0 + k4 * step_period), rate_max: TURN_MAX / step_period }
    }

    /// Advances `auxiliary` (at rest if `None`) by `dt`: (38) explicitly, brought back to unit length, and
    /// (39) implicitly in the decay. `rate_world` is `R_a W_a`, `drive` is `diag(theta_hat)(tau - tau_d)`.
    #[inline(always)]
    pub fn advance(
        &self,
        auxiliary: &mut Option<Auxiliary>,
        dt: f32,
        rate_world: Vec3,
        drive: Vec3,
        driven: bool,
    ) -> StepStatus {
        let Auxiliary { attitude, rate } = auxiliary.unwrap_or(Auxiliary::REST);
        // q_a' = 1/2 A(q_a) W_a = 1/2 [0, R o] ⊗ q_a (38)
        let half_turn = (0.5 * dt) * rate_world;
        let (eta, eps) = (attitude.w, vector_part(attitude));
        let next = eps + eta * half_turn + half_turn.cross(eps);
        let q = Quat::from_xyzw(next.x, next.y, next.z, eta - half_turn.dot(eps));
        let attitude = renormalised(q).unwrap_or(Quat::IDENTITY);
        let mut rate = (rate + dt * drive) * self.decay; // (39)
        let mut status = StepStatus::empty();
        let square = rate.length_squared();
        if square > self.rate_max * self.rate_max {
            rate = clip(rate, Vec3::splat(self.rate_max));
            status = StepStatus::AUXILIARY_CLIPPED;
        }
        let moving = driven || square + next.length_squared() > REST_SQUARE;
        *auxiliary = moving.then_some(Auxiliary { attitude, rate });
        status
    }
}

/// `W_a` (41) in its own axes, from `R_a W_a`, for an observer.
pub(crate) fn attitude_rate(auxiliary: Option<Auxiliary>, rate_world: Vec3) -> Vec3 {
    rotate_back(auxiliary.unwrap_or(Auxiliary::REST).attitude, rate_world)
}

/// `w_a'` (39), for an observer.
pub(crate) fn rate_dot(auxiliary: Option<Auxiliary>, k4: Vec3, drive: Vec3) -> Vec3 {
    drive - k4 * auxiliary.unwrap_or(Auxiliary::REST).rate
}
