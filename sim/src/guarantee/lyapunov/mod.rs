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
//! what V may do from one tick to the next along the real closed loop; [`balance`] computes it.

pub mod adaptation;
pub mod attitude;
pub mod balance;
pub mod function;
mod lengths;
pub mod monitor;
pub mod parameters;
mod rounding;
pub mod translation;

#[cfg(test)]
mod tests;

pub use balance::SMOOTHING;
pub use function::Evaluator;
pub use monitor::LyapunovMonitor;
