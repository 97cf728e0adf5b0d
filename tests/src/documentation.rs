//! The Rust blocks of the documentation, as doc tests. `sil-host/tests/documentation` checks that no
//! page with such a block is missing here.

#[doc = include_str!("../../README.md")]
mod readme {}
#[doc = include_str!("../../docs/how-to/own-controller.md")]
mod own_controller {}
#[doc = include_str!("../../docs/how-to/own-disturbance.md")]
mod own_disturbance {}
#[doc = include_str!("../../docs/how-to/own-monitor.md")]
mod own_monitor {}
#[doc = include_str!("../../docs/how-to/own-trajectory.md")]
mod own_trajectory {}
