//! Angles that are compared without an arc tangent; their value in radians is computed on demand.

use glam::{DQuat, DVec3};

use super::verdict::Extreme;
use crate::lanes::{LANES, Scalars, Vectors, all};
use crate::norm::Norm;

/// An angle in [0, pi] by its sine and cosine, both times the same positive number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Angle {
    sine: f64,
    cosine: f64,
}

impl Angle {
    /// Between two vectors of any length; accurate when it is small.
    #[inline]
    pub fn between(a: DVec3, b: DVec3) -> Self {
        Self { sine: a.cross(b).norm(), cosine: a.dot(b) }
    }

    /// Half the rotation angle of `error`, the same for `q` and `-q`.
    #[inline]
    pub fn half_turn(error: DQuat) -> Self {
        Self { sine: error.xyz().norm(), cosine: error.w.abs() }
    }

    /// Of `radians` in [0, pi].
    pub fn of(radians: f64) -> Self {
        Self { sine: libm::sin(radians), cosine: libm::cos(radians) }
    }

    /// `true` if it is at most `bound`, up to rounding; `false` with NaN.
    #[inline]
    pub fn is_within(self, bound: Self) -> bool {
        bound.sine * self.cosine - bound.cosine * self.sine >= 0.0 // sin(bound - self)
    }

    /// Its value (rad).
    pub fn radians(self) -> f64 {
        self.sine.atan2(self.cosine)
    }

    /// `true` if it is smaller than `other` by more than rounding; `false` with NaN.
    #[inline]
    fn is_clearly_below(self, other: Self) -> bool {
        let (ahead, behind) = (other.sine * self.cosine, other.cosine * self.sine);
        ahead - behind > 1e-12 * (ahead.abs() + behind.abs()) // sin(other - self) > 0
    }
}

/// [`Angle`] at each tick of a block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Angles {
    pub sine: Scalars,
    pub cosine: Scalars,
}

impl Angles {
    /// Between two vectors of any length; accurate when it is small.
    #[inline(always)]
    pub fn between(a: Vectors, b: Vectors) -> Self {
        Self { sine: a.cross(b).norm(), cosine: a.dot(b) }
    }
}

/// The largest of many angles.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LargestAngle {
    largest: Extreme,
    angle: Angle,
}

impl LargestAngle {
    /// Keeps `angle` at `time` (s) if it is the largest so far.
    #[inline]
    pub fn observe(&mut self, angle: Angle, time: f64) {
        if angle.is_clearly_below(self.angle) {
            return;
        }
        if self.largest.highest(angle.radians(), time) {
            self.angle = angle;
        }
    }

    /// Observes the angles in the lanes `due`, each at its `time`.
    #[inline]
    pub fn observe_block(&mut self, angles: Angles, due: u32, time: &[f64; LANES]) {
        let Angles { sine, cosine } = angles;
        // As `is_clearly_below`, which is most often true for all.
        let (ahead, behind) = (all(self.angle.sine) * cosine, all(self.angle.cosine) * sine);
        let scale = all(1e-12) * (ahead.abs() + behind.abs());
        let below = (ahead - behind).simd_gt(scale).to_bitmask();
        let open = due & !below;
        if open == 0 {
            return;
        }
        let (sine, cosine) = (sine.to_array(), cosine.to_array());
        for lane in (0..LANES).filter(|lane| open >> lane & 1 == 1) {
            self.observe(Angle { sine: sine[lane], cosine: cosine[lane] }, time[lane]);
        }
    }

    /// The largest angle, times `factor` (rad).
    pub fn extreme(self, factor: f64) -> Extreme {
        self.largest.scaled(factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_is_within_those_that_are_larger() {
        for (bound, inside, outside) in
            [(1e-6, 0.9e-6, 1.1e-6), (0.05, 0.0, 0.051), (2.0, 1.9, 3.1)]
        {
            let scaled = |x: f64| Angle { sine: 7.0 * x.sin(), cosine: 7.0 * x.cos() };
            assert!(scaled(inside).is_within(Angle::of(bound)));
            assert!(!scaled(outside).is_within(Angle::of(bound)));
        }
        assert!(!Angle { sine: f64::NAN, cosine: 1.0 }.is_within(Angle::of(1.0)));
    }

    #[test]
    fn the_largest_is_the_one_that_comparing_values_finds() {
        let mut state = 1u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1u32 << 24)
        };
        for scale in [1e-14, 1e-6, 1.0, core::f64::consts::PI] {
            let (mut clever, mut plain) = (LargestAngle::default(), Extreme::default());
            for tick in 0..2000 {
                let (length, radians) = (0.1 + random(), scale * random());
                let angle = Angle { sine: length * radians.sin(), cosine: length * radians.cos() };
                clever.observe(angle, f64::from(tick));
                plain.highest(angle.radians(), f64::from(tick));
            }
            assert_eq!(clever.extreme(1.0), plain);
        }
    }

    #[test]
    fn nan_stays() {
        let mut largest = LargestAngle::default();
        for sine in [0.5, f64::NAN, 0.7] {
            largest.observe(Angle { sine, cosine: 0.1 }, 0.0);
        }
        assert!(largest.extreme(2.0).value().unwrap().is_nan());
    }
}
