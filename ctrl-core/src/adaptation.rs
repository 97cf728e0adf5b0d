//! Estimates of unknown constants: projected onto a known set, accumulated with compensation.
//!
//! In continuous time the projection stops an estimate at the border of its set; in discrete time
//! the same is: integrate, then clamp. One step changes an estimate by far less than one unit in
//! the last place of an `f32`, so the rounding of each sum is carried over to the next (Kahan).

use core::ops::{Add, Sub};

use glam::Vec3;

/// A number or a vector that can be clamped element-wise.
pub trait Projected: Copy + Default + PartialEq + Add<Output = Self> + Sub<Output = Self> {
    /// `true` if an element is beyond `[-1, 1]`.
    fn is_beyond_one(self) -> bool;

    /// Clamps each element to its interval of `[lower, upper]`; where that changes it, `carry` becomes
    /// zero. Returns `true` if it changed any.
    fn project(&mut self, lower: Self, upper: Self, carry: &mut Self) -> bool;
}

impl Projected for f32 {
    #[inline(always)]
    fn is_beyond_one(self) -> bool {
        self.abs() > 1.0
    }

    #[inline(always)]
    fn project(&mut self, lower: f32, upper: f32, carry: &mut Self) -> bool {
        let border = if *self < lower {
            lower
        } else if *self > upper {
            upper
        } else {
            return false;
        };
        (*self, *carry) = (border, 0.0);
        true
    }
}

impl Projected for Vec3 {
    #[inline(always)]
    fn is_beyond_one(self) -> bool {
        self.x.is_beyond_one() || self.y.is_beyond_one() || self.z.is_beyond_one()
    }

    #[inline(always)]
    fn project(&mut self, lower: Self, upper: Self, carry: &mut Self) -> bool {
        let x = self.x.project(lower.x, upper.x, &mut carry.x);
        let y = self.y.project(lower.y, upper.y, &mut carry.y);
        let z = self.z.project(lower.z, upper.z, &mut carry.z);
        x | y | z
    }
}

/// An estimate with the rounding error that its last sum left out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate<T> {
    value: T,
    /// Rounding error in `value`, subtracted from the next increment.
    excess: T,
}

impl<T: Projected> Estimate<T> {
    /// Starts at `value`, which the caller has checked to be inside the set.
    #[must_use]
    pub fn new(value: T) -> Self {
        Self { value, excess: T::default() }
    }

    /// The estimate itself.
    #[inline(always)]
    #[must_use]
    pub fn value(&self) -> T {
        self.value
    }

    /// Adds `increment` and projects onto `[lower, upper]`; returns `true` if the projection acted.
    #[inline(always)]
    pub fn advance(&mut self, increment: T, lower: T, upper: T) -> bool {
        self.add(increment);
        self.value.project(lower, upper, &mut self.excess)
    }

    /// [`advance`](Self::advance) onto `[-one, one]`, the vector of ones: one comparison an element.
    #[inline(always)]
    pub fn advance_within_one(&mut self, increment: T, one: T) -> bool {
        self.add(increment);
        self.value.is_beyond_one() && self.value.project(T::default() - one, one, &mut self.excess)
    }

    #[inline(always)]
    fn add(&mut self, increment: T) {
        let wanted = increment - self.excess;
        let sum = self.value + wanted;
        self.excess = (sum - self.value) - wanted;
        self.value = sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::assert;

    #[test]
    fn a_million_increments_below_one_ulp_add_up() {
        let mut plain = 1.0_f32;
        let mut estimate = Estimate::new(1.0_f32);
        for _ in 0..1_000_000 {
            plain += 2e-8;
            assert!(!estimate.advance(2e-8, 0.0, 2.0));
        }
        assert_eq!(plain, 1.0, "a plain sum loses every increment");
        assert!((estimate.value() - 1.02).abs() < 2e-7, "{}", estimate.value());
    }

    #[test]
    fn the_projection_holds_the_border_and_lets_go_at_once() {
        let mut estimate = Estimate::new(Vec3::splat(0.5));
        for _ in 0..10 {
            estimate.advance(Vec3::new(0.3, -0.3, 1e-9), Vec3::ZERO, Vec3::ONE);
        }
        assert_eq!(estimate.value(), Vec3::new(1.0, 0.0, 0.5));
        assert!(!estimate.advance(Vec3::new(-0.25, 0.25, 0.0), Vec3::ZERO, Vec3::ONE));
        assert_eq!(estimate.value(), Vec3::new(0.75, 0.25, 0.5));
    }

    #[test]
    fn each_element_has_an_interval_of_its_own() {
        let mut estimate = Estimate::new(Vec3::splat(0.5));
        let (lower, upper) = (Vec3::new(0.0, 0.4, 0.0), Vec3::new(1.0, 1.0, 0.6));
        assert!(estimate.advance(Vec3::new(0.3, -0.3, 0.3), lower, upper));
        assert_eq!(estimate.value(), Vec3::new(0.8, 0.4, 0.6));
    }
}
