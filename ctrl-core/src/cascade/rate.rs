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
//! The auxiliary terms are simplest in body axes. As `R_a eps_a = eps_a`, let
//! `E = R_ta^T eps_a = R^T eps_a` and `o = R_ta^T W_a = w_a - k5 E`; then
//! `R_e^T w_r = R_e^T w_d + o`, `R_d^T W_a = R_e o` and `E' = 1/2 (eta_a o + E × o) - (w - o) × E`.

use glam::{Mat3, Quat, Vec3};

use super::Cascade;
use super::attitude::DesiredAttitude;
use super::force::ForceCommand;
use crate::controller::Auxiliary;
use crate::rotation::{quaternion_rate, transpose_mul, vector_part};

/// What the auxiliary system of controller 2 contributes, in body axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AuxiliaryTerms {
    /// `o = R_ta^T W_a` [rad/s].
    rate_body: Vec3,
    /// `R o = R_a W_a`, the same in world axes [rad/s].
    pub rate_world: Vec3,
    /// `k5 E = k5 R_ta^T eps_a` [rad/s].
    virtual_rate: Vec3,
    /// `(k5 E)'` [rad/s^2].
    virtual_rate_dot: Vec3,
}

impl AuxiliaryTerms {
    /// From the auxiliary system, `R(q)` and the body rate `w`.
    #[inline(always)]
    pub fn new(auxiliary: &Auxiliary, k5: f32, r: &Mat3, w: Vec3) -> Self {
        let eps_body = transpose_mul(r, vector_part(auxiliary.attitude)); // E
        let virtual_rate = k5 * eps_body;
        let rate_body = auxiliary.rate - virtual_rate; // o
        let own = auxiliary.attitude.w * rate_body + eps_body.cross(rate_body);
        Self {
            rate_body,
            rate_world: *r * rate_body,
            virtual_rate,
            virtual_rate_dot: k5 * (0.5 * own - (w - rate_body).cross(eps_body)),
        }
    }
}

/// `mu` and its derivative.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VirtualRate {
    /// `mu` [rad/s].
    pub mu: Vec3,
    /// `mu'` [rad/s^2].
    pub mu_dot: Vec3,
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
    let relative = rate_body - forward;
    let nu = auxiliary.map_or(relative, |terms| relative - terms.rate_body);
    let forward_dot = transpose_mul(&r_e, desired.rate_dot) - nu.cross(forward);
    let (eta_dot, eps_dot) = quaternion_rate(q_e, nu); // (28)

    // Coupling 2 c n S(e3)^T (eta I + S(eps))^T D^T G.
    let w_r = auxiliary.map_or(desired.rate, |terms| desired.rate + r_e * terms.rate_body);
    let g = transpose_mul(&desired.axes_world, force.g);
    let g_dot = transpose_mul(&desired.axes_world, force.g_dot) - w_r.cross(g);
    let y = eta * g - eps.cross(g);
    let y_dot = eta_dot * g + eta * g_dot - eps_dot.cross(g) - eps.cross(g_dot);
    let twice_c = 2.0 * law.gains.c;
    let (weight, weight_dot) = (twice_c * force.n, twice_c * force.n_dot); // beta f = n

    let mu = add_coupling(forward - k3 * eps, weight, y); // (31), (49)
    let mu_dot = add_coupling(forward_dot - k3 * eps_dot, weight_dot, y);
    let mu_dot = add_coupling(mu_dot, weight, y_dot);
    match auxiliary {
        None => VirtualRate { mu, mu_dot },
        Some(terms) => {
            VirtualRate { mu: mu - terms.virtual_rate, mu_dot: mu_dot - terms.virtual_rate_dot }
        }
    }
}
