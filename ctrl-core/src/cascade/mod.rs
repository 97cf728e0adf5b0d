//! Shared part of both controllers: steps 1 to 3 of the paper, their configuration and their memory.

mod admission;
mod attitude;
mod force;
mod integral;
mod rate;
mod step_rate;
mod validation;

use glam::{Quat, Vec3};

pub(crate) use admission::Admitted;
use attitude::{DesiredAttitude, desired_attitude};
use force::{ForceCommand, force_command};
pub(crate) use integral::{Integral, IntegralLoop, IntegralState, TorqueEstimate};
use rate::{VirtualRate, virtual_rate};
pub(crate) use step_rate::{require_integrable, require_integrable_axes};

use crate::adaptation::Estimate;
use crate::auxiliary::AuxiliaryTerms;
use crate::config::{CascadeGains, Checkpoint};
use crate::controller::{Auxiliary, Intermediates, StepOutput, StepStatus};
use crate::error::{Bound, ConfigError, require};
use crate::rotation::{from_axes, inverse_mul, nearest_sign};
use crate::saturation::clip_between;
use crate::vehicle::{InitialEstimate, Uncertainty, VehicleState, Wrench, WrenchBounds};

/// Below this the decaying part of `delta^2` is negligible and stops, well above subnormals.
const SMOOTHING_FLOOR: f32 = 1e-20;

/// The validated, immutable part of a controller that steps 1 to 3 use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cascade {
    pub step_period: f32,
    pub reference_acceleration_max: f32,
    pub uncertainty: Uncertainty,
    pub gains: CascadeGains,
    pub bounds: WrenchBounds,
    pub integral: Integral,
    initial: InitialEstimate,
    /// `[1/m_hi, 1/m_lo]`, the set of `beta`.
    inverse_mass_min: f32,
    inverse_mass_max: f32,
    /// `1 - exp(-2 delta_1 dt)`: what one step takes off the decaying part of `delta^2`.
    smoothing_decay: f32,
    /// Squares of the floors of `delta`.
    floor_translation: f32,
    floor_rotation: f32,
}

/// The memory of steps 1 to 3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CascadeState {
    /// The latest wrench, held while the input is unusable.
    wrench: Wrench,
    /// `beta`.
    inverse_mass: Estimate<f32>,
    /// `exp(-2 delta_1 t)`, the decaying part of `delta^2`.
    smoothing: f32,
    /// `q_e` of the latest step, whose sign the next one continues.
    pub attitude_error: Quat,
    /// `r2` of the latest step.
    lateral: Vec3,
    /// Estimates of the integral action.
    pub integral: IntegralState,
}

/// One evaluation of steps 1 to 3.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Evaluation {
    pub attitude_error: Quat,
    pub virtual_rate: VirtualRate,
    pub status: StepStatus,
    force: ForceCommand,
    desired: DesiredAttitude,
}

impl Cascade {
    /// The memory before the first step.
    pub fn initial_state(&self) -> CascadeState {
        let bounds = self.bounds;
        let hover = self.initial.mass * crate::vehicle::GRAVITY;
        CascadeState {
            wrench: Wrench {
                thrust: clip_between(hover, bounds.thrust_min, bounds.thrust_max),
                torque_body: Vec3::ZERO,
            },
            inverse_mass: Estimate::new(self.clamped_inverse(self.initial.mass)),
            smoothing: 1.0,
            attitude_error: Quat::IDENTITY,
            lateral: Vec3::Y,
            integral: IntegralState::default(),
        }
    }

