//! Controller 2: robust adaptive tracking whose thrust and torque never exceed their limits
//! (Theorem 2). Step 4 of the paper with its auxiliary system, on top of the shared
//! [cascade](crate::config::CascadeGains).
//!
//! ```text
//! tau   = clip(tau_d, -M_tau, M_tau)                                         (37)
//! w_e   = w - mu - w_a
//! B     = [w2 w3, w1 w3, w1 w2]
//! tau_d = diag(theta_hat)^-1 ( -k4 (w - mu) - eps_e - Pi_hat B + mu' - (D2/J_lo) h(w_e, delta_r) )
//!                                                                            (50)
//! theta_hat' = Proj[1/J_hi, 1/J_lo]( gamma2 tau w_e )                         (51)
//! Pi_hat'    = Proj[-1, 1]( gamma3 B w_e )                                    (52)
//! ```
//! With integral action, the bracket of (50) less `s_hat`, `s_hat' = Proj[-D_t/J_lo, D_t/J_lo]( gamma_t w_e )`.
//! With a model of the rotors ([`crate::rotors`]) (38), (39) and (51) take the torque that it says acts, and in
//! [`step_limited`](AdaptiveController::step_limited) what an allocation makes of the command.
//! The auxiliary system with `q_a` and `w_a`, (38) to (41), is in `auxiliary.rs`.

use core::hint::cold_path;

use glam::{Quat, Vec3};

use crate::adaptation::Estimate;
use crate::auxiliary::{AuxiliaryIntegrator, attitude_rate, rate_dot};
use crate::cascade::{
    Cascade, CascadeState, Evaluation, TorqueEstimate, require_integrable, require_integrable_axes,
};
use crate::config::{Checkpoint, SaturatedConfig};
use crate::controller::{
    AdaptiveController, Auxiliary, Estimates, Intermediates, LastingEstimates, StepOutput,
    StepStatus, TrackingController,
};
use crate::error::{Audit, Bound, Condition, ConfigError, Judge, Strict, axis_names, require};
use crate::reference::Reference;
use crate::rotation::vector_part;
use crate::rotors::{Commanded, RotorLag};
use crate::saturation::{clip_seen, smooth_sign_value};
use crate::sqrt::sqrt;
use crate::vehicle::{VectorInterval, VehicleState, Wrench, WrenchBounds};

/// Controller 2, validated. Every wrench keeps (7) and (8).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Saturated {
    cascade: Cascade,
    config: SaturatedConfig,
    /// `[1/J_hi, 1/J_lo]`, the set of `theta_hat`.
    inverse_inertia_min: Vec3,
    inverse_inertia_max: Vec3,
    auxiliary: AuxiliaryIntegrator,
    rotors: Option<RotorLag>,
    /// `D2/J_lo`.
    disturbance_rate: Vec3,
    /// `gamma2` and `gamma3` times the step period.
    gamma2_step: Vec3,
    gamma3_step: f32,
}

/// What the rotors make of a command: a type of its own for the plain step, which has none of the code.
trait Made {
    fn is_the_command(&self) -> bool;
    fn of(self, command: &Wrench) -> Vec3;
}

/// Every command is made.
struct TheCommand;

impl Made for TheCommand {
    #[inline(always)]
    fn is_the_command(&self) -> bool {
        true
    }

    #[inline(always)]
    fn of(self, command: &Wrench) -> Vec3 {
        command.torque_body
    }
}

impl<F: FnOnce(&Wrench) -> Vec3> Made for F {
    #[inline(always)]
    fn is_the_command(&self) -> bool {
        false
    }

    #[inline(always)]
    fn of(self, command: &Wrench) -> Vec3 {
        self(command)
    }
}

/// Memory of controller 2 between two steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SaturatedState {
    cascade: CascadeState,
    /// `theta_hat`.
    inverse_inertia: Estimate<Vec3>,
    /// `Pi_hat`.
    gyroscopic_ratio: Estimate<Vec3>,
    /// `q_a` and `w_a`; `None` at rest, where they stay until a torque saturates.
    auxiliary: Option<Auxiliary>,
    /// Torque that acts by the model of the rotors (N m).
    acting_torque: Vec3,
}

