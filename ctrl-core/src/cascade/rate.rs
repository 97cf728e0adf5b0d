//! Step 3: from the attitude error to the virtual rate `mu` and its exact derivative.
//!
//! With `nu = w - R_e^T w_r` the rate of the attitude error and `D = R_d`, or `R_a R_d` with an
//! auxiliary system (`W_a = 0` and `eps_a = 0` without one):
//!
//! ```text
//! q_e = (q_a ⊗ q_d)^-1 ⊗ q                                                   (27), (46)
//! w_r = w_d + R_d^T W_a
//! y   = (eta_e I + S(eps_e))^T D^T G
//! mu  = 2 c n S(e3)^T y - k3 eps_e + R_e^T w_d - k5 R_ta^T eps_a     n = beta f  (31), (49)
//! q_e' = 1/2 A(q_e) nu                                                       (28)
//! (R_e^T w_d)' = R_e^T w_d' - nu × R_e^T w_d
//! (D^T G)'     = D^T G' - w_r × D^T G
//! ```
//! The auxiliary terms in body axes are those of [`crate::auxiliary`]: with `o = R_ta^T W_a`,
//! `R_e^T w_r = R_e^T w_d + o`, `R_d^T W_a = R_e o` and `R_a W_a = D R_e o`.

use glam::{Mat3, Quat, Vec3};

use super::Cascade;
use super::attitude::DesiredAttitude;
use super::force::ForceCommand;
use crate::auxiliary::AuxiliaryTerms;
use crate::rotation::{quaternion_rate, transpose_mul, vector_part};

/// `mu` and its derivative.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VirtualRate {
    /// `mu` (rad/s).
    pub mu: Vec3,
    /// `mu'` (rad/s^2).
    pub mu_dot: Vec3,
    /// `R_a W_a`: rate of the auxiliary attitude in world axes (rad/s).
    pub auxiliary_rate_world: Vec3,
}

/// `x + weight S(e3)^T y`, where `S(e3)^T y = (y.y, -y.x, 0)`.
#[inline(always)]
fn add_coupling(x: Vec3, weight: f32, y: Vec3) -> Vec3 {
    Vec3::new(x.x + weight * y.y, x.y - weight * y.x, x.z)
}

/// Evaluates step 3 at attitude error `q_e` and body rate `rate_body`.
#[inline(always)]
pub(crate) fn virtual_rate(
    law: &Cascade,
    force: &ForceCommand,
    desired: &DesiredAttitude,
    q_e: Quat,
    rate_body: Vec3,
    auxiliary: Option<&AuxiliaryTerms>,
) -> VirtualRate {
    let r_e = Mat3::from_quat(q_e);
    let (eta, eps) = (q_e.w, vector_part(q_e));
    let k3 = law.gains.k3;

    // Feed-forward R_e^T w_d, and nu.
    let forward = transpose_mul(&r_e, desired.rate);
    let mut nu = rate_body - forward;
    let mut w_r = desired.rate;
    let mut auxiliary_rate_world = Vec3::ZERO;
    if let Some(terms) = auxiliary {
        let rate_body = terms.rate_body();
        let rate_desired = r_e * rate_body; // R_d^T W_a
        nu -= rate_body;
        w_r += rate_desired;
        auxiliary_rate_world = desired.axes_world * rate_desired;
    }
    let forward_dot = transpose_mul(&r_e, desired.rate_dot) - nu.cross(forward);
    let (eta_dot, eps_dot) = quaternion_rate(q_e, nu); // (28)

    // Coupling 2 c n S(e3)^T (eta I + S(eps))^T D^T G.
    let g = transpose_mul(&desired.axes_world, force.g);
    let g_dot = transpose_mul(&desired.axes_world, force.g_dot) - w_r.cross(g);
    let y = eta * g - eps.cross(g);
    let y_dot = eta_dot * g + eta * g_dot - eps_dot.cross(g) - eps.cross(g_dot);
    let twice_c = law.twice_c;
    let (weight, weight_dot) = (twice_c * force.n, twice_c * force.n_dot); // beta f = n

    let mut mu = add_coupling(forward - k3 * eps, weight, y); // (31), (49)
    let mut mu_dot = add_coupling(forward_dot - k3 * eps_dot, weight_dot, y);
    mu_dot = add_coupling(mu_dot, weight, y_dot);
    if let Some(terms) = auxiliary {
        mu -= terms.attitude_term();
        mu_dot -= terms.attitude_term_dot(rate_body);
    }
    VirtualRate { mu, mu_dot, auxiliary_rate_world }
}
