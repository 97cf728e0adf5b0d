//! The interface of controllers: [`TrackingController`] for every harness, [`AdaptiveController`] for
//! the laws of the paper, and [`AnyController`] for a choice at run time.

mod any;
mod config;

pub use any::{AnyController, AnyControllerState};
pub use config::ControllerConfig;

pub use crate::auxiliary::Auxiliary;

use glam::{Quat, Vec3};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Bound, ConfigError, require};
use crate::reference::Reference;
use crate::trajectory::Trajectory;
use crate::vehicle::{VehicleState, Wrench, WrenchBounds};

bitflags::bitflags! {
    /// Events of one step. Empty when the law was evaluated without any limit acting.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    #[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
    pub struct StepStatus: u16 {
        /// The wrench is the last one that was computed from good input (or the safe initial one).
        const OUTPUT_HELD = 1 << 0;
        /// The vehicle state is not finite, out of range, or its quaternion has no direction.
        const STATE_INVALID = 1 << 1;
        /// The reference is not finite or out of range.
        const REFERENCE_INVALID = 1 << 2;
        /// The law gave a number that is not finite; nothing was committed.
        const RESULT_INVALID = 1 << 3;
        /// The attitude quaternion was more than 1 % off unit length and has been normalised.
        const ATTITUDE_RENORMALISED = 1 << 4;
        /// The reference acceleration exceeded `M_p` and has been clipped to it.
        const REFERENCE_CLIPPED = 1 << 5;
        /// Thrust command and heading were nearly parallel; the last lateral axis was held.
        const HEADING_HELD = 1 << 6;
        /// A component of the demanded torque exceeded `M_tau` (37), or what the rotors make of it.
        const TORQUE_SATURATED = 1 << 7;
        /// The mass estimate is on the border of its set (14).
        const MASS_PROJECTED = 1 << 8;
        /// An inertia or gyroscopic estimate is on the border of its set (35), (51), (52).
        const INERTIA_PROJECTED = 1 << 9;
        /// The sign of the attitude error was changed to turn the short way round.
        const SIGN_FLIPPED = 1 << 10;
        /// The auxiliary rate of controller 2 was clipped to what a step can integrate.
        const AUXILIARY_CLIPPED = 1 << 11;
        /// An estimate of the integral action is on the border of its set.
        const LASTING_PROJECTED = 1 << 12;
    }
}

impl StepStatus {
    /// The flags that mean bad input or a failed evaluation, as opposed to an acting limit.
    pub const FAULT: Self = Self::OUTPUT_HELD
        .union(Self::STATE_INVALID)
        .union(Self::REFERENCE_INVALID)
        .union(Self::RESULT_INVALID);
}

/// Result of one step; `StepOutput::from(wrench)` is that of a law without limits or faults.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct StepOutput {
    /// The command, always finite and inside the controller's [`WrenchBounds`].
    pub wrench: Wrench,
    /// `tau_d`: the torque before saturation (N m); the wrench's own for controller 1.
    pub torque_demand_body: Vec3,
    /// Limits that acted, and faults.
    pub status: StepStatus,
}

impl From<Wrench> for StepOutput {
    fn from(wrench: Wrench) -> Self {
        Self { wrench, torque_demand_body: wrench.torque_body, status: StepStatus::empty() }
    }
}

/// The controller's current estimates of the unknown parameters; zero where it has none.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct Estimates {
    /// `beta`: inverse mass (1/kg).
    pub inverse_mass: f32,
    /// `a_hat`: principal moments of inertia (kg m^2), controller 1.
    pub inertia: Vec3,
    /// `theta_hat`: their inverses (1/(kg m^2)), controller 2.
    pub inverse_inertia: Vec3,
    /// `Pi_hat`: gyroscopic ratios (-), controller 2.
    pub gyroscopic_ratio: Vec3,
}