/// Step 4: torque before and after saturation, and the rates of the memory.
struct Law {
    rate_error: Vec3,
    torque_demand: Vec3,
    torque: Vec3,
    /// Torque that the rotors settle to under it.
    made: Vec3,
    /// Mean of the torque that acts over the step: `torque` without a model of the rotors.
    acting: Vec3,
    saturated: bool,
    /// `B`.
    products: Vec3,
    /// `theta_hat`.
    theta: Vec3,
    /// What the step adds to `theta_hat` and `Pi_hat`.
    inverse_inertia_increment: Vec3,
    gyroscopic_ratio_increment: Vec3,
    /// `s_hat'`.
    lasting_rate: Vec3,
}

impl Law {
    /// `diag(theta_hat)(tau - tau_d)`, the drive of (39).
    #[inline(always)]
    fn auxiliary_drive(&self) -> Vec3 {
        self.theta * (self.acting - self.torque_demand)
    }
}

impl Saturated {
    /// Validates `config`.
    ///
    /// # Errors
    /// The first parameter that is not finite, of the wrong sign or order, violates (19) or (54),
    /// or asks for a loop that the fixed step cannot integrate, with its value and the bound.
    pub fn new(config: &SaturatedConfig) -> Result<Self, ConfigError> {
        Self::judged(config, &mut Strict)
    }

    /// Shows `see` every condition that [`new`](Self::new) asks of `config`, in order, whether it
    /// holds or not.
    pub fn audit(config: &SaturatedConfig, see: impl FnMut(&Condition)) {
        let _ = Self::judged(config, &mut Audit(see));
    }

    /// The controller, if `judge` lets every condition pass.
    fn judged(config: &SaturatedConfig, judge: &mut impl Judge) -> Result<Self, ConfigError> {
        let mut cascade = Cascade::new(
            config.step_period,
            config.reference_acceleration_max,
            config.uncertainty,
            config.initial,
            config.cascade,
            (
                &config.integral,
                TorqueEstimate {
                    divisor: config.uncertainty.inertia.lower,
                    gain_max: config.uncertainty.inertia.upper / config.uncertainty.inertia.lower,
                },
            ),
            judge,
        )?;
        judge.require("thrust_max", config.thrust_max, Bound::Positive, "M_f, (7)")?;
        let limit = Bound::AtMost(config.thrust_max);
        let name = "m_hi (sqrt(3) (M1 + M2 + D1 + D_c + M_p) + g)";
        judge.require(name, cascade.bounds.thrust_max, limit, "thrust_max M_f, (54)")?;
        let names = axis_names!("torque_max");
        judge.require_axes(names, config.torque_max, [Bound::Positive; 3], "M_tau, (8)")?;
        judge.require_axes(axis_names!("k4"), config.k4, [Bound::Positive; 3], "(50)")?;
        judge.require("k5", config.k5, Bound::Positive, "(38)")?;
        judge.require_axes(
            axis_names!("gamma2"),
            config.gamma2,
            [Bound::NotNegative; 3],
            "(51)",
        )?;
        judge.require("gamma3", config.gamma3, Bound::NotNegative, "(52)")?;
        require_law_integrable(judge, config)?;
        let rotors = RotorLag::new(&config.rotors, config.step_period, judge)?;
        cascade.bounds.torque_max = config.torque_max;
        let VectorInterval { lower, upper } = config.uncertainty.inertia;
        Ok(Self {
            cascade,
            config: *config,
            inverse_inertia_min: 1.0 / upper,
            inverse_inertia_max: 1.0 / lower,
            auxiliary: AuxiliaryIntegrator::new(config.k4, config.step_period),
            rotors,
            disturbance_rate: config.uncertainty.disturbance_torque / lower,
            gamma2_step: config.step_period * config.gamma2,
            gamma3_step: config.step_period * config.gamma3,
        })
    }

