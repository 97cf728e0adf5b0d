//! `cargo xtask wcet`: bounds on a control step's instructions and cycles, from its machine code.
//!
//! Each function is a control-flow graph with one node per instruction; its bound is the most
//! expensive path, where a call costs the bound of the called function. Unlike the maxima that
//! the emulator measures, the bound holds for inputs that nobody tried. Everything that cannot be
//! followed is an error: an unknown instruction, a call or jump through a register, recursion,
//! and a loop, since no step has one.

mod analysis;
mod bound;
mod constants;
mod flow;
mod instruction;
mod library;
mod limit;
mod measured;
mod path;
mod report;
mod response;
mod section;
mod tasks;
mod timing;
mod traffic;

pub use analysis::{Functions, Known};
pub use bound::Bounds;
pub use library::aborts;
pub use report::{check, judge};
pub use section::{ALL, Ceilings, ceilings};
pub use tasks::{bounds as task_bounds, declared_tasks, report as report_tasks, rows as task_rows};
pub use timing::Model;
