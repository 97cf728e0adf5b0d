//! Controller 1: robust adaptive (Theorem 1).

use glam::{DMat3, DVec3};

use super::cascade::{Attitude, Force, coupling, smooth_sign_value};
use super::memory::{Memory, MemoryRate, project_each};
use super::parameters::{Gains, ReferencePoint, Truth};
use super::rotation::skew;
use super::{Evaluation, Quantities};

/// One evaluation of the law.
#[must_use]
pub fn evaluate(gains: &Gains, truth: &Truth, r: &ReferencePoint, memory: &Memory) -> Evaluation {
    let w = truth.w;
    let force = Force::new(gains, truth, r, memory);
    let desired = Attitude::new(force.alpha, gains.g, r, memory.r2); // r3 = unit(alpha) (22)
    let (r_d, w_d) = (desired.matrix, desired.rate);

    let q_e = memory.sign(desired.quaternion.inverse().times(truth.q)); // (27)
    let r_e = r_d.transpose() * truth.q.matrix();
    let feed = r_e.transpose() * w_d; // R_e^T w_d
    let relative = w - feed;
    let q_e_dot = q_e.rate(relative);
    let feed_dot = r_e.transpose() * desired.rate_dot - relative.cross(feed);
    let u = r_d.transpose() * force.g.value;
    let u_dot = r_d.transpose() * force.g.first - w_d.cross(u);
    let (pull, pull_dot) = coupling(gains.c, &force, (q_e, q_e_dot), (u, u_dot));
    let mu = -gains.k3 * q_e.eps + feed + pull; // (31)
    let mu_dot = -gains.k3 * q_e_dot.eps + feed_dot + pull_dot;
    let w_e = w - mu - memory.w_a; // w_a is zero but behind rotors that lag

    let demand = torque(gains, w, memory, q_e.eps, w - mu, mu_dot);
    let command = gains.rotors.command(demand, DVec3::MAX, memory.acting);
    let (tau, tau_m) = (command.torque, command.acting);
    // diag(a_hat)^-1 (tau_m - demand - k4 w_a), its decay implicit over dt
    let w_a_dot =
        (tau_m - demand - gains.k4 * memory.w_a) / (memory.a_hat + gains.rotors.dt * gains.k4);
    let y = regressor(w, mu_dot) + DMat3::from_diagonal(w_a_dot);
    let a_hat_dot = -gains.gamma2 * (y.transpose() * w_e);
    let a_hat_dot = project_each(memory.a_hat, a_hat_dot, gains.j); // (35)

    let mut quantities = shared_quantities(&force, &desired);
    let vectors = [
        ("mu", mu),
        ("mu_dot", mu_dot),
        ("w_e", w_e),
        ("tau", tau),
        ("tau_m", tau_m),
        ("w_a_dot", w_a_dot),
        ("a_hat_dot", a_hat_dot),
    ];
    quantities.extend(vectors.map(|(name, x): (_, DVec3)| (name, x.to_array().to_vec())));
    quantities.insert("q_e", q_e.to_array().to_vec());
    let (gamma_t, d_t) = (gains.integral.gamma_t, DVec3::splat(gains.integral.d_t));
    let t_hat_dot = project_each(memory.lasting_torque, gamma_t * w_e, [-d_t, d_t]);
    quantities.insert("lasting_torque_dot", t_hat_dot.to_array().to_vec());
    let rate = MemoryRate {
        beta: force.beta.first,
        a_hat: a_hat_dot,
        w_a_driven: (tau_m - demand) / memory.a_hat,
        d_hat: force.d_hat.first,
        lasting_torque: t_hat_dot,
        ..MemoryRate::default()
    };
    Evaluation {
        quantities,
        thrust: force.f.value,
        torque: tau,
        rate,
        attitude_error: q_e,
        lateral: desired.lateral,
    }
}

/// `Y` (34).
fn regressor(w: DVec3, mu_dot: DVec3) -> DMat3 {
    skew(w) * DMat3::from_diagonal(w) + DMat3::from_diagonal(mu_dot)
}

/// `tau` (34), from what step 3 gives; `ahead` is `w - mu`.
fn torque(
    gains: &Gains,
    w: DVec3,
    memory: &Memory,
    eps_e: DVec3,
    ahead: DVec3,
    mu_dot: DVec3,
) -> DVec3 {
    let h = smooth_sign_value(ahead - memory.w_a, memory.delta_rotation(gains));
    let y = regressor(w, mu_dot);
    -gains.k4 * ahead - eps_e + y * memory.a_hat - gains.d2 * h - memory.lasting_torque
}

/// The quantities of steps 1 and 2, alike for both controllers.
#[must_use]
pub fn shared_quantities(force: &Force, desired: &Attitude) -> Quantities {
    let vectors = [
        ("e_p", force.e_p),
        ("e_v", force.e_v),
        ("G", force.g.value),
        ("alpha", force.alpha.value),
        ("alpha_dot", force.alpha.first),
        ("alpha_ddot", force.alpha.second),
        ("w_d", desired.rate),
        ("w_d_dot", desired.rate_dot),
        ("d_hat_dot", force.d_hat.first),
    ];
    let scalars = [("f", force.f.value), ("beta_dot", force.beta.first)];
    let vectors = vectors.map(|(name, x)| (name, x.to_array().to_vec()));
    vectors.into_iter().chain(scalars.map(|(name, x)| (name, vec![x]))).collect()
}