    /// The configuration that was validated.
    #[must_use]
    pub fn config(&self) -> &SaturatedConfig {
        &self.config
    }

    /// A state that goes on from `checkpoint`.
    ///
    /// # Errors
    /// Names the field of `checkpoint` that is outside its set.
    pub fn resume(&self, checkpoint: &Checkpoint) -> Result<SaturatedState, ConfigError> {
        let set =
            VectorInterval { lower: self.inverse_inertia_min, upper: self.inverse_inertia_max };
        let sets = set.axes().map(Bound::from);
        for (component, set) in checkpoint.inverse_inertia.to_array().into_iter().zip(sets) {
            require("checkpoint.inverse_inertia", component, set, "the set of theta_hat, (51)")?;
        }
        for component in checkpoint.gyroscopic_ratio.to_array() {
            let set = Bound::Inside(-1.0, 1.0);
            require("checkpoint.gyroscopic_ratio", component, set, "the set of Pi_hat, (52)")?;
        }
        let Auxiliary { attitude, rate } = checkpoint.auxiliary;
        let length = Bound::Inside(0.98, 1.02);
        require(
            "|checkpoint.auxiliary.attitude|^2",
            attitude.length_squared(),
            length,
            "unit quaternion",
        )?;
        for component in rate.to_array() {
            let range = Bound::Inside(-self.auxiliary.rate_max, self.auxiliary.rate_max);
            require("checkpoint.auxiliary.rate", component, range, "0.5 rad per step")?;
        }
        let name = "checkpoint.lasting.angular_acceleration_body";
        let torque = (checkpoint.lasting.angular_acceleration_body, name);
        Ok(SaturatedState {
            cascade: self.cascade.resume(checkpoint, torque)?,
            inverse_inertia: Estimate::new(checkpoint.inverse_inertia),
            gyroscopic_ratio: Estimate::new(checkpoint.gyroscopic_ratio),
            auxiliary: (checkpoint.auxiliary != Auxiliary::REST).then_some(checkpoint.auxiliary),
            acting_torque: Vec3::ZERO,
        })
    }

    /// Step 4 at body rate `w`; `made` is what the rotors make of a command.
    #[inline(always)]
    fn law(
        &self,
        state: &SaturatedState,
        evaluation: &Evaluation,
        w: Vec3,
        made: impl Made,
    ) -> Law {
        let Self { cascade, config, .. } = self;
        let without_auxiliary = w - evaluation.virtual_rate.mu;
        let rate_error = match state.auxiliary {
            Some(auxiliary) => without_auxiliary - auxiliary.rate,
            None => without_auxiliary,
        };
        let products = Vec3::new(w.y * w.z, w.x * w.z, w.x * w.y); // B
        let sign = smooth_sign_value(rate_error, cascade.delta_squared_rotation(&state.cascade));
        let theta = state.inverse_inertia.value();
        let mut demand = evaluation.virtual_rate.mu_dot
            - config.k4 * without_auxiliary
            - vector_part(evaluation.attitude_error)
            - state.gyroscopic_ratio.value() * products
            - self.disturbance_rate * sign;
        let mut lasting_rate = Vec3::ZERO;
        if let Some(integral) = &cascade.integral.torque {
            let s_hat = state.cascade.integral.torque.value();
            demand -= s_hat;
            lasting_rate = integral.rate(s_hat, rate_error);
        }
        let torque_demand = demand / theta; // (50)
        let commanded = match &self.rotors {
            Some(rotors) => {
                cold_path(); // the registers of a step without it are its own
                rotors.command(torque_demand, config.torque_max, state.acting_torque)
            }
            None => {
                let (torque, saturated) = clip_seen(torque_demand, config.torque_max); // (37)
                Commanded { torque, made: torque, acting: torque, saturated }
            }
        };
        let Commanded { torque, made, acting, saturated } =
            self.limited(state, evaluation, commanded, made);
        Law {
            rate_error,
            torque_demand,
            torque,
            made,
            acting,
            saturated,
            products,
            theta,
            inverse_inertia_increment: self.gamma2_step * (acting * rate_error), // (51)
            gyroscopic_ratio_increment: self.gamma3_step * (products * rate_error), // (52)
            lasting_rate,
        }
    }