impl Estimates {
    /// No estimates: all zero.
    pub const NONE: Self = Self {
        inverse_mass: 0.0,
        inertia: Vec3::ZERO,
        inverse_inertia: Vec3::ZERO,
        gyroscopic_ratio: Vec3::ZERO,
    };
}

/// The estimates of disturbances that last; zero without integral action.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct LastingEstimates {
    /// `d_hat`: lasting disturbance acceleration, horizontal (m/s^2).
    pub acceleration_world: Vec3,
    /// `t_hat`: lasting disturbance torque (N m), controller 1.
    pub torque_body: Vec3,
    /// `s_hat`: its quotient by the moments of inertia (rad/s^2), controller 2.
    pub angular_acceleration_body: Vec3,
}

impl LastingEstimates {
    /// The lasting disturbance torque (N m) of either controller, whose other estimates are `estimates`.
    #[must_use]
    pub fn torque(&self, estimates: &Estimates) -> Vec3 {
        if estimates.inverse_inertia == Vec3::ZERO {
            self.torque_body
        } else {
            self.angular_acceleration_body / estimates.inverse_inertia
        }
    }
}

/// Every intermediate quantity of one evaluation of the law, for tests, traces and monitors.
///
/// Fields that belong to one controller only are zero for the other.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Intermediates {
    /// `e_p` (m).
    pub position_error_world: Vec3,
    /// `e_v` (m/s).
    pub velocity_error_world: Vec3,
    /// `G` (16) (1/s).
    pub g: Vec3,
    /// `alpha` (13) (N).
    pub alpha: Vec3,
    /// `alpha'` (N/s).
    pub alpha_dot: Vec3,
    /// `alpha''` (N/s^2).
    pub alpha_ddot: Vec3,
    /// `f` (21) (N).
    pub thrust: f32,
    /// `w_d` (25): rate of the desired attitude in its own axes (rad/s).
    pub desired_rate: Vec3,
    /// `w_d'` (rad/s^2).
    pub desired_rate_dot: Vec3,
    /// `q_e` (27), (46).
    pub attitude_error: Quat,
    /// `mu` (31), (49): virtual rate (rad/s).
    pub mu: Vec3,
    /// `mu'` (rad/s^2).
    pub mu_dot: Vec3,
    /// `w_e`: rate error (rad/s).
    pub rate_error: Vec3,
    /// `tau_d` (34), (50) (N m).
    pub torque_demand_body: Vec3,
    /// `tau` (34), (37) (N m).
    pub torque_body: Vec3,
    /// Torque that the law takes to act on the vehicle, the mean over the step (N m): `torque_body` without a
    /// model of the rotors and their limits.
    pub acting_torque_body: Vec3,
    /// `beta'` (14) (1/(kg s)).
    pub inverse_mass_rate: f32,
    /// `a_hat'` (35) (kg m^2/s), controller 1.
    pub inertia_rate: Vec3,
    /// `theta_hat'` (51) (1/(kg m^2 s)), controller 2.
    pub inverse_inertia_rate: Vec3,
    /// `Pi_hat'` (52) (1/s), controller 2.
    pub gyroscopic_ratio_rate: Vec3,
    /// `W_a` (38): rate of the auxiliary attitude in its own axes (rad/s), controller 2.
    pub auxiliary_attitude_rate: Vec3,
    /// `w_a'` (39) (rad/s^2), controller 2.
    pub auxiliary_rate_dot: Vec3,
    /// `d_hat'` (m/s^3).
    pub lasting_acceleration_rate: Vec3,
    /// `t_hat'` (N m/s), controller 1, or `s_hat'` (rad/s^3), controller 2.
    pub lasting_torque_rate: Vec3,
}

/// A tracking controller: an immutable, validated value; its memory is a separate state.
///
/// Everything a harness needs to fly a vehicle. Implement it for a control law of your own; the laws of
/// this crate also implement [`AdaptiveController`].
///
/// The step is fixed-step and must be total: a finite wrench and a status, whatever the input.
pub trait TrackingController {
    /// The controller's memory between two steps.
    type State: Clone;

