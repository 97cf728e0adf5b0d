//! V and its ingredients at each tick of a block.

use core::array::from_fn;

use ctrl_core::controller::StepStatus;
use glam::{DVec3, Vec3};

use super::adaptation::resolved;
use super::attitude::Attitude;
use super::lengths::Lengths;
use super::parameters::{Parameters, Widths};
use super::translation::Translation;
use crate::evaluation::Evaluation;
use crate::guarantee::block::Block;
use crate::lanes::{LANES, Quaternions, Scalars, Vectors, all, four, with_last};
use crate::norm::Norm;
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
    /// Of the latest tick; none before the first.
    latest: Option<ResolvedTick>,
    /// Room for a block of one tick.
    single: Option<Box<EvaluatedBlock>>,
}

/// A block of ticks with V at each of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct EvaluatedBlock {
    pub ticks: Block,
    pub v: Evaluated,
}

/// V and its ingredients at each tick of a block.
#[derive(Clone, Debug, Default)]
pub(crate) struct Evaluated {
    /// `w_e` (rad/s).
    pub rate_error: Vectors,
    /// `V3` (controller 1) or `V5` (controller 2).
    pub value: Scalars,
    /// The part of V due to the estimates; it need not decay.
    pub parameter_part: Scalars,
    /// `W`: the guaranteed decrease of V, (36) or (53) (1/s).
    pub decrease: Scalars,
    pub translation: Translation,
    pub attitude: Attitude,
    pub lengths: Lengths,
    /// Body z in the world frame.
    pub body_z: Vectors,
    /// `J^-1 ((J w) × w)`, weighed as `w_e'` is in V.
    pub gyroscopic: Vectors,
    /// `a`, `theta`: true less estimated parameters, zero where adaptation is off.
    pub inverse_mass_error: Scalars,
    pub inertia_error: Vectors,
    /// `d_c - d_hat`, and `t_c - t_hat` or `s_c - s_hat`; zero without integral action.
    pub lasting_error: [Vectors; 2],
    /// Widths of the translational and the rotational smooth sign.
    pub delta: (Widths, Widths),
    /// Increments of the estimates until the next tick, before projection.
    pub increments: Increments,
    /// `beta`.
    pub inverse_mass: Scalars,
}

/// Unprojected increments of the estimates over one tick: (14), (35) or (51), (52), integral action.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Increments {
    pub inverse_mass: Scalars,
    pub inertia: Vectors,
    pub gyroscopic_ratio: Vectors,
    /// Of `d_hat`, and of `t_hat` or `s_hat`.
    pub lasting: [Vectors; 2],
}

/// The estimates of one tick with all their digits, side by side.
#[derive(Clone, Copy, Debug, Default)]
struct EstimatesOfTick {
    /// `a_hat` or `theta_hat`, and `beta`.
    inertia_and_mass: Scalars,
    gyroscopic_ratio: Scalars,
    /// `d_hat`, and `t_hat` or `s_hat`.
    lasting: [Scalars; 2],
}

/// The estimates of a tick, and their [`Increments`] until the next.
#[derive(Clone, Copy, Debug, Default)]
struct ResolvedTick {
    value: EstimatesOfTick,
    increment: EstimatesOfTick,
}

/// Estimates with all their digits, and the thrust that follows from them.
#[derive(Default)]
struct Estimated {
    inverse_mass: Scalars,
    /// `a_hat` or `theta_hat`.
    inertia: Vectors,
    gyroscopic_ratio: Vectors,
    /// `d_hat`, and `t_hat` or `s_hat`.
    lasting: [Vectors; 2],
    /// `alpha` (13) (N), and its length.
    alpha: Vectors,
    thrust: Scalars,
}

impl Evaluator {
    /// For `law` on the vehicle with the true `parameters`.
    #[must_use]
    pub fn new(law: &ControllerConfig, parameters: &PlantParameters) -> Self {
        Self { parameters: Parameters::new(law, parameters), latest: None, single: None }
    }

    /// The same behind rotors with the time constant `lag` (s).
    #[must_use]
    pub(crate) fn behind_rotors(mut self, lag: f64) -> Self {
        self.parameters.set_rotor_lag(lag);
        self
    }

