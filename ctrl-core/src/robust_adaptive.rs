//! Controller 1: robust adaptive tracking with unknown mass, inertia and bounded disturbances
//! (Theorem 1). Step 4 of the paper, on top of the shared [cascade](crate::config::CascadeGains).
//!
//! ```text
//! w_e = w - mu
//! Y   = S(w) diag(w) + diag(mu')
//! tau = -k4 w_e - eps_e + Y a_hat - D2 h(w_e, delta_r)                       (34)
//! a_hat' = Proj[J_lo, J_hi]( -gamma2 Y^T w_e )                               (35)
//! ```
//! With a model of the rotors ([`crate::rotors`]) and the torque `tau_m` that it says acts,
//!
//! ```text
//! w_e = w - mu - w_a
//! tau = -k4 (w - mu) - eps_e + Y a_hat - D2 h(w_e, delta_r)
//! w_a' = diag(a_hat)^-1 ( tau_m - tau - k4 w_a )
//! a_hat' = Proj[J_lo, J_hi]( -gamma2 (Y + diag(w_a'))^T w_e )
//! ```
//! With integral action, `tau` less `t_hat`, `t_hat' = Proj[-D_t, D_t]( gamma_t w_e )`.

use glam::{Quat, Vec3};

use crate::adaptation::Estimate;
use crate::cascade::{Cascade, CascadeState, Evaluation, TorqueEstimate, require_integrable_axes};
use crate::config::{Checkpoint, RobustAdaptiveConfig};
use crate::controller::{
    AdaptiveController, Auxiliary, Estimates, Intermediates, LastingEstimates, StepOutput,
    StepStatus, TrackingController,
};
use crate::error::{Audit, Bound, Condition, ConfigError, Judge, Strict, axis_names, require};
use crate::reference::Reference;
use crate::rotation::vector_part;
use crate::rotors::{Commanded, RotorLag};
use crate::saturation::smooth_sign_value;
use crate::vehicle::{VectorInterval, VehicleState, WrenchBounds};

/// Controller 1, validated. Thrust is bounded by (19) and (20); torque is not bounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobustAdaptive {
    cascade: Cascade,
    config: RobustAdaptiveConfig,
    rotors: Option<RotorLag>,
}

/// Memory of controller 1 between two steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobustAdaptiveState {
    cascade: CascadeState,
    /// `a_hat`.
    inertia: Estimate<Vec3>,
    /// `w_a` and the torque that acts (N m); at rest without a model of the rotors.
    behind_rotors: BehindRotors,
}

/// What a model of the rotors adds to the memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct BehindRotors {
    /// `w_a` (rad/s).
    rate: Vec3,
    /// Torque that acts by the model (N m).
    acting_torque: Vec3,
}

/// Step 4: torque and adaptation.
struct Law {
    rate_error: Vec3,
    torque_demand: Vec3,
    torque: Vec3,
    /// Mean of the torque that acts over the step: `torque` without a model of the rotors.
    acting: Vec3,
    /// `w_a'`.
    auxiliary_rate_dot: Vec3,
    inertia_rate: Vec3,
    /// `t_hat'`.
    lasting_rate: Vec3,
}

impl RobustAdaptive {
    /// Validates `config`.
    ///
    /// # Errors
    /// The first parameter that is not finite, of the wrong sign or order, violates (19), or asks
    /// for a loop that the fixed step cannot integrate, with its value and the bound.
    pub fn new(config: &RobustAdaptiveConfig) -> Result<Self, ConfigError> {
        Self::judged(config, &mut Strict)
    }

    /// Shows `see` every condition that [`new`](Self::new) asks of `config`, in order, whether it
    /// holds or not.
    pub fn audit(config: &RobustAdaptiveConfig, see: impl FnMut(&Condition)) {
        let _ = Self::judged(config, &mut Audit(see));
    }

