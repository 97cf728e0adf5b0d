//! The Lyapunov functions of both theorems, from the plant's truth, in `f64`.
//!
//! ```text
//! V1 = sum_j [ M1 ln cosh(L1_j) + M2 ln cosh(L2_j) ] + k1/2 |e_v|^2 + (1/m - beta)^2/(2 gamma1)
//! V3 = c V1 + 2 (1 - eta_e) + 1/2 w_e^T J w_e + |a - a_hat|^2/(2 gamma2)
//! V5 = c V1 + 2 (1 - eta_e) + 1/2 |w_e|^2 + |theta - theta_hat|^2/(2 gamma2)
//!                                         + |Pi - Pi_hat|^2/(2 gamma3)
//! ```
//!
//! Integral action adds `c |d_c - d_hat|^2/(2 gamma_d)` and `|t_c - t_hat|^2/(2 gamma_t)`.
//! A term whose adaptation is switched off (`gamma = 0`) is left out. `docs/guarantees.md` derives
//! what V may do from one tick to the next along the real closed loop; `balance` computes it. All of it works on
//! a block of ticks, one per SIMD lane.

mod adaptation;
mod attitude;
mod balance;
mod function;
mod lengths;
mod monitor;
mod parameters;
mod rounding;
mod translation;

#[cfg(test)]
mod tests;

pub use balance::SMOOTHING;
pub(crate) use function::EvaluatedBlock;
pub use function::Evaluator;
pub(crate) use monitor::LyapunovMonitor;
