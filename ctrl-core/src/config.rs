//! Configuration by the user: plain structs with units, checked once by a controller's constructor.
//!
//! Gains carry the symbols of `docs/theory.md`; everything else is spelled out. What the proofs allow to
//! differ from one body axis to the next is a vector; in a file one number stands for all three. The structs can be
//! written as literals, and are not `#[non_exhaustive]` on purpose: a gain that was not chosen has no
//! guarantee, so a new one is an error of the compiler in a dependant, in a release that says so.

use glam::Vec3;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::rotors::RotorModel;
use crate::vehicle::{InitialEstimate, Uncertainty};

/// Gains of the cascade that both controllers share: steps 1 to 3 of the paper.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct CascadeGains {
    /// `k1`: position gain inside the saturations (1/m).
    pub k1: f32,
    /// `k2`: velocity gain inside the saturations (s/m).
    pub k2: f32,
    /// `k3`: attitude gain about each body axis (1/s).
    #[cfg_attr(feature = "serde", serde(with = "crate::per_axis"))]
    pub k3: Vec3,
    /// `c`: weight of the translational Lyapunov function; `c = 1` is the printed law, and zero
    /// leaves out the coupling term of (31), (49).
    pub c: f32,
    /// `M1`: limit of the position part of the commanded acceleration (m/s^2).
    #[cfg_attr(feature = "serde", serde(rename = "M1"))]
    pub m1: f32,
    /// `M2`: limit of the velocity part of the commanded acceleration (m/s^2).
    #[cfg_attr(feature = "serde", serde(rename = "M2"))]
    pub m2: f32,
    /// `gamma1`: adaptation gain of the inverse mass (1/(kg N)); zero switches it off.
    pub gamma1: f32,
    /// `delta_1`: decay rate of the smoothing width `delta(t)` (17) (1/s).
    pub delta_1: f32,
    /// Floor of the smoothing width of the translational smooth sign, in the unit of `G` (1/s).
    pub delta_min_translation: f32,
    /// Floor of the smoothing width of the rotational smooth sign (rad/s).
    pub delta_min_rotation: f32,
}

/// Integral action against disturbances that last: two estimates, each projected onto its bound.
///
/// Off by default, which leaves the paper's laws. A bound and its gain are both positive or both zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct IntegralAction {
    /// `D_c`: bound of each horizontal component of the lasting disturbance acceleration, which comes
    /// on top of `D1` (m/s^2); zero switches the estimate off.
    pub acceleration_max: f32,
    /// `gamma_d`: gain of its estimate (m/s^2).
    pub gamma_d: f32,
    /// `D_t`: bound of each component of the lasting disturbance torque, which comes on top of `D2`
    /// (N m); zero switches the estimate off.
    pub torque_max: f32,
    /// `gamma_t`: gain of its estimate (N m for controller 1, 1/s^2 for controller 2).
    pub gamma_t: f32,
}

impl IntegralAction {
    /// No integral action.
    pub const OFF: Self =
        Self { acceleration_max: 0.0, gamma_d: 0.0, torque_max: 0.0, gamma_t: 0.0 };
}

/// Configuration of controller 1, the robust adaptive controller (Theorem 1).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct RobustAdaptiveConfig {
    /// `dt`: fixed time between two steps (s).
    pub step_period: f32,
    /// `M_p`: bound of each component of the reference acceleration (m/s^2).
    pub reference_acceleration_max: f32,
    /// Known bounds of vehicle and disturbance.
    pub uncertainty: Uncertainty,
    /// Estimates at the first step.
    pub initial: InitialEstimate,
    /// Gains of the shared cascade.
    pub cascade: CascadeGains,
    /// `k4`: rate gain about each body axis (N m s).
    #[cfg_attr(feature = "serde", serde(with = "crate::per_axis"))]
    pub k4: Vec3,
    /// `gamma2`: adaptation gain of the inertia about each body axis; zero switches it off.
    #[cfg_attr(feature = "serde", serde(with = "crate::per_axis"))]
    pub gamma2: Vec3,
    /// Integral action against lasting disturbances; off by default.
    #[cfg_attr(feature = "serde", serde(default))]
    pub integral: IntegralAction,
    /// Rotors that lag behind the torque command; off by default.
    #[cfg_attr(feature = "serde", serde(default))]
    pub rotors: RotorModel,
}

/// Configuration of controller 2, with limited thrust and torque (Theorem 2).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct SaturatedConfig {
    /// `dt`: fixed time between two steps (s).
    pub step_period: f32,
    /// `M_p`: bound of each component of the reference acceleration (m/s^2).
    pub reference_acceleration_max: f32,
    /// Known bounds of vehicle and disturbance.
    pub uncertainty: Uncertainty,
    /// Estimates at the first step.
    pub initial: InitialEstimate,
    /// Gains of the shared cascade.
    pub cascade: CascadeGains,
    /// `M_f`: thrust limit (N).
    pub thrust_max: f32,
    /// `M_tau`: limit of the torque about each body axis (N m).
    #[cfg_attr(feature = "serde", serde(with = "crate::per_axis"))]
    pub torque_max: Vec3,
    /// `k4`: rate gain about each body axis (1/s).
    #[cfg_attr(feature = "serde", serde(with = "crate::per_axis"))]
    pub k4: Vec3,
    /// `k5`: attitude gain of the auxiliary system (1/s).
    pub k5: f32,
    /// `gamma2`: adaptation gain of the inverse inertia about each body axis; zero switches it off.
    #[cfg_attr(feature = "serde", serde(with = "crate::per_axis"))]
    pub gamma2: Vec3,
    /// `gamma3`: adaptation gain of the gyroscopic ratios; zero switches it off.
    pub gamma3: f32,
    /// Integral action against lasting disturbances; off by default.
    #[cfg_attr(feature = "serde", serde(default))]
    pub integral: IntegralAction,
    /// Rotors that lag behind the torque command; off by default.
    #[cfg_attr(feature = "serde", serde(default))]
    pub rotors: RotorModel,
}

/// Point of resumption of a controller: its estimates, and the decay of the smoothing.
///
/// A controller's `resume` checks it and turns it into a state, so that a vehicle starts with the
/// estimates of its last flight. Fields of the other controller are ignored.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Checkpoint {
    /// Time since the first step (s); sets `delta(t)`.
    pub elapsed: f32,
    /// `beta`: inverse mass (1/kg).
    pub inverse_mass: f32,
    /// `a_hat`: inertia (kg m^2), controller 1.
    pub inertia: Vec3,
    /// `theta_hat`: inverse inertia (1/(kg m^2)), controller 2.
    pub inverse_inertia: Vec3,
    /// `Pi_hat`: gyroscopic ratios (-), controller 2.
    pub gyroscopic_ratio: Vec3,
    /// Auxiliary system, controller 2.
    pub auxiliary: crate::controller::Auxiliary,
    /// Estimates of the integral action.
    #[cfg_attr(feature = "serde", serde(default))]
    pub lasting: crate::controller::LastingEstimates,
}