    /// The memory that goes on from `checkpoint`, with the torque's estimate and its name there.
    pub fn resume(
        &self,
        checkpoint: &Checkpoint,
        (torque, torque_name): (Vec3, &'static str),
    ) -> Result<CascadeState, ConfigError> {
        let Checkpoint { elapsed, inverse_mass, lasting, .. } = *checkpoint;
        require("checkpoint.elapsed", elapsed, Bound::NotNegative, "time since the first step")?;
        let set = Bound::Inside(self.inverse_mass_min, self.inverse_mass_max);
        require("checkpoint.inverse_mass", inverse_mass, set, "the set of beta, (14)")?;
        let (name, d_hat) = ("checkpoint.lasting.acceleration_world", lasting.acceleration_world);
        let force = IntegralLoop::resume(self.integral.force.as_ref(), name, d_hat)?;
        require(name, d_hat.z, Bound::Inside(0.0, 0.0), "d_hat is horizontal")?;
        let torque = IntegralLoop::resume(self.integral.torque.as_ref(), torque_name, torque)?;
        let smoothing = libm::expf(-2.0 * self.gains.delta_1 * elapsed);
        Ok(CascadeState {
            inverse_mass: Estimate::new(inverse_mass),
            smoothing: if smoothing > SMOOTHING_FLOOR { smoothing } else { SMOOTHING_FLOOR },
            integral: IntegralState { force, torque },
            ..self.initial_state()
        })
    }

    /// `1/mass`, inside the set of `beta` whatever the rounding.
    fn clamped_inverse(&self, mass: f32) -> f32 {
        clip_between(1.0 / mass, self.inverse_mass_min, self.inverse_mass_max)
    }

    /// `rate`, or zero where the projection (14) holds `beta` at the border of its set.
    #[inline(always)]
    fn projected_rate(&self, beta: f32, rate: f32) -> f32 {
        let border = if rate > 0.0 { self.inverse_mass_max } else { self.inverse_mass_min };
        if beta == border { 0.0 } else { rate }
    }

    /// `delta^2` of the rotational smooth sign.
    #[inline(always)]
    pub fn delta_squared_rotation(&self, state: &CascadeState) -> f32 {
        state.smoothing + self.floor_rotation
    }

    /// Steps 1 to 3; with the auxiliary system and its gain `k5` unless that is at rest.
    #[inline(always)]
    pub fn evaluate(
        &self,
        state: &CascadeState,
        input: &Admitted<'_>,
        vehicle: &VehicleState,
        auxiliary: Option<(&Auxiliary, f32)>,
    ) -> Evaluation {
        let reference = input.reference;
        let (beta, w) = (state.inverse_mass.value(), vehicle.rate_body);
        let delta_squared = state.smoothing + self.floor_translation;
        let d_hat = state.integral.force.value();
        let force = force_command(self, beta, delta_squared, d_hat, vehicle, &input.r, reference);
        let terms = auxiliary.map(|(at, k5)| AuxiliaryTerms::new(at, k5, &input.r));
        let q_a = auxiliary.map(|(at, _)| at.attitude);
        let desired = desired_attitude(&force.u, force.n, reference, state.lateral, q_a);
        let q_d = from_axes(&desired.axes_world);
        let (q_e, flipped) = nearest_sign(inverse_mul(q_d, input.attitude), state.attitude_error);
        let virtual_rate = virtual_rate(self, &force, &desired, q_e, w, terms.as_ref());
        let mut status = input.status;
        status.set(StepStatus::HEADING_HELD, desired.held);
        status.set(StepStatus::SIGN_FLIPPED, flipped);
        Evaluation { attitude_error: q_e, virtual_rate, status, force, desired }
    }

    /// Commits one step: what steps 1 to 3 remember, and the wrench with thrust inside its bounds.
    #[inline(always)]
    pub fn commit(
        &self,
        state: &mut CascadeState,
        evaluation: &Evaluation,
        torque_body: Vec3,
        torque_demand_body: Vec3,
        mut status: StepStatus,
    ) -> StepOutput {
        let increment = self.step_period * evaluation.force.inverse_mass_rate;
        let (lower, upper) = (self.inverse_mass_min, self.inverse_mass_max);
        if state.inverse_mass.advance(increment, lower, upper) {
            status |= StepStatus::MASS_PROJECTED;
        }
        if let Some(integral) = &self.integral.force {
            let increment = self.step_period * evaluation.force.lasting_rate;
            if integral.advance(&mut state.integral.force, increment) {
                status |= StepStatus::LASTING_PROJECTED;
            }
        }
        state.wrench = Wrench { thrust: self.thrust(evaluation), torque_body };
        state.attitude_error = evaluation.attitude_error;
        state.lateral = evaluation.desired.lateral;
        self.decay(state);
        StepOutput { wrench: state.wrench, torque_demand_body, status }
    }

    /// Thrust to be commanded (N). Rounding alone can take |alpha| past (19) or (20).
    #[inline(always)]
    pub fn thrust(&self, evaluation: &Evaluation) -> f32 {
        let WrenchBounds { thrust_min, thrust_max, .. } = self.bounds;
        clip_between(evaluation.force.thrust, thrust_min, thrust_max)
    }

    /// Advances the torque's estimate by a step at `rate`.
    #[inline(always)]
    pub fn integrate_torque(&self, state: &mut CascadeState, rate: Vec3) -> StepStatus {
        let mut status = StepStatus::empty();
        if let Some(integral) = &self.integral.torque {
            let increment = self.step_period * rate;
            status.set(
                StepStatus::LASTING_PROJECTED,
                integral.advance(&mut state.integral.torque, increment),
            );
        }
        status
    }

    /// `exp(-2 delta_1 t)` one step on.
    #[inline(always)]
    fn decay(&self, state: &mut CascadeState) {
        let next = state.smoothing - self.smoothing_decay * state.smoothing;
        if next > SMOOTHING_FLOOR {
            state.smoothing = next;
        }
    }
}

impl CascadeState {
    /// `beta` (1/kg).
    #[inline(always)]
    pub fn inverse_mass(&self) -> f32 {
        self.inverse_mass.value()
    }
}

impl Evaluation {
    /// Intermediate quantities of steps 1 to 3, for an observer; the controller adds its own.
    pub fn intermediates(&self, law: &Cascade, state: &CascadeState) -> Intermediates {
        let Self { force, desired, virtual_rate, .. } = self;
        let alpha = force.alpha(law, state.inverse_mass());
        Intermediates {
            position_error_world: force.position_error,
            velocity_error_world: force.velocity_error,
            g: force.g,
            alpha: alpha.value,
            alpha_dot: alpha.first,
            alpha_ddot: alpha.second,
            thrust: force.thrust,
            desired_rate: desired.rate,
            desired_rate_dot: desired.rate_dot,
            attitude_error: self.attitude_error,
            mu: virtual_rate.mu,
            mu_dot: virtual_rate.mu_dot,
            inverse_mass_rate: force.inverse_mass_rate,
            lasting_acceleration_rate: force.lasting_rate,
            ..Intermediates::default()
        }
    }
}
