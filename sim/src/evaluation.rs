//! The Lyapunov function at one tick, as data; [`Evaluator`] computes it.
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
}