    /// V at this tick; call once per tick, in order.
    #[must_use]
    pub fn evaluate(&mut self, tick: &Tick) -> Evaluation {
        let mut single = self.single.take().unwrap_or_default();
        single.ticks.gather(std::slice::from_ref(tick), Vec3::ZERO);
        self.evaluate_block(&single.ticks, &mut single.v);
        let evaluation = single.v.first();
        self.single = Some(single);
        evaluation
    }

    /// `tick` with its evaluation; call once per tick, in order.
    #[must_use]
    pub fn evaluated(&mut self, tick: &Tick) -> Tick {
        Tick { evaluation: self.evaluate(tick), ..*tick }
    }

    /// Puts V at each tick of the block that follows the latest into `v`.
    pub(crate) fn evaluate_block(&mut self, block: &Block, v: &mut Evaluated) {
        let (p, law) = (self.parameters, &block.law);
        v.delta = p.widths(&block.ticks);
        v.translation = Translation::new(&p, block, v.delta.0.value);
        v.rate_error = block.rate - law.mu - law.auxiliary_rate;
        v.body_z = block.attitude * Vectors::all(DVec3::Z);
        v.increments = increments(&p, block, v.translation.g, v.rate_error);
        let estimated = match block.count() {
            1 => self.estimates::<1>(block, v),
            _ => self.estimates::<LANES>(block, v),
        };
        v.attitude = Attitude::new(
            estimated.alpha,
            (block.reference.specific_force, block.reference.left),
            law.auxiliary_attitude,
            block.attitude,
            law.attitude_error,
        );
        let error = v.attitude.error;
        v.lengths = Lengths::new(block, &v.translation, estimated.thrust, error, v.rate_error);
        v.decrease = all(p.c) * v.translation.decrease
            + weighed(p.k3, error.xyz())
            + weighed(p.k4, v.rate_error);
        v.gyroscopic = p.gyroscopic(block.rate);
        v.inverse_mass = estimated.inverse_mass;
        v.inverse_mass_error = all(p.inverse_mass) - estimated.inverse_mass;
        v.inertia_error = Vectors::all(p.inertia_parameter()) - estimated.inertia;
        if let Some(integral) = &p.integral {
            let [d_hat, torque_hat] = estimated.lasting;
            let (d_c, t_c) = (Vectors::all(integral.acceleration), Vectors::all(integral.torque));
            v.lasting_error = [d_c - d_hat, t_c - torque_hat];
        }
        v.parameter_part = parameter_part(&p, v, estimated.gyroscopic_ratio);
        v.value = state_part(&p, v) + v.parameter_part;
    }

    /// The estimates, one tick after the other in the first `N` lanes: each moves by the increment of the tick before,
    /// and the increment of `beta` follows from the thrust.
    fn estimates<const N: usize>(&mut self, block: &Block, v: &mut Evaluated) -> Estimated {
        let (p, zero) = (self.parameters, all(0.0));
        let (reported, sets) = (reported(&p, block), Sets::new(&p));
        let along = v.translation.g.dot(v.body_z).to_array();
        let moved = v.increments.inertia.padded();
        let moved_ratio = v.increments.gyroscopic_ratio.padded();
        let moved_lasting = v.increments.lasting.map(|moved| moved.padded());
        let accelerations = v.translation.acceleration.padded();
        let first = ResolvedTick { value: reported[0], increment: EstimatesOfTick::default() };
        let mut latest = (self.latest.unwrap_or(first), zero, 0.0, 0.0);
        let ticks: [_; LANES] = from_fn(|lane| {
            if lane < N {
                let value = sets.resolved(&latest.0, &reported[lane]);
                let [_, _, _, inverse_mass] = value.inertia_and_mass.to_array();
                let alpha = (accelerations[lane] - value.lasting[0]) / all(inverse_mass); // (13)
                let [x, y, z, _] = alpha.to_array();
                let thrust = DVec3::new(x, y, z).norm();
                let moved_mass = p.dt * p.gamma1 * thrust * along[lane]; // (14)
                let increment = EstimatesOfTick {
                    inertia_and_mass: with_last(moved[lane], moved_mass),
                    gyroscopic_ratio: moved_ratio[lane],
                    lasting: moved_lasting.map(|moved| moved[lane]),
                };
                latest = (ResolvedTick { value, increment }, alpha, thrust, moved_mass);
            }
            latest
        });
        self.latest = Some(ticks[block.count() - 1].0);
        v.increments.inverse_mass = Scalars::new(ticks.map(|it| it.3));
        let values = ticks.map(|it| it.0.value);
        let (inertia, inverse_mass) = Vectors::of_fours(values.map(|it| it.inertia_and_mass));
        let vectors =
            |of: fn(&EstimatesOfTick) -> Scalars| Vectors::of_fours(values.map(|it| of(&it))).0;
        Estimated {
            inverse_mass,
            inertia,
            gyroscopic_ratio: vectors(|it| it.gyroscopic_ratio),
            lasting: [vectors(|it| it.lasting[0]), vectors(|it| it.lasting[1])],
            alpha: Vectors::of_fours(ticks.map(|it| it.1)).0,
            thrust: Scalars::new(ticks.map(|it| it.2)),
        }
    }
}

