//! Second-order time jets: a quantity with its first and second time derivative.
//!
//! A [`Jet`] goes through arithmetic like the number it stands for; product and chain rules keep
//! the derivatives exact, so nothing is ever differentiated numerically:
//!
//! ```text
//! (x y)'  = x' y + x y'             (1/x)' = -x'/x^2
//! (x y)'' = x'' y + 2 x' y' + x y'' |x|'   = (x . x')/|x|
//! ```

use core::ops::{Add, Mul, Neg, Sub};

use glam::Vec3;

use crate::sqrt::sqrt;

/// A value with its first and second derivative with respect to time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jet<T> {
    /// The quantity itself.
    pub value: T,
    /// First time derivative (1/s).
    pub first: T,
    /// Second time derivative (1/s^2).
    pub second: T,
}

impl<T> Jet<T> {
    /// Puts a value and its two derivatives together.
    #[inline(always)]
    pub const fn new(value: T, first: T, second: T) -> Self {
        Self { value, first, second }
    }
}

impl<T: Default> Jet<T> {
    /// A quantity that does not change.
    #[inline(always)]
    pub fn constant(value: T) -> Self {
        Self { value, first: T::default(), second: T::default() }
    }
}

impl<T: Add<Output = T>> Add for Jet<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, y: Self) -> Self {
        Self::new(self.value + y.value, self.first + y.first, self.second + y.second)
    }
}

impl<T: Sub<Output = T>> Sub for Jet<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, y: Self) -> Self {
        Self::new(self.value - y.value, self.first - y.first, self.second - y.second)
    }
}

impl<T: Neg<Output = T>> Neg for Jet<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.value, -self.first, -self.second)
    }
}

/// The product rule, for any bilinear product of `x` and `y`.
#[inline(always)]
fn product<X: Copy, Y: Copy, Z>(x: Jet<X>, y: Jet<Y>, times: impl Fn(X, Y) -> Z) -> Jet<Z>
where
    Z: Add<Output = Z> + Copy,
{
    let cross = times(x.first, y.first);
    Jet::new(
        times(x.value, y.value),
        times(x.first, y.value) + times(x.value, y.first),
        times(x.second, y.value) + cross + cross + times(x.value, y.second),
    )
}

impl Mul for Jet<f32> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, y: Self) -> Self {
        product(self, y, |x, y| x * y)
    }
}

impl Mul<Jet<Vec3>> for Jet<f32> {
    type Output = Jet<Vec3>;
    #[inline(always)]
    fn mul(self, y: Jet<Vec3>) -> Jet<Vec3> {
        product(self, y, |x, y| x * y)
    }
}

impl Jet<f32> {
    /// `1/x`; the caller sees to `x != 0`.
    #[inline(always)]
    #[must_use]
    pub fn recip(self) -> Self {
        let inverse = 1.0 / self.value;
        let rate = self.first * inverse;
        Self::new(inverse, -rate * inverse, (2.0 * rate * rate - self.second * inverse) * inverse)
    }
}

impl Jet<Vec3> {
    /// Scalar product `x . y`.
    #[inline(always)]
    #[must_use]
    pub fn dot(self, y: Self) -> Jet<f32> {
        product(self, y, Vec3::dot)
    }

    /// Vector product `x × y`, term by term: each is multiplied into the sum.
    #[inline(always)]
    #[must_use]
    pub fn cross(self, y: Self) -> Self {
        let (x, twice) = (self, self.first + self.first);
        let first = |i: usize, j: usize| {
            (x.first[i] * y.value[j] - x.first[j] * y.value[i]) + x.value[i] * y.first[j]
                - x.value[j] * y.first[i]
        };
        let second = |i: usize, j: usize| {
            (x.second[i] * y.value[j] - x.second[j] * y.value[i]) + twice[i] * y.first[j]
                - twice[j] * y.first[i]
                + x.value[i] * y.second[j]
                - x.value[j] * y.second[i]
        };
        Self::new(
            x.value.cross(y.value),
            Vec3::new(first(1, 2), first(2, 0), first(0, 1)),
            Vec3::new(second(1, 2), second(2, 0), second(0, 1)),
        )
    }

    /// Euclidean norm `|x|`; the caller sees to `x != 0`.
    #[inline(always)]
    #[must_use]
    pub fn norm(self) -> Jet<f32> {
        let norm = sqrt(self.value.length_squared());
        let first = self.value.dot(self.first) / norm;
        let second =
            (self.first.length_squared() + self.value.dot(self.second) - first * first) / norm;
        Jet::new(norm, first, second)
    }

    /// Unit vector `x/|x|`; the caller sees to `x != 0`.
    #[inline(always)]
    #[must_use]
    pub fn unit(self) -> Self {
        self.norm().recip() * self
    }
}