    /// `commanded` with what the rotors make of it as the torque that acts in (39) and (51).
    #[inline(always)]
    fn limited(
        &self,
        state: &SaturatedState,
        evaluation: &Evaluation,
        commanded: Commanded,
        made: impl Made,
    ) -> Commanded {
        if made.is_the_command() {
            return commanded;
        }
        let torque_body = commanded.torque;
        let made = made.of(&Wrench { thrust: self.cascade.thrust(evaluation), torque_body });
        let made = if made.is_finite() { made } else { torque_body };
        let acting = match &self.rotors {
            Some(rotors) => rotors.mean(state.acting_torque, made),
            None => made,
        };
        let saturated = commanded.saturated | (made != torque_body);
        Commanded { made, acting, saturated, ..commanded }
    }

    /// Advances the memory; called only when every number is finite.
    #[inline(always)]
    fn commit(&self, state: &mut SaturatedState, evaluation: &Evaluation, law: &Law) -> StepOutput {
        let mut status = evaluation.status;
        status.set(StepStatus::TORQUE_SATURATED, law.saturated);
        let mut driven = law.saturated;
        if let Some(rotors) = &self.rotors {
            state.acting_torque = rotors.after(state.acting_torque, law.made);
            driven = true;
        }
        let (lower, upper) = (self.inverse_inertia_min, self.inverse_inertia_max);
        let theta = state.inverse_inertia.advance(law.inverse_inertia_increment, lower, upper);
        let increment = law.gyroscopic_ratio_increment;
        let pi = state.gyroscopic_ratio.advance_within_one(increment, Vec3::ONE);
        if theta | pi {
            status |= StepStatus::INERTIA_PROJECTED;
        }
        status |= self.cascade.integrate_torque(&mut state.cascade, law.lasting_rate);
        if driven || state.auxiliary.is_some() {
            let dt = self.config.step_period;
            let rate_world = evaluation.virtual_rate.auxiliary_rate_world;
            let drive = law.auxiliary_drive();
            status |= self.auxiliary.advance(&mut state.auxiliary, dt, rate_world, drive, driven);
        }
        let (torque, demand) = (law.torque, law.torque_demand);
        self.cascade.commit(&mut state.cascade, evaluation, torque, demand, status)
    }
}

/// Loops of step 4.
fn require_law_integrable(
    judge: &mut impl Judge,
    config: &SaturatedConfig,
) -> Result<(), ConfigError> {
    let VectorInterval { lower, upper } = config.uncertainty.inertia;
    let dt = config.step_period;
    let sign_slope =
        config.uncertainty.disturbance_torque / (lower * config.cascade.delta_min_rotation);
    // The estimate may be off by J_hi/J_lo, which scales the whole loop.
    let rate = (config.k4 + sign_slope + 0.5 * config.cascade.k3) * (upper / lower);
    let names = axis_names!(expression "step_period * (k4 + D2/(J_lo delta_min_rotation) + k3/2) J_hi/J_lo");
    require_integrable_axes(judge, names, dt, rate)?;
    require_integrable(judge, "step_period * k5", dt, config.k5)?;
    let gamma2 = config.gamma2;
    let root = Vec3::new(sqrt(gamma2.x), sqrt(gamma2.y), sqrt(gamma2.z));
    let names = axis_names!(expression "step_period * M_tau sqrt(gamma2)");
    require_integrable_axes(judge, names, dt, config.torque_max * root)
}

impl TrackingController for Saturated {
    type State = SaturatedState;

    fn initial_state(&self) -> SaturatedState {
        let (lower, upper) = (self.inverse_inertia_min, self.inverse_inertia_max);
        let inverse = self.config.initial.inertia.recip().clamp(lower, upper);
        SaturatedState {
            cascade: self.cascade.initial_state(),
            inverse_inertia: Estimate::new(inverse),
            gyroscopic_ratio: Estimate::new(Vec3::ZERO),
            auxiliary: None,
            acting_torque: Vec3::ZERO,
        }
    }

