//! Reference trajectories with analytic derivatives up to snap.
//!
//! A trajectory is evaluated at an integer tick, so that time never accumulates rounding; each
//! one is immutable, bounded in storage, and knows a bound of its own acceleration.

use crate::reference::Reference;

/// A reference for every tick.
pub trait Trajectory {
    /// The reference at `tick` steps after the start.
    fn reference(&self, tick: u64) -> Reference;

    /// A bound of the magnitude of each component of the acceleration, over all time [m/s^2].
    fn acceleration_bound(&self) -> f32;

    /// The time between two ticks [s].
    fn step_period(&self) -> f32;
}