    /// The controller, if `judge` lets every condition pass.
    fn judged(config: &RobustAdaptiveConfig, judge: &mut impl Judge) -> Result<Self, ConfigError> {
        let cascade = Cascade::new(
            config.step_period,
            config.reference_acceleration_max,
            config.uncertainty,
            config.initial,
            config.cascade,
            (
                &config.integral,
                TorqueEstimate {
                    divisor: Vec3::ONE,
                    gain_max: 1.0 / config.uncertainty.inertia.lower,
                },
            ),
            judge,
        )?;
        judge.require_axes(axis_names!("k4"), config.k4, [Bound::Positive; 3], "(34)")?;
        judge.require_axes(
            axis_names!("gamma2"),
            config.gamma2,
            [Bound::NotNegative; 3],
            "(35)",
        )?;
        let VectorInterval { lower, upper } = config.uncertainty.inertia;
        let sign_slope = config.uncertainty.disturbance_torque / config.cascade.delta_min_rotation;
        // d(tau)/dw / J_lo: rate gain and smooth sign directly, attitude gain through mu'.
        let rate = (config.k4 + sign_slope + upper * 0.5 * config.cascade.k3) / lower;
        let names = axis_names!(
            expression "step_period * (k4 + D2/delta_min_rotation + J_hi k3/2)/J_lo"
        );
        require_integrable_axes(judge, names, config.step_period, rate)?;
        let rotors = RotorLag::new(&config.rotors, config.step_period, judge)?;
        Ok(Self { cascade, config: *config, rotors })
    }

    /// The configuration that was validated.
    #[must_use]
    pub fn config(&self) -> &RobustAdaptiveConfig {
        &self.config
    }

    /// A state that goes on from `checkpoint`.
    ///
    /// # Errors
    /// Names the field of `checkpoint` that is outside its set.
    pub fn resume(&self, checkpoint: &Checkpoint) -> Result<RobustAdaptiveState, ConfigError> {
        let sets = self.config.uncertainty.inertia.axes().map(Bound::from);
        for (component, set) in checkpoint.inertia.to_array().into_iter().zip(sets) {
            require("checkpoint.inertia", component, set, "the set of a_hat, (35)")?;
        }
        let torque = (checkpoint.lasting.torque_body, "checkpoint.lasting.torque_body");
        Ok(RobustAdaptiveState {
            cascade: self.cascade.resume(checkpoint, torque)?,
            inertia: Estimate::new(checkpoint.inertia),
            behind_rotors: BehindRotors::default(),
        })
    }

    /// Step 4 at body rate `w`.
    #[inline(always)]
    fn law(&self, state: &RobustAdaptiveState, evaluation: &Evaluation, w: Vec3) -> Law {
        let Self { cascade, config, rotors } = self;
        let mu_dot = evaluation.virtual_rate.mu_dot;
        let without_auxiliary = w - evaluation.virtual_rate.mu;
        let rate_error = match rotors {
            Some(_) => without_auxiliary - state.behind_rotors.rate,
            None => without_auxiliary,
        };
        let inertia = state.inertia.value();
        let regressor_inertia = w.cross(w * inertia) + mu_dot * inertia; // Y a_hat
        let sign = smooth_sign_value(rate_error, cascade.delta_squared_rotation(&state.cascade));
        let mut torque_demand = regressor_inertia
            - config.k4 * without_auxiliary
            - vector_part(evaluation.attitude_error)
            - config.uncertainty.disturbance_torque * sign; // (34)
        let mut lasting_rate = Vec3::ZERO;
        if let Some(integral) = &cascade.integral.torque {
            let t_hat = state.cascade.integral.torque.value();
            torque_demand -= t_hat;
            lasting_rate = integral.rate(t_hat, rate_error);
        }
        let mut law = Law {
            rate_error,
            torque_demand,
            torque: torque_demand,
            acting: torque_demand,
            auxiliary_rate_dot: Vec3::ZERO,
            inertia_rate: Vec3::ZERO,
            lasting_rate,
        };
        let mut transposed = w * rate_error.cross(w) + mu_dot * rate_error; // Y^T w_e
        if let Some(rotors) = rotors {
            let (commanded, auxiliary_rate_dot) = self.behind(rotors, state, torque_demand);
            (law.torque, law.acting) = (commanded.torque, commanded.acting);
            law.auxiliary_rate_dot = auxiliary_rate_dot;
            transposed += auxiliary_rate_dot * rate_error;
        }
        law.inertia_rate = -config.gamma2 * transposed; // (35)
        law
    }

    /// Command behind `rotors`, and `w_a'`.
    #[inline(always)]
    fn behind(
        &self,
        rotors: &RotorLag,
        state: &RobustAdaptiveState,
        torque_demand: Vec3,
    ) -> (Commanded, Vec3) {
        let BehindRotors { rate, acting_torque } = state.behind_rotors;
        let commanded = rotors.command(torque_demand, Vec3::MAX, acting_torque);
        let RobustAdaptiveConfig { k4, step_period, .. } = self.config;
        // Implicit in the decay, as (39) is.
        let rate_dot = (commanded.acting - torque_demand - k4 * rate)
            / (state.inertia.value() + step_period * k4);
        (commanded, rate_dot)
    }