/// The estimates as the law reports them, tick by tick.
#[inline(always)]
fn reported(p: &Parameters, block: &Block) -> [EstimatesOfTick; LANES] {
    let (law, zero) = (&block.law, all(0.0));
    let (inertia, torque) = match p.saturated {
        Some(_) => (law.inverse_inertia, law.lasting_angular_acceleration),
        None => (law.inertia, law.lasting_torque),
    };
    let inertia_and_mass = inertia.fours(law.inverse_mass);
    let ratio = p.saturated.map_or([zero; LANES], |_| law.gyroscopic_ratio.padded());
    let lasting = match p.integral {
        Some(_) => [law.lasting_acceleration.padded(), torque.padded()],
        None => [[zero; LANES]; 2],
    };
    from_fn(|lane| EstimatesOfTick {
        inertia_and_mass: inertia_and_mass[lane],
        gyroscopic_ratio: ratio[lane],
        lasting: lasting.map(|it| it[lane]),
    })
}

/// The sets on which the estimates are projected: lower and upper ends.
struct Sets {
    inertia_and_mass: (Scalars, Scalars),
    gyroscopic_ratio: Option<(Scalars, Scalars)>,
    lasting: Option<[(Scalars, Scalars); 2]>,
}

impl Sets {
    #[inline(always)]
    fn new(p: &Parameters) -> Self {
        let inertia = match p.saturated {
            Some(_) => (p.inertia_set.1.recip(), p.inertia_set.0.recip()),
            None => p.inertia_set,
        };
        let (lightest, heaviest) = p.inverse_mass_set;
        let set = |bound: DVec3| (four(-bound, 0.0), four(bound, 0.0));
        Self {
            inertia_and_mass: (four(inertia.0, lightest), four(inertia.1, heaviest)),
            gyroscopic_ratio: p.saturated.map(|_| (all(-1.0), all(1.0))),
            lasting: p.integral.map(|it| [set(it.bounds.0), set(it.bounds.1)]),
        }
    }

    /// The estimates of the tick after `before` that are `reported`.
    #[inline(always)]
    fn resolved(&self, before: &ResolvedTick, reported: &EstimatesOfTick) -> EstimatesOfTick {
        let (value, increment) = (&before.value, &before.increment);
        let mut found = EstimatesOfTick {
            inertia_and_mass: resolved(
                value.inertia_and_mass,
                increment.inertia_and_mass,
                self.inertia_and_mass,
                reported.inertia_and_mass,
            ),
            ..EstimatesOfTick::default()
        };
        if let Some(set) = self.gyroscopic_ratio {
            let (value, increment) = (value.gyroscopic_ratio, increment.gyroscopic_ratio);
            found.gyroscopic_ratio = resolved(value, increment, set, reported.gyroscopic_ratio);
        }
        if let Some(sets) = self.lasting {
            found.lasting = from_fn(|i| {
                resolved(value.lasting[i], increment.lasting[i], sets[i], reported.lasting[i])
            });
        }
        found
    }
}

impl Evaluated {
    /// The first tick's, as data.
    fn first(&self) -> Evaluation {
        let first = |x: Scalars| x.to_array()[0];
        Evaluation {
            position_error: self.translation.position_error.lane(0),
            attitude_error: self.attitude.error.lane(0),
            rate_error: self.rate_error.lane(0),
            value: first(self.value),
            parameter_part: first(self.parameter_part),
            decrease: first(self.decrease),
        }
    }
}

