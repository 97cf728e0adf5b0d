//! Common part of both controllers: steps 1 to 3, from position to the desired attitude.

use glam::{DMat3, DVec3};

use super::jet::{Jet, chain_each, jet, product};
use super::memory::{Memory, project, project_each};
use super::parameters::{Gains, ReferencePoint, Truth};
use super::rotation::{Quaternion, vee};

/// The force command with its derivatives, and the mass adaptation.
#[derive(Clone, Copy, Debug)]
pub struct Force {
    /// `e_p` (m).
    pub e_p: DVec3,
    /// `e_v` (m/s).
    pub e_v: DVec3,
    /// `G` (16); its second derivative is not used.
    pub g: Jet<DVec3>,
    /// `alpha` (13).
    pub alpha: Jet<DVec3>,
    /// `f` (21).
    pub f: Jet<f64>,
    /// `beta` (14); its second derivative is zero on the border of its set.
    pub beta: Jet<f64>,
    /// `d_hat` of the integral action, likewise.
    pub d_hat: Jet<DVec3>,
}

/// `sig_i(x) = M tanh(x)`, element-wise.
fn sigma(m: f64, x: Jet<DVec3>) -> Jet<DVec3> {
    chain_each(x, |x| {
        let (t, slope) = (x.tanh(), 1.0 - x.tanh().powi(2));
        [m * t, m * slope, -2.0 * m * t * slope]
    })
}

/// `h(x, delta) = x / sqrt(x^2 + delta^2)`, element-wise, delta held constant (17).
fn smooth_sign(x: Jet<DVec3>, delta: f64) -> Jet<DVec3> {
    chain_each(x, |x| {
        let root = (x * x + delta * delta).sqrt();
        let d2 = delta * delta;
        [x / root, d2 / root.powi(3), -3.0 * x * d2 / root.powi(5)]
    })
}

/// Smooth sign of a plain vector.
#[must_use]
pub fn smooth_sign_value(x: DVec3, delta: f64) -> DVec3 {
    smooth_sign(jet(x, DVec3::ZERO, DVec3::ZERO), delta).value
}

/// The motion as one pass knows it: `v'`, `v''`, and the derivatives of `beta`.
#[derive(Clone, Copy, Default)]
struct Known {
    v_dot: DVec3,
    v_ddot: DVec3,
    beta_dot: f64,
    beta_ddot: f64,
    d_hat_dot: DVec3,
    d_hat_ddot: DVec3,
}

/// One evaluation of (16), (13), (21); right up to the derivatives that `known` covers.
fn pass(gains: &Gains, truth: &Truth, r: &ReferencePoint, memory: &Memory, known: Known) -> Force {
    let Gains { k1, k2, m1, m2, .. } = *gains;
    let e_p = jet(truth.p - r.p, truth.v - r.v, known.v_dot - r.a);
    let e_v = jet(truth.v - r.v, known.v_dot - r.a, known.v_ddot - r.jerk);
    let l1 = k1 * e_p + k2 * e_v;
    let l2 = k2 * e_v;
    let (sigma1, sigma2) = (sigma(m1, l1), sigma(m2, l2));
    let g = k2 * sigma1 + k2 * sigma2 + k1 * e_v; // (16)
    let h = smooth_sign(g, memory.delta_translation(gains)); // (17)
    let demand = jet(gains.g * DVec3::Z + r.a, r.jerk, r.snap);
    let beta = jet(memory.beta, known.beta_dot, known.beta_ddot);
    let d_hat = jet(memory.d_hat, known.d_hat_dot, known.d_hat_ddot);
    let alpha = beta.recip() * (demand - sigma1 - sigma2 - gains.d1 * h - d_hat); // (13)
    Force { e_p: e_p.value, e_v: e_v.value, g, alpha, f: alpha.norm(), beta, d_hat } // (21)
}