    /// Advances the memory; called only when every number is finite.
    #[inline(always)]
    fn commit(
        &self,
        state: &mut RobustAdaptiveState,
        evaluation: &Evaluation,
        law: &Law,
    ) -> StepOutput {
        let mut status = evaluation.status;
        let VectorInterval { lower, upper } = self.config.uncertainty.inertia;
        let increment = self.config.step_period * law.inertia_rate;
        if state.inertia.advance(increment, lower, upper) {
            status |= StepStatus::INERTIA_PROJECTED;
        }
        status |= self.cascade.integrate_torque(&mut state.cascade, law.lasting_rate);
        if let Some(rotors) = &self.rotors {
            let memory = &mut state.behind_rotors;
            memory.rate += self.config.step_period * law.auxiliary_rate_dot;
            memory.acting_torque = rotors.after(memory.acting_torque, law.torque);
        }
        let (torque, demand) = (law.torque, law.torque_demand);
        self.cascade.commit(&mut state.cascade, evaluation, torque, demand, status)
    }
}

impl TrackingController for RobustAdaptive {
    type State = RobustAdaptiveState;

    fn initial_state(&self) -> RobustAdaptiveState {
        RobustAdaptiveState {
            cascade: self.cascade.initial_state(),
            inertia: Estimate::new(self.config.initial.inertia),
            behind_rotors: BehindRotors::default(),
        }
    }

    #[inline]
    fn step(
        &self,
        state: &mut RobustAdaptiveState,
        vehicle: &VehicleState,
        reference: &Reference,
    ) -> StepOutput {
        self.step_observed(state, vehicle, reference, |_| {})
    }

    fn step_period(&self) -> f32 {
        self.config.step_period
    }
}

impl AdaptiveController for RobustAdaptive {
    #[inline]
    fn step_observed(
        &self,
        state: &mut RobustAdaptiveState,
        vehicle: &VehicleState,
        reference: &Reference,
        observe: impl FnOnce(&Intermediates),
    ) -> StepOutput {
        let mut clipped = None;
        let Some(input) = self.cascade.admit(vehicle, reference, &mut clipped) else {
            return self.cascade.hold(&mut state.cascade, vehicle, reference);
        };
        let evaluation = self.cascade.evaluate(&state.cascade, &input, vehicle, None);
        let law = self.law(state, &evaluation, vehicle.rate_body);
        let sum = (law.torque + law.inertia_rate).element_sum();
        if !evaluation.is_usable(law.rate_error, sum) {
            return self.cascade.hold(&mut state.cascade, vehicle, reference);
        }
        observe(&Intermediates {
            rate_error: law.rate_error,
            torque_demand_body: law.torque_demand,
            torque_body: law.torque,
            acting_torque_body: law.acting,
            auxiliary_rate_dot: law.auxiliary_rate_dot,
            inertia_rate: law.inertia_rate,
            lasting_torque_rate: law.lasting_rate,
            ..evaluation.intermediates(&self.cascade, &state.cascade)
        });
        self.commit(state, &evaluation, &law)
    }

    fn has_integral_action(&self) -> bool {
        self.cascade.integral.is_on()
    }

    fn reference_acceleration_max(&self) -> f32 {
        self.config.reference_acceleration_max
    }

    fn bounds(&self) -> WrenchBounds {
        self.cascade.bounds
    }

    fn estimates(&self, state: &RobustAdaptiveState) -> Estimates {
        Estimates {
            inverse_mass: state.cascade.inverse_mass(),
            inertia: state.inertia.value(),
            inverse_inertia: Vec3::ZERO,
            gyroscopic_ratio: Vec3::ZERO,
        }
    }

    fn attitude_error(&self, state: &RobustAdaptiveState) -> Quat {
        state.cascade.attitude_error
    }

    fn auxiliary(&self, state: &RobustAdaptiveState) -> Auxiliary {
        Auxiliary { rate: state.behind_rotors.rate, ..Auxiliary::REST }
    }

    fn lasting(&self, state: &RobustAdaptiveState) -> LastingEstimates {
        let integral = &state.cascade.integral;
        LastingEstimates {
            acceleration_world: integral.force.value(),
            torque_body: integral.torque.value(),
            angular_acceleration_body: Vec3::ZERO,
        }
    }
}
