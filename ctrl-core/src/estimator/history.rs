//! Bounded memory of the last motion, against which delayed measurements are compared.
//!
//! What is kept is the motion between then and now as the prediction integrated it, never corrected:
//! a measurement from `d` ago is compared with the state of now, led back by that motion. So a correction
//! needs no walk through the memory. Displacement and gained velocity are sums in fixed point that wrap
//! around; their differences over the memory's length are exact however long the flight is.

use glam::{Quat, Vec3};

use crate::rotation::{inverse_mul, renormalised};

/// Moments kept.
pub const SLOTS: usize = 40;
/// Units per metre, and per metre per second.
const UNIT: f32 = 16_777_216.0;

/// Sums of the prediction's steps.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sums {
    displacement: [i32; 3],
    gained_velocity: [i32; 3],
    rotation: Quat,
}

impl Sums {
    /// All zero, without a rotation.
    const BLANK: Self = Self {
        displacement: [0; 3],
        gained_velocity: [0; 3],
        rotation: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0),
    };
    const ZERO: Self =
        Self { displacement: [0; 3], gained_velocity: [0; 3], rotation: Quat::IDENTITY };
}

/// Motion from a past moment to now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// World axes (m).
    pub displacement: Vec3,
    /// World axes (m/s).
    pub gained_velocity: Vec3,
    /// Takes the body axes of now to those of then.
    pub rotation: Quat,
}

impl Motion {
    /// No motion.
    pub const NONE: Self =
        Self { displacement: Vec3::ZERO, gained_velocity: Vec3::ZERO, rotation: Quat::IDENTITY };
}

/// The memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct History {
    now: Sums,
    slots: [Sums; SLOTS],
    newest: u16,
    filled: u16,
    /// Steps since the newest slot was written.
    since: u16,
}

/// `sum + x` in units of the fixed point.
#[inline(always)]
fn added(sum: [i32; 3], x: Vec3) -> [i32; 3] {
    let [x, y, z] = (x * UNIT).to_array();
    [sum[0].wrapping_add(x as i32), sum[1].wrapping_add(y as i32), sum[2].wrapping_add(z as i32)]
}

/// `a - b` as a number.
fn difference(a: [i32; 3], b: [i32; 3]) -> Vec3 {
    let of = |k: usize| a[k].wrapping_sub(b[k]) as f32 * (1.0 / UNIT);
    Vec3::new(of(0), of(1), of(2))
}

impl History {
    /// All zero: nothing is remembered before it has begun.
    pub(super) const BLANK: Self =
        Self { now: Sums::BLANK, slots: [Sums::BLANK; SLOTS], newest: 0, filled: 0, since: 0 };

    /// With the start as its only moment.
    #[cfg(test)]
    #[must_use]
    fn new() -> Self {
        let mut history = Self::BLANK;
        history.begin();
        history
    }

    /// Forgets everything: now is the only moment.
    pub(super) fn begin(&mut self) {
        let [first, ..] = &mut self.slots;
        (self.now, *first) = (Sums::ZERO, Sums::ZERO);
        (self.newest, self.filled, self.since) = (0, 1, 0);
    }

    /// Adds one step: displacement, gained velocity, rotation in body axes. Every `spacing` steps it is kept.
    #[inline(always)]
    pub fn advance(&mut self, displacement: Vec3, gained: Vec3, rotation: Quat, spacing: u16) {
        self.now.displacement = added(self.now.displacement, displacement);
        self.now.gained_velocity = added(self.now.gained_velocity, gained);
        let turned = self.now.rotation * rotation;
        self.now.rotation = renormalised(turned).unwrap_or(Quat::IDENTITY);
        self.since += 1;
        if self.since >= spacing {
            self.since = 0;
            self.newest = if usize::from(self.newest) + 1 < SLOTS { self.newest + 1 } else { 0 };
            if let Some(slot) = self.slots.get_mut(usize::from(self.newest)) {
                *slot = self.now;
            }
            self.filled = (self.filled + 1).min(SLOTS as u16);
        }
    }

    /// Motion over the last `steps` steps, linear between slots `spacing` apart; over the oldest slot's age
    /// when that is shorter.
    #[must_use]
    pub fn motion(&self, steps: f32, spacing: u16) -> Motion {
        if steps.is_nan() || steps <= 0.0 || self.filled == 0 {
            return Motion::NONE;
        }
        let back = (steps - f32::from(self.since)) / f32::from(spacing.max(1));
        if back < 0.0 {
            let part = steps / f32::from(self.since.max(1));
            return blend(Motion::NONE, self.since_slot(0), part);
        }
        let last = f32::from(self.filled - 1);
        let back = if back < last { back } else { last };
        let whole = back as u16;
        let next = (whole + 1).min(self.filled - 1);
        blend(self.since_slot(whole), self.since_slot(next), back - f32::from(whole))
    }

    /// Motion since the slot `back` before the newest.
    fn since_slot(&self, back: u16) -> Motion {
        let (newest, back) = (usize::from(self.newest), usize::from(back));
        let index =
            if newest >= back { newest - back } else { (newest + SLOTS).saturating_sub(back) };
        let Some(slot) = self.slots.get(index) else { return Motion::NONE };
        Motion {
            displacement: difference(self.now.displacement, slot.displacement),
            gained_velocity: difference(self.now.gained_velocity, slot.gained_velocity),
            rotation: inverse_mul(self.now.rotation, slot.rotation),
        }
    }
}

/// `part` of the way from `a` to `b`.
fn blend(a: Motion, b: Motion, part: f32) -> Motion {
    let far = if a.rotation.dot(b.rotation) < 0.0 { -b.rotation } else { b.rotation };
    let between = a.rotation * (1.0 - part) + far * part;
    Motion {
        displacement: a.displacement + part * (b.displacement - a.displacement),
        gained_velocity: a.gained_velocity + part * (b.gained_velocity - a.gained_velocity),
        rotation: renormalised(between).unwrap_or(b.rotation),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::assert;

    #[test]
    fn motion_is_that_of_the_last_steps_after_any_time() {
        let mut history = History::new();
        let (step, gain) = (Vec3::new(0.01, -0.02, 0.005), Vec3::new(0.0, 1e-3, -2e-3));
        let turn = renormalised(Quat::from_xyzw(0.0, 0.0, 0.001, 1.0)).unwrap_or(Quat::IDENTITY);
        // Long enough to wrap the displacement around dozens of times.
        for _ in 0..300_003 {
            history.advance(step, gain, turn, 5);
        }
        for steps in [1.0, 2.5, 7.0, 100.3, 190.0] {
            let motion = history.motion(steps, 5);
            assert!((motion.displacement - steps * step).length() < 1e-4, "{motion:?}");
            assert!((motion.gained_velocity - steps * gain).length() < 1e-5);
            let half_angle = libm::atanf(0.001) * steps;
            assert!((motion.rotation.z + libm::sinf(half_angle)).abs() < 1e-4);
        }
    }

    #[test]
    fn motion_reaches_no_further_back_than_the_memory() {
        let mut history = History::new();
        assert_eq!(history.motion(3.0, 5), Motion::NONE);
        for _ in 0..400 {
            history.advance(0.5 * Vec3::X, Vec3::ZERO, Quat::IDENTITY, 5);
        }
        assert_eq!(history.motion(1e9, 5).displacement.x, 0.5 * 195.0);
        assert_eq!(history.motion(f32::NAN, 5), Motion::NONE);
        assert_eq!(history.motion(-1.0, 5), Motion::NONE);
    }
}
