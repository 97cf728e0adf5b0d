//! V and its ingredients at one tick.

use ctrl_core::controller::StepStatus;
use glam::DVec3;

use super::adaptation::Resolved;
use super::parameters::Parameters;
use crate::evaluation::{Attitude, Evaluation, Increments, Lengths, Translation};
use crate::plant::PlantParameters;
use crate::tick::Tick;
use ctrl_core::controller::ControllerConfig;

/// Status of steps whose following tick the proof does not cover: the law was not evaluated as written,
/// or a sign or an axis jumped.
pub(super) const OUTSIDE_THE_PROOF: StepStatus = StepStatus::FAULT
    .union(StepStatus::ATTITUDE_RENORMALISED)
    .union(StepStatus::REFERENCE_CLIPPED)
    .union(StepStatus::HEADING_HELD)
    .union(StepStatus::SIGN_FLIPPED)
    .union(StepStatus::AUXILIARY_CLIPPED);

/// Evaluates V tick by tick.
#[derive(Clone, Debug)]
pub struct Evaluator {
    pub(super) parameters: Parameters,
    inverse_mass: Resolved,
    inertia: Resolved,
    gyroscopic_ratio: Resolved,
    lasting: [Resolved; 2],
    increments: Increments,
}

/// Estimates of one tick with all their digits.
struct Estimated {
    inverse_mass: f64,
    /// `a_hat` or `theta_hat`.
    inertia: DVec3,
    gyroscopic_ratio: DVec3,
    /// `d_hat`, and `t_hat` or `s_hat`.
    lasting: [DVec3; 2],
}

impl Evaluator {
    /// For `law` on the vehicle with the true `parameters`.
    #[must_use]
    pub fn new(law: &ControllerConfig, parameters: &PlantParameters) -> Self {
        Self {
            parameters: Parameters::new(law, parameters),
            inverse_mass: Resolved::default(),
            inertia: Resolved::default(),
            gyroscopic_ratio: Resolved::default(),
            lasting: [Resolved::default(); 2],
            increments: Increments::default(),
        }
    }

    /// V at this tick; call once per tick, in order.
    pub fn evaluate(&mut self, tick: &Tick) -> Evaluation {
        let estimated = self.estimated(tick);
        let p = &self.parameters;
        let delta = p.widths(tick.tick);
        let [d_hat, torque_hat] = estimated.lasting;
        let translation = Translation::new(p, tick, estimated.inverse_mass, d_hat, delta.0.value);
        let attitude = Attitude::new(
            translation.alpha,
            &tick.reference,
            tick.auxiliary.attitude.as_dquat(),
            tick.truth.attitude,
            tick.intermediates.attitude_error.as_dquat(),
        );
        let mu = tick.intermediates.mu.as_dvec3();
        let rate_error = tick.truth.rate_body - mu - tick.auxiliary.rate.as_dvec3();
        let mut evaluation = Evaluation {
            position_error: translation.position_error,
            attitude_error: attitude.error,
            rate_error,
            value: 0.0,
            parameter_part: 0.0,
            decrease: p.c * translation.decrease
                + p.k3 * attitude.error.xyz().length_squared()
                + p.k4 * rate_error.length_squared(),
            translation,
            attitude,
            lengths: Lengths::new(tick, &translation, attitude.error, rate_error),
            gyroscopic: p.gyroscopic(tick.truth.rate_body),
            inverse_mass_error: p.inverse_mass - estimated.inverse_mass,
            inertia_error: p.inertia_parameter() - estimated.inertia,
            lasting_error: p
                .integral
                .map_or(Default::default(), |it| [it.acceleration - d_hat, it.torque - torque_hat]),
            delta,
            increments: Increments::default(),
            inverse_mass: estimated.inverse_mass,
        };
        evaluation.parameter_part = parameter_part(p, &evaluation, estimated.gyroscopic_ratio);
        evaluation.value = state_part(p, &evaluation) + evaluation.parameter_part;
        evaluation.increments = increments(p, &evaluation, tick);
        self.increments = evaluation.increments;
        evaluation
    }

    /// `tick` with its evaluation; call once per tick, in order.
    #[must_use]
    pub fn evaluated(&mut self, tick: &Tick) -> Tick {
        Tick { evaluation: self.evaluate(tick), ..*tick }
    }

