//! The memory of both laws, its derivatives, and how the page advances it in discrete time.

use glam::DVec3;

use super::parameters::Gains;
use super::rotation::Quaternion;
use super::{Evaluation, Law};

/// Memory of a law. Fields of the other controller stay as they are.
#[derive(Clone, Copy, Debug)]
pub struct Memory {
    /// `E2 = exp(-2 delta_1 t)`.
    pub decay: f64,
    /// `beta` (1/kg).
    pub beta: f64,
    /// `a_hat` (kg m^2), controller 1.
    pub a_hat: DVec3,
    /// `theta_hat` (1/(kg m^2)), controller 2.
    pub theta_hat: DVec3,
    /// `Pi_hat`, controller 2.
    pub pi_hat: DVec3,
    /// `q_a`, controller 2.
    pub q_a: Quaternion,
    /// `w_a` (rad/s), controller 2; controller 1 behind rotors that lag.
    pub w_a: DVec3,
    /// `m`, the torque that acts by the model of the rotors (N m).
    pub acting: DVec3,
    /// The last `q_e`; none before the first step.
    pub q_e: Option<Quaternion>,
    /// The last `r2`; zero before the first step.
    pub r2: DVec3,
    /// `d_hat` (m/s^2).
    pub d_hat: DVec3,
    /// `t_hat` (N m), controller 1, or `s_hat` (rad/s^2), controller 2.
    pub lasting_torque: DVec3,
}

/// Time derivatives of the memory, projected as the page writes them.
#[derive(Clone, Copy, Debug, Default)]
pub struct MemoryRate {
    /// `beta'` (14).
    pub beta: f64,
    /// `a_hat'` (35).
    pub a_hat: DVec3,
    /// `theta_hat'` (51).
    pub theta_hat: DVec3,
    /// `Pi_hat'` (52).
    pub pi_hat: DVec3,
    /// `W_a` (38) (rad/s).
    pub auxiliary_rate: DVec3,
    /// `w_a'` (39) without its decay, `-k4 w_a` or for controller 1 `-diag(a_hat)^-1 k4 w_a` (rad/s^2).
    pub w_a_driven: DVec3,
    /// `d_hat'` (m/s^3).
    pub d_hat: DVec3,
    /// `t_hat'` or `s_hat'`.
    pub lasting_torque: DVec3,
}

/// Hysteresis of the sign of `q_e` (departure 10).
const FLIP_BELOW: f64 = -0.2;

impl Memory {
    /// Before the first step: known estimates, everything else at rest.
    #[must_use]
    pub fn starting(mass: f64, inertia: DVec3) -> Self {
        Self {
            decay: 1.0,
            beta: 1.0 / mass,
            a_hat: inertia,
            theta_hat: inertia.recip(),
            pi_hat: DVec3::ZERO,
            q_a: Quaternion::IDENTITY,
            w_a: DVec3::ZERO,
            acting: DVec3::ZERO,
            q_e: None,
            r2: DVec3::ZERO,
            d_hat: DVec3::ZERO,
            lasting_torque: DVec3::ZERO,
        }
    }

    /// `delta_t = sqrt(exp(-2 delta_1 t) + delta_min^2)` (departure 9).
    #[must_use]
    pub fn delta_translation(&self, gains: &Gains) -> f64 {
        (self.decay + gains.delta_min_translation.powi(2)).sqrt()
    }

    /// `delta_r`, with the floor of the rotation.
    #[must_use]
    pub fn delta_rotation(&self, gains: &Gains) -> f64 {
        (self.decay + gains.delta_min_rotation.powi(2)).sqrt()
    }

    /// The sign of `q_e` (departure 10): continuous in time, short way round at the start.
    #[must_use]
    pub fn sign(&self, q_e: Quaternion) -> Quaternion {
        let continuous = match self.q_e {
            Some(last) if last.dot(q_e) < 0.0 => q_e.negated(),
            None if q_e.eta < 0.0 => q_e.negated(),
            _ => q_e,
        };
        if continuous.eta < FLIP_BELOW { continuous.negated() } else { continuous }
    }

    /// Euler then clamp; `w_a`'s decay implicit; `q_a` renormalised; the smoothing decays.
    pub fn advance(&mut self, law: Law, gains: &Gains, evaluation: &Evaluation, dt: f64) {
        let rate = &evaluation.rate;
        self.beta = (self.beta + dt * rate.beta).clamp(1.0 / gains.m[1], 1.0 / gains.m[0]);
        let [lower, upper] = gains.j;
        let decay = match law {
            Law::RobustAdaptive => gains.k4 / self.a_hat,
            Law::Saturated => gains.k4,
        };
        self.a_hat = (self.a_hat + dt * rate.a_hat).clamp(lower, upper);
        self.theta_hat = (self.theta_hat + dt * rate.theta_hat).clamp(upper.recip(), lower.recip());
        self.pi_hat = (self.pi_hat + dt * rate.pi_hat).clamp(DVec3::NEG_ONE, DVec3::ONE);
        let turn = self.q_a.rate(rate.auxiliary_rate);
        self.q_a =
            Quaternion { eta: self.q_a.eta + dt * turn.eta, eps: self.q_a.eps + dt * turn.eps }
                .normalised();
        self.w_a = (self.w_a + dt * rate.w_a_driven) / (1.0 + decay * dt);
        self.acting = gains.rotors.after(self.acting, evaluation.torque);
        let d_c = gains.integral.d_c;
        self.d_hat = (self.d_hat + dt * rate.d_hat).clamp(DVec3::splat(-d_c), DVec3::splat(d_c));
        let bound = gains.lasting_torque_bound(law);
        self.lasting_torque = (self.lasting_torque + dt * rate.lasting_torque).clamp(-bound, bound);
        self.decay *= (-2.0 * gains.delta_1 * dt).exp();
        self.q_e = Some(evaluation.attitude_error);
        self.r2 = evaluation.lateral;
    }
}

/// `Proj[lower, upper](rate)`: no rate across the border of the set.
#[must_use]
pub fn project(x: f64, rate: f64, [lower, upper]: [f64; 2]) -> f64 {
    if (x <= lower && rate < 0.0) || (x >= upper && rate > 0.0) { 0.0 } else { rate }
}

/// [`project`] for each component.
#[must_use]
pub fn project_each(x: DVec3, rate: DVec3, [lower, upper]: [DVec3; 2]) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|i| project(x[i], rate[i], [lower[i], upper[i]])))
}
