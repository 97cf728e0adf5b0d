//! Controller 2: robust adaptive with torque saturation (Theorem 2).

use glam::DVec3;

use super::cascade::{Attitude, Force, coupling, smooth_sign_value};
use super::memory::{Memory, MemoryRate, project_each};
use super::parameters::{Gains, ReferencePoint, Truth};
use super::robust_adaptive::shared_quantities;
use super::{Evaluation, Law};

/// One evaluation of the law.
#[must_use]
pub fn evaluate(gains: &Gains, truth: &Truth, r: &ReferencePoint, memory: &Memory) -> Evaluation {
    let Memory { q_a, w_a, theta_hat, pi_hat, .. } = *memory;
    let w = truth.w;
    let r_a = q_a.matrix();
    let r_ta = r_a.transpose() * truth.q.matrix(); // (41), departure 5
    let w_aux = r_ta * w_a - gains.k5 * q_a.eps; // W_a
    let q_a_dot = q_a.rate(w_aux); // (38)

    let force = Force::new(gains, truth, r, memory);
    let direction = r_a.transpose() * force.alpha; // r3 = unit(R_a^T alpha), q_a held (22)
    let desired = Attitude::new(direction, gains.g, r, memory.r2);
    let (r_d, w_d) = (desired.matrix, desired.rate);

    let q_e = desired.quaternion.inverse().times(q_a.inverse()).times(truth.q); // (46)
    let q_e = memory.sign(q_e);
    let r_e = r_d.transpose() * r_a.transpose() * truth.q.matrix();
    let w_r = w_d + r_d.transpose() * w_aux;
    let relative = w - r_e.transpose() * w_r;
    let q_e_dot = q_e.rate(relative);
    let feed = r_e.transpose() * w_d; // R_e^T w_d
    let feed_dot = r_e.transpose() * desired.rate_dot - relative.cross(feed);
    let r_ad = r_a * r_d;
    let u = r_ad.transpose() * force.g.value;
    let u_dot = r_ad.transpose() * force.g.first - w_r.cross(u);
    let back = r_ta.transpose() * q_a.eps; // R_ta^T eps_a
    let back_dot = r_ta.transpose() * q_a_dot.eps - (w - r_ta.transpose() * w_aux).cross(back);
    let (pull, pull_dot) = coupling(gains.c, &force, (q_e, q_e_dot), (u, u_dot));
    let mu = pull - gains.k3 * q_e.eps + feed - gains.k5 * back; // (49)
    let mu_dot = pull_dot - gains.k3 * q_e_dot.eps + feed_dot - gains.k5 * back_dot;
    let w_e = w - mu - w_a;

    let b = DVec3::new(w.y * w.z, w.x * w.z, w.x * w.y);
    let h = smooth_sign_value(w_e, memory.delta_rotation(gains));
    let bracket = -gains.k4 * (w - mu) - q_e.eps - pi_hat * b + mu_dot - gains.d2 / gains.j[0] * h;
    let tau_d = (bracket - memory.lasting_torque) / theta_hat; // (50)
    let (gamma_t, s) = (gains.integral.gamma_t, gains.lasting_torque_bound(Law::Saturated));
    let s_hat_dot = project_each(memory.lasting_torque, gamma_t * w_e, [-s, s]);
    let command = gains.rotors.command(tau_d, gains.m_tau, memory.acting); // (37)
    let (tau, tau_m) = (command.torque, command.acting);
    let driven = theta_hat * (tau_m - tau_d);
    let w_a_dot = -gains.k4 * w_a + driven; // (39)
    let theta_set = [gains.j[1].recip(), gains.j[0].recip()];
    let theta_hat_dot = project_each(theta_hat, gains.gamma2 * tau_m * w_e, theta_set); // (51)
    let pi_hat_dot = project_each(pi_hat, gains.gamma3 * b * w_e, [DVec3::NEG_ONE, DVec3::ONE]); // (52)

    let mut quantities = shared_quantities(&force, &desired);
    let vectors = [
        ("mu", mu),
        ("mu_dot", mu_dot),
        ("w_e", w_e),
        ("tau", tau),
        ("tau_d", tau_d),
        ("tau_m", tau_m),
        ("theta_hat_dot", theta_hat_dot),
        ("Pi_hat_dot", pi_hat_dot),
        ("W_a", w_aux),
        ("w_a_dot", w_a_dot),
        ("lasting_torque_dot", s_hat_dot),
    ];
    quantities.extend(vectors.map(|(name, x)| (name, x.to_array().to_vec())));
    let quaternions = [("q_e", q_e), ("q_a_dot", q_a_dot)];
    quantities.extend(quaternions.map(|(name, q)| (name, q.to_array().to_vec())));
    let rate = MemoryRate {
        beta: force.beta.first,
        theta_hat: theta_hat_dot,
        pi_hat: pi_hat_dot,
        auxiliary_rate: w_aux,
        w_a_driven: driven,
        d_hat: force.d_hat.first,
        lasting_torque: s_hat_dot,
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
