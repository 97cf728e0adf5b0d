//! The Lyapunov function and its ingredients at one tick, as data; [`Evaluator`] computes them.
//!
//! [`Evaluator`]: crate::guarantee::lyapunov::Evaluator

use glam::{DQuat, DVec3};

/// V and its ingredients at one tick, from the truth.
#[derive(Clone, Copy, Debug, Default)]
pub struct Evaluation {
    /// `e_p` (m).
    pub position_error: DVec3,
    /// `q_e`, with the sign that the law chose.
    pub attitude_error: DQuat,
    /// `w_e` (rad/s).
    pub rate_error: DVec3,
    /// `V3` (controller 1) or `V5` (controller 2).
    pub value: f64,
    /// The part of V due to the estimates; it need not decay.
    pub parameter_part: f64,
    /// `W`: the guaranteed decrease of V, (36) or (53) (1/s).
    pub decrease: f64,
    pub(crate) translation: Translation,
    pub(crate) attitude: Attitude,
    pub(crate) lengths: Lengths,
    /// `J^-1 ((J w) × w)`, weighed as `w_e'` is in V.
    pub(crate) gyroscopic: DVec3,
    /// `a`, `theta`: true less estimated parameters, zero where adaptation is off.
    pub(crate) inverse_mass_error: f64,
    pub(crate) inertia_error: DVec3,
    /// `d_c - d_hat`, and `t_c - t_hat` or `s_c - s_hat`; zero without integral action.
    pub(crate) lasting_error: [DVec3; 2],
    /// Widths of the translational and the rotational smooth sign.
    pub(crate) delta: (Width, Width),
    /// Increments of the estimates until the next tick, before projection.
    pub(crate) increments: Increments,
    /// `beta`.
    pub(crate) inverse_mass: f64,
}

/// Everything translational at one tick.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Translation {
    pub position_error: DVec3,
    pub velocity_error: DVec3,
    /// `sig_1(L1)`.
    pub sigma_1: DVec3,
    /// `G` (16).
    pub g: DVec3,
    /// `h(G, delta_t)` (17).
    pub sign: DVec3,
    /// `alpha` (13).
    pub alpha: DVec3,
    /// `V1` without its mass term.
    pub potential: f64,
    /// `k2 |sig_1 + sig_2|^2 + (k1/k2) L2 . sig_2(L2)` (18).
    pub decrease: f64,
}

/// Attitudes at one tick.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Attitude {
    /// `q_d`.
    pub desired: DQuat,
    /// `q_e`, with the sign that the law chose.
    pub error: DQuat,
}

/// Lengths at one tick.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Lengths {
    /// Of `G`.
    pub g: f64,
    /// Of `alpha`: the thrust `f` (21) (N).
    pub alpha: f64,
    /// Of `sig_1(L1)`.
    pub sigma_1: f64,
    /// Of `eps_e`.
    pub attitude_error: f64,
    /// Of `w_e` (rad/s).
    pub rate_error: f64,
    /// Of `w` (rad/s).
    pub rate: f64,
    /// Of `mu` (rad/s).
    pub virtual_rate: f64,
    /// Of the reference's jerk (m/s^3).
    pub jerk: f64,
}

/// Width of a smooth sign.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Width {
    /// `delta`.
    pub value: f64,
    /// Bound of the difference to `h` with the core's own width.
    pub sign_error: f64,
}

/// Unprojected increments of the estimates over one tick: (14), (35) or (51), (52), integral action.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Increments {
    pub inverse_mass: f64,
    pub inertia: DVec3,
    pub gyroscopic_ratio: DVec3,
    /// Of `d_hat`, and of `t_hat` or `s_hat`.
    pub lasting: [DVec3; 2],
}
