//! References that follow the restarts of an estimate, and are led back.
//!
//! A restart moves the estimate, not the vehicle. The reference moves with it, so that the controller sees no step,
//! and is then led back with a bounded acceleration:
//!
//! ```text
//! p_d + offset (1 - s(t/T)),   s(x) = 35 x^4 - 84 x^5 + 70 x^6 - 20 x^7,   T = sqrt(7.513 |offset|/limit)
//! ```
//!
//! whose derivatives up to the third begin and end at zero.

use glam::Vec3;

use super::state::Restart;
use crate::reference::Reference;
use crate::sqrt::sqrt;
use crate::vehicle::GRAVITY;

/// Share of `M_p` that the way back may take; the rest is the trajectory's.
pub const RESTART_SHARE: f32 = 0.5;
/// Largest second derivative of `s`: 84/(5 sqrt(5)).
const PEAK: f32 = 7.513_188;

/// A shift in progress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceShift {
    /// Largest acceleration that is added to the reference (m/s^2).
    limit: f32,
    count: u16,
    /// Where the shift began (m).
    offset: Vec3,
    time: f32,
    /// `T`; zero while nothing is shifted (s).
    duration: f32,
}

impl ReferenceShift {
    /// Nothing shifted; `limit`, [`RESTART_SHARE`] of `M_p`, is the largest acceleration that the way back adds to the reference, positive (m/s^2).
    #[must_use]
    pub const fn new(limit: f32) -> Self {
        Self { limit, count: 0, offset: Vec3::ZERO, time: 0.0, duration: 0.0 }
    }

    /// The offset now (m).
    #[must_use]
    pub fn offset(&self) -> Vec3 {
        if self.duration <= 0.0 {
            return Vec3::ZERO;
        }
        // s(x) = 1 - s(1 - x): the half without cancellation.
        let x = self.place();
        let y = if x < 0.5 { x } else { 1.0 - x };
        let s = y * y * y * y * (35.0 + y * (-84.0 + y * (70.0 - 20.0 * y)));
        self.offset * if x < 0.5 { 1.0 - s } else { s }
    }

    /// `t/T`.
    fn place(&self) -> f32 {
        if self.duration > 0.0 { self.time / self.duration } else { 0.0 }
    }

    /// Moves on by one step of `step_period` (s), and takes the estimate's latest restart.
    pub fn advance(&mut self, restart: &Restart, step_period: f32) {
        self.time += step_period;
        if self.time >= self.duration {
            self.duration = 0.0;
        }
        if restart.count != self.count {
            self.begin(restart);
        }
    }

    /// Shifts the reference of this step; while nothing is shifted, it keeps its bits.
    pub fn apply(&self, reference: &mut Reference) {
        if self.duration > 0.0 {
            self.shift(reference);
        }
    }

    fn begin(&mut self, restart: &Restart) {
        let offset = self.offset() + restart.position_shift_world;
        let duration = sqrt(PEAK * sqrt(offset.length_squared()) / self.limit);
        // Not finite only for shifts beyond every range: then the reference stays.
        let duration = if duration.is_finite() { duration } else { 0.0 };
        (self.count, self.offset, self.time, self.duration) =
            (restart.count, offset, 0.0, duration);
    }

    fn shift(&self, reference: &mut Reference) {
        let (x, per) = (self.place(), 1.0 / self.duration);
        let y = x * (1.0 - x);
        let [first, second, third, fourth] = [
            140.0 * y * y * y,
            420.0 * y * y * (1.0 - 2.0 * x),
            840.0 * y * (1.0 - 5.0 * y),
            840.0 * (1.0 + x * (-12.0 + x * (30.0 - 20.0 * x))),
        ];
        reference.position_world += self.offset();
        reference.velocity_world -= self.offset * (first * per);
        reference.acceleration_world -= self.offset * (second * per * per);
        reference.jerk_world -= self.offset * (third * per * per * per);
        reference.snap_world -= self.offset * (fourth * per * per * per * per);
        // (24): b2d stays orthogonal to the direction of the thrust.
        let force = reference.acceleration_world + Vec3::new(0.0, 0.0, GRAVITY);
        let along = reference.left_world.dot(force) / force.length_squared();
        let left = reference.left_world - along * force;
        let length = left.length_squared();
        if length > 0.25 {
            reference.left_world = left / sqrt(length);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{assert, assert_eq};

    const DT: f32 = 1e-3;

    fn stepped(shift: &mut ReferenceShift, restart: &Restart) -> Reference {
        let mut reference = Reference::hover(Vec3::Y);
        shift.advance(restart, DT);
        shift.apply(&mut reference);
        reference
    }

    #[test]
    fn without_a_restart_the_reference_keeps_its_bits() {
        let mut shift = ReferenceShift::new(0.5);
        assert_eq!(stepped(&mut shift, &Restart::default()), Reference::hover(Vec3::Y));
    }

    #[test]
    fn a_restart_shifts_at_once_and_the_way_back_keeps_the_limit() {
        let mut shift = ReferenceShift::new(0.5);
        let restart = Restart { count: 1, position_shift_world: Vec3::new(3.0, 0.0, -1.0) };
        let first = stepped(&mut shift, &restart);
        assert!((first.position_world - (Vec3::Y + restart.position_shift_world)).length() < 1e-6);
        assert!(first.velocity_world.length() < 1e-6 && first.acceleration_world.length() < 1e-6);
        let (mut peak, mut before, mut ticks) = (0.0f32, first, 1);
        loop {
            let now = stepped(&mut shift, &restart);
            ticks += 1;
            // Each derivative is the slope of the one before.
            let slope = (now.position_world - before.position_world) / DT;
            let mean = 0.5 * (now.velocity_world + before.velocity_world);
            assert!((slope - mean).length() < 2e-3, "{slope} {mean}");
            let slope = (now.velocity_world - before.velocity_world) / DT;
            let mean = 0.5 * (now.acceleration_world + before.acceleration_world);
            assert!((slope - mean).length() < 2e-3, "{slope} {mean}");
            let slope = (now.acceleration_world - before.acceleration_world) / DT;
            let mean = 0.5 * (now.jerk_world + before.jerk_world);
            assert!((slope - mean).length() < 2e-3, "{slope} {mean}");
            peak = peak.max(now.acceleration_world.length());
            let force = now.acceleration_world + GRAVITY * Vec3::Z;
            assert!(now.left_world.dot(force).abs() < 1e-5);
            before = now;
            if shift.duration <= 0.0 {
                break;
            }
        }
        assert!(peak <= 0.5001 && peak > 0.49, "{peak}");
        assert!((before.position_world - Vec3::Y).length() < 1e-5);
        // sqrt(7.513 sqrt(10)/0.5).
        assert!((ticks as f32 * DT - 6.893).abs() < 0.01, "{ticks}");
        assert_eq!(stepped(&mut shift, &restart), Reference::hover(Vec3::Y));
    }

    #[test]
    fn a_restart_on_the_way_back_adds_to_what_is_left() {
        let mut shift = ReferenceShift::new(0.5);
        let first = Restart { count: 1, position_shift_world: Vec3::X };
        (0..1_500).for_each(|_| _ = stepped(&mut shift, &first));
        let mut without = shift;
        without.advance(&first, DT);
        let left = without.offset();
        assert!(left.x > 0.1 && left.x < 0.9);
        let second = Restart { count: 2, position_shift_world: Vec3::Z };
        let reference = stepped(&mut shift, &second);
        assert!((reference.position_world - (Vec3::Y + left + Vec3::Z)).length() < 1e-6);
    }
}