/// The part of V due to position, velocity, attitude and rate.
fn state_part(p: &Parameters, evaluated: &Evaluated) -> Scalars {
    let Quaternions { w, .. } = evaluated.attitude.error;
    // 1 - eta = |eps|^2/(1 + eta) keeps its digits near the identity.
    let near = evaluated.attitude.error.xyz().length_squared() / (all(1.0) + w);
    let attitude = w.simd_gt(all(0.0)).select(near, all(1.0) - w);
    let rate = evaluated.rate_error;
    all(p.c) * evaluated.translation.potential
        + all(2.0) * attitude
        + all(0.5) * rate.dot(Vectors::all(p.rate_weight()) * rate)
}

/// `square/(2 gamma)`; zero where `gamma` is.
pub(super) fn over(square: Scalars, gamma: f64) -> Scalars {
    if gamma > 0.0 { all(0.5) * square / all(gamma) } else { all(0.0) }
}

/// `1/2 x^T diag(gamma)^-1 x`, without the axes where `gamma` is zero.
pub(super) fn over_each(x: Vectors, gamma: DVec3) -> Scalars {
    over(x.x * x.x, gamma.x) + over(x.y * x.y, gamma.y) + over(x.z * x.z, gamma.z)
}

/// `x^T diag(weight) x`.
fn weighed(weight: DVec3, x: Vectors) -> Scalars {
    x.dot(Vectors::all(weight) * x)
}

/// The part of V due to the estimates.
fn parameter_part(p: &Parameters, evaluated: &Evaluated, ratio: Vectors) -> Scalars {
    let mass = over(evaluated.inverse_mass_error * evaluated.inverse_mass_error, p.gamma1);
    let inertia = over_each(evaluated.inertia_error, p.gamma2);
    let ratio = p.saturated.map_or(all(0.0), |saturated| {
        let error = Vectors::all(saturated.gyroscopic_ratio) - ratio;
        over(error.length_squared(), saturated.gamma3)
    });
    let lasting = p.integral.map_or(all(0.0), |integral| {
        let [acceleration, torque] = evaluated.lasting_error;
        all(p.c) * over(acceleration.length_squared(), integral.gamma_d)
            + over(torque.length_squared(), integral.gamma_t)
    });
    all(p.c) * mass + inertia + ratio + lasting
}

/// The update laws (35), (51), (52) and those of the integral action over one tick, before projection;
/// that of `beta` (14) needs the thrust.
fn increments(p: &Parameters, block: &Block, g: Vectors, w_e: Vectors) -> Increments {
    let w = block.rate;
    let gamma2 = Vectors::all(p.dt * p.gamma2);
    let (inertia, gyroscopic_ratio) = match p.saturated {
        None => {
            // Y^T w_e = -w * (w x w_e) + mu' * w_e, element-wise.
            (-((block.law.regressor_rate * w_e - w * w.cross(w_e)) * gamma2), Vectors::default())
        }
        Some(saturated) => {
            (block.law.torque * gamma2 * w_e, products(w) * (p.dt * saturated.gamma3) * w_e)
        }
    };
    let lasting = p.integral.map_or(Default::default(), |integral| {
        let horizontal = Vectors { z: all(0.0), ..g };
        [horizontal * (p.dt * integral.gamma_d), w_e * (p.dt * integral.gamma_t)]
    });
    Increments { inverse_mass: all(0.0), inertia, gyroscopic_ratio, lasting }
}

/// `[w2 w3, w1 w3, w1 w2]`.
pub(super) fn products(w: Vectors) -> Vectors {
    Vectors { x: w.y * w.z, y: w.x * w.z, z: w.x * w.y }
}

impl Parameters {
    /// Weight of `w_e` in V: `J` for controller 1, the identity for controller 2.
    pub(super) fn rate_weight(&self) -> DVec3 {
        if self.saturated.is_some() { DVec3::ONE } else { self.inertia }
    }

    /// `J^-1 ((J w) × w)`, weighed as `w_e'` is in V.
    fn gyroscopic(&self, w: Vectors) -> Vectors {
        let inertia = Vectors::all(self.inertia);
        (inertia * w).cross(w) / inertia * Vectors::all(self.rate_weight())
    }

    /// The true value of `a_hat` or `theta_hat`.
    fn inertia_parameter(&self) -> DVec3 {
        self.saturated.map_or(self.inertia, |saturated| saturated.inverse_inertia)
    }
}