impl Force {
    /// Three passes: alpha; alpha' with v' and beta'; alpha'' with v'' and beta''.
    #[must_use]
    pub fn new(gains: &Gains, truth: &Truth, r: &ReferencePoint, memory: &Memory) -> Self {
        let set = [1.0 / gains.m[1], 1.0 / gains.m[0]];
        let thrust_axis = truth.q.matrix() * DVec3::Z; // R e3
        let axis_rate = truth.q.matrix() * truth.w.cross(DVec3::Z); // R (w x e3)
        let run = |known| pass(gains, truth, r, memory, known);
        let beta = memory.beta;

        let first = run(Known::default());
        let (f, g) = (first.f.value, first.g.value);
        let free = gains.gamma1 * g.dot(f * thrust_axis);
        let beta_dot = project(beta, free, set); // (14)
        let v_dot = -gains.g * DVec3::Z + beta * f * thrust_axis + memory.d_hat;
        let (gamma_d, d_c) = (gains.integral.gamma_d, DVec3::splat(gains.integral.d_c));
        let horizontal = DVec3::new(1.0, 1.0, 0.0);
        let d_hat_dot = project_each(memory.d_hat, gamma_d * g * horizontal, [-d_c, d_c]);
        let known = Known { v_dot, beta_dot, d_hat_dot, ..Known::default() };

        let second = run(known);
        let (f_dot, g_dot) = (second.f.first, second.g.first);
        let force_rate = f_dot * thrust_axis + f * axis_rate; // (f R e3)'
        let free = gains.gamma1 * (g_dot.dot(f * thrust_axis) + g.dot(force_rate));
        let beta_ddot = if beta_dot == 0.0 { 0.0 } else { free };
        let v_ddot = beta_dot * f * thrust_axis + beta * force_rate + d_hat_dot;
        let moves = DVec3::select(d_hat_dot.cmpne(DVec3::ZERO), DVec3::ONE, DVec3::ZERO);
        let d_hat_ddot = gamma_d * g_dot * moves;
        run(Known { v_ddot, beta_ddot, d_hat_ddot, ..known })
    }
}

/// Desired attitude with rate and angular acceleration.
#[derive(Clone, Copy, Debug)]
pub struct Attitude {
    /// `R_d`.
    pub matrix: DMat3,
    /// `q_d`, either sign.
    pub quaternion: Quaternion,
    /// `w_d` (25).
    pub rate: DVec3,
    /// `w_d'`.
    pub rate_dot: DVec3,
    /// `r2`.
    pub lateral: DVec3,
}

impl Attitude {
    /// From `r3 = unit(direction)`; `held` is the last `r2`, for where it is singular.
    #[must_use]
    pub fn new(direction: Jet<DVec3>, g: f64, r: &ReferencePoint, held: DVec3) -> Self {
        let r3 = direction.unit();
        let b3 = jet(g * DVec3::Z + r.a, r.jerk, r.snap).unit();
        let b2 = jet(r.b2, r.b2_dot, r.b2_ddot);
        let lateral = r3.dot(b3) * b2 - r3.dot(b2) * b3; // (23)
        let r2 = if lateral.value.length() > 1e-6 {
            lateral.unit()
        } else {
            jet(held, DVec3::ZERO, DVec3::ZERO)
        };
        let r1 = r2.cross(r3); // (24)
        let columns =
            |pick: fn(&Jet<DVec3>) -> DVec3| DMat3::from_cols(pick(&r1), pick(&r2), pick(&r3));
        let matrix = jet(columns(|r| r.value), columns(|r| r.first), columns(|r| r.second));
        let transposed =
            jet(matrix.value.transpose(), matrix.first.transpose(), matrix.second.transpose());
        let rate_matrix = jet(matrix.first, matrix.second, DMat3::ZERO);
        let turning = product(transposed, rate_matrix, |x, y| x * y); // R_d^T R_d', first order
        Self {
            matrix: matrix.value,
            quaternion: Quaternion::from_matrix(matrix.value),
            rate: vee(turning.value), // (25)
            rate_dot: vee(turning.first),
            lateral: r2.value,
        }
    }
}

/// `2 c beta f S(e3)^T (eta_e I + S(eps_e))^T u` with its time derivative, for the coupling terms
/// of (31), (49), from `u = R_d^T G` or `(R_a R_d)^T G` and the derivatives of the factors.
#[must_use]
pub fn coupling(
    c: f64,
    force: &Force,
    (q_e, q_e_dot): (Quaternion, Quaternion),
    (u, u_dot): (DVec3, DVec3),
) -> (DVec3, DVec3) {
    let s = super::rotation::skew(DVec3::Z).transpose() * (2.0 * c);
    let (a, a_dot) = (q_e.coupling(), q_e_dot.coupling());
    let beta_f = force.beta.value * force.f.value;
    let beta_f_dot = force.beta.first * force.f.value + force.beta.value * force.f.first;
    let value = s * (beta_f * (a * u));
    let rate = s * (beta_f_dot * (a * u) + beta_f * (a_dot * u) + beta_f * (a * u_dot));
    (value, rate)
}