    fn estimated(&mut self, tick: &Tick) -> Estimated {
        let (p, estimates) = (&self.parameters, &tick.estimates);
        let (reported, set) = if p.saturated.is_some() {
            let set = (1.0 / p.inertia_set.1, 1.0 / p.inertia_set.0);
            (estimates.inverse_inertia.as_dvec3(), set)
        } else {
            (estimates.inertia.as_dvec3(), p.inertia_set)
        };
        let increments = self.increments;
        let lasting = match &p.integral {
            None => [DVec3::ZERO; 2],
            Some(integral) => {
                let [force, torque] = &mut self.lasting;
                let (d_c, t_c) = integral.bounds;
                let reported = if p.saturated.is_some() {
                    tick.lasting.angular_acceleration_body
                } else {
                    tick.lasting.torque_body
                };
                let d_hat = tick.lasting.acceleration_world.as_dvec3();
                [
                    force.advance(increments.lasting[0], (-d_c, d_c), d_hat),
                    torque.advance(increments.lasting[1], (-t_c, t_c), reported.as_dvec3()),
                ]
            }
        };
        let inverse_mass = DVec3::splat(estimates.inverse_mass.into());
        let moved = DVec3::splat(increments.inverse_mass);
        Estimated {
            inverse_mass: self.inverse_mass.advance(moved, p.inverse_mass_set, inverse_mass).x,
            inertia: self.inertia.advance(increments.inertia, set, reported),
            gyroscopic_ratio: self.gyroscopic_ratio.advance(
                increments.gyroscopic_ratio,
                (-1.0, 1.0),
                estimates.gyroscopic_ratio.as_dvec3(),
            ),
            lasting,
        }
    }
}

/// The part of V due to position, velocity, attitude and rate.
fn state_part(p: &Parameters, evaluation: &Evaluation) -> f64 {
    let error = evaluation.attitude_error;
    // 1 - eta = |eps|^2/(1 + eta) keeps its digits near the identity.
    let attitude =
        if error.w > 0.0 { error.xyz().length_squared() / (1.0 + error.w) } else { 1.0 - error.w };
    let rate = evaluation.rate_error;
    p.c * evaluation.translation.potential + 2.0 * attitude + 0.5 * rate.dot(p.rate_weight() * rate)
}

/// The part of V due to the estimates.
fn parameter_part(p: &Parameters, evaluation: &Evaluation, ratio: DVec3) -> f64 {
    let over = |square: f64, gamma: f64| if gamma > 0.0 { 0.5 * square / gamma } else { 0.0 };
    let mass = over(evaluation.inverse_mass_error.powi(2), p.gamma1);
    let inertia = over(evaluation.inertia_error.length_squared(), p.gamma2);
    let ratio = p.saturated.map_or(0.0, |saturated| {
        over((saturated.gyroscopic_ratio - ratio).length_squared(), saturated.gamma3)
    });
    let lasting = p.integral.map_or(0.0, |integral| {
        let [acceleration, torque] = evaluation.lasting_error;
        p.c * over(acceleration.length_squared(), integral.gamma_d)
            + over(torque.length_squared(), integral.gamma_t)
    });
    p.c * mass + inertia + ratio + lasting
}

/// The update laws (14), (35), (51), (52) and those of the integral action over one tick, before projection.
fn increments(p: &Parameters, evaluation: &Evaluation, tick: &Tick) -> Increments {
    let (w, w_e) = (tick.truth.rate_body, evaluation.rate_error);
    let thrust = evaluation.lengths.alpha;
    let body_z = tick.truth.attitude * DVec3::Z;
    let inverse_mass = p.dt * p.gamma1 * thrust * evaluation.translation.g.dot(body_z);
    let (inertia, gyroscopic_ratio) = match p.saturated {
        None => {
            // Y^T w_e = -w * (w x w_e) + mu' * w_e, element-wise.
            let mu_dot = tick.intermediates.mu_dot.as_dvec3();
            (-p.dt * p.gamma2 * (mu_dot * w_e - w * w.cross(w_e)), DVec3::ZERO)
        }
        Some(saturated) => {
            let torque = tick.output.wrench.torque_body.as_dvec3();
            let products = DVec3::new(w.y * w.z, w.x * w.z, w.x * w.y);
            (p.dt * p.gamma2 * torque * w_e, p.dt * saturated.gamma3 * products * w_e)
        }
    };
    let lasting = p.integral.map_or(Default::default(), |integral| {
        let g = evaluation.translation.g;
        let horizontal = DVec3::new(g.x, g.y, 0.0);
        [p.dt * integral.gamma_d * horizontal, p.dt * integral.gamma_t * w_e]
    });
    Increments { inverse_mass, inertia, gyroscopic_ratio, lasting }
}

impl Parameters {
    /// Weight of `w_e` in V: `J` for controller 1, the identity for controller 2.
    pub(super) fn rate_weight(&self) -> DVec3 {
        if self.saturated.is_some() { DVec3::ONE } else { self.inertia }
    }

    /// `J^-1 ((J w) × w)`, weighed as `w_e'` is in V.
    fn gyroscopic(&self, w: DVec3) -> DVec3 {
        (self.inertia * w).cross(w) / self.inertia * self.rate_weight()
    }

    /// The true value of `a_hat` or `theta_hat`.
    fn inertia_parameter(&self) -> DVec3 {
        self.saturated.map_or(self.inertia, |saturated| saturated.inverse_inertia)
    }
}