    /// The memory before the first step.
    fn initial_state(&self) -> Self::State;

    /// Evaluates the law at the current tick and advances `state` by one step period.
    fn step(
        &self,
        state: &mut Self::State,
        vehicle: &VehicleState,
        reference: &Reference,
    ) -> StepOutput;

    /// The fixed step `dt` (s).
    fn step_period(&self) -> f32;
}

/// A controller of the paper: known bounds, estimates, an auxiliary system, and a view of every
/// intermediate quantity.
///
/// The step is total: whatever the input, it returns a finite wrench inside [`bounds`](Self::bounds),
/// a status, and a state whose estimates are inside their sets. It allocates nothing, blocks on
/// nothing, has no loop, and calls no sine or cosine.
pub trait AdaptiveController: TrackingController {
    /// Performs the same step as [`step`](TrackingController::step) and passes every intermediate
    /// quantity to `observe`, which is not called when the output is held.
    fn step_observed(
        &self,
        state: &mut Self::State,
        vehicle: &VehicleState,
        reference: &Reference,
        observe: impl FnOnce(&Intermediates),
    ) -> StepOutput;

    /// As [`step_observed`](Self::step_observed), with `made` in place of the commanded torque as the one that acts:
    /// controller 2's auxiliary system (39) and adaptation (51) then take what the rotors make of the command, for example
    /// an [allocation's](crate::allocation) `achieved`. `made` is asked once, for the command of this step (N m); what is
    /// not finite counts as the command. Controller 1, which no torque saturates, does not ask.
    fn step_limited(
        &self,
        state: &mut Self::State,
        vehicle: &VehicleState,
        reference: &Reference,
        made: impl FnOnce(&Wrench) -> Vec3,
        observe: impl FnOnce(&Intermediates),
    ) -> StepOutput {
        let _ = made;
        self.step_observed(state, vehicle, reference, observe)
    }

    /// `M_p`: bound of each component of the reference acceleration (m/s^2).
    fn reference_acceleration_max(&self) -> f32;

    /// The set in which every wrench lies.
    fn bounds(&self) -> WrenchBounds;

    /// The estimates in `state`.
    fn estimates(&self, state: &Self::State) -> Estimates;

    /// `q_e` of the latest step.
    fn attitude_error(&self, state: &Self::State) -> Quat;

    /// The auxiliary system in `state`.
    fn auxiliary(&self, state: &Self::State) -> Auxiliary;

    /// The estimates of the integral action in `state`.
    fn lasting(&self, state: &Self::State) -> LastingEstimates;

    /// `true` if the law has integral action, so that [`lasting`](Self::lasting) is more than zeros.
    fn has_integral_action(&self) -> bool;

    /// Refuses a trajectory whose acceleration bound exceeds `M_p`, or whose step period differs.
    ///
    /// # Errors
    /// Names `trajectory.acceleration_bound` or `trajectory.step_period`, its value and the bound.
    fn accept(&self, trajectory: &impl Trajectory) -> Result<(), ConfigError> {
        self.accept_limits(trajectory.acceleration_bound(), trajectory.step_period())
    }

    /// As [`accept`](Self::accept), for a trajectory of this acceleration bound (m/s^2) and step
    /// period (s).
    ///
    /// # Errors
    /// As [`accept`](Self::accept).
    fn accept_limits(&self, acceleration_bound: f32, step_period: f32) -> Result<(), ConfigError> {
        require(
            "trajectory.acceleration_bound",
            acceleration_bound,
            Bound::Inside(0.0, self.reference_acceleration_max()),
            "M_p of the controller, Assumption 4",
        )?;
        let period = self.step_period();
        require(
            "trajectory.step_period",
            step_period,
            Bound::Inside(period, period),
            "step period of the controller",
        )
    }
}