    #[inline]
    fn step(
        &self,
        state: &mut SaturatedState,
        vehicle: &VehicleState,
        reference: &Reference,
    ) -> StepOutput {
        self.step_observed(state, vehicle, reference, |_| {})
    }

    fn step_period(&self) -> f32 {
        self.config.step_period
    }
}

impl Saturated {
    /// One step; `made` is what the rotors make of a command.
    #[inline]
    fn stepped(
        &self,
        state: &mut SaturatedState,
        vehicle: &VehicleState,
        reference: &Reference,
        made: impl Made,
        observe: impl FnOnce(&Intermediates),
    ) -> StepOutput {
        let mut clipped = None;
        let Some(input) = self.cascade.admit(vehicle, reference, &mut clipped) else {
            return self.cascade.hold(&mut state.cascade, vehicle, reference);
        };
        let auxiliary = state.auxiliary.as_ref().map(|at| (at, self.config.k5));
        let evaluation = self.cascade.evaluate(&state.cascade, &input, vehicle, auxiliary);
        let law = self.law(state, &evaluation, vehicle.rate_body, made);
        let increments = law.inverse_inertia_increment + law.gyroscopic_ratio_increment;
        let sum = (law.torque_demand + increments).element_sum();
        if !evaluation.is_usable(law.rate_error, sum) {
            return self.cascade.hold(&mut state.cascade, vehicle, reference);
        }
        observe(&Intermediates {
            rate_error: law.rate_error,
            torque_demand_body: law.torque_demand,
            torque_body: law.torque,
            acting_torque_body: law.acting,
            inverse_inertia_rate: self.config.gamma2 * law.acting * law.rate_error,
            gyroscopic_ratio_rate: self.config.gamma3 * law.products * law.rate_error,
            lasting_torque_rate: law.lasting_rate,
            auxiliary_attitude_rate: attitude_rate(
                state.auxiliary,
                evaluation.virtual_rate.auxiliary_rate_world,
            ),
            auxiliary_rate_dot: rate_dot(state.auxiliary, self.config.k4, law.auxiliary_drive()),
            ..evaluation.intermediates(&self.cascade, &state.cascade)
        });
        self.commit(state, &evaluation, &law)
    }
}

impl AdaptiveController for Saturated {
    #[inline]
    fn step_observed(
        &self,
        state: &mut SaturatedState,
        vehicle: &VehicleState,
        reference: &Reference,
        observe: impl FnOnce(&Intermediates),
    ) -> StepOutput {
        self.stepped(state, vehicle, reference, TheCommand, observe)
    }

    #[inline]
    fn step_limited(
        &self,
        state: &mut SaturatedState,
        vehicle: &VehicleState,
        reference: &Reference,
        made: impl FnOnce(&Wrench) -> Vec3,
        observe: impl FnOnce(&Intermediates),
    ) -> StepOutput {
        self.stepped(state, vehicle, reference, made, observe)
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

    fn estimates(&self, state: &SaturatedState) -> Estimates {
        Estimates {
            inverse_mass: state.cascade.inverse_mass(),
            inertia: Vec3::ZERO,
            inverse_inertia: state.inverse_inertia.value(),
            gyroscopic_ratio: state.gyroscopic_ratio.value(),
        }
    }

    fn attitude_error(&self, state: &SaturatedState) -> Quat {
        state.cascade.attitude_error
    }

    fn auxiliary(&self, state: &SaturatedState) -> Auxiliary {
        state.auxiliary.unwrap_or(Auxiliary::REST)
    }

    fn lasting(&self, state: &SaturatedState) -> LastingEstimates {
        let integral = &state.cascade.integral;
        LastingEstimates {
            acceleration_world: integral.force.value(),
            torque_body: Vec3::ZERO,
            angular_acceleration_body: integral.torque.value(),
        }
    }
}
