//! Second-order time jets in `f64`: value, first and second derivative.

use std::ops::{Add, Mul, Sub};

use glam::{DMat3, DVec3};

/// A quantity with its first and second time derivative.
#[derive(Clone, Copy, Debug, Default)]
pub struct Jet<T> {
    /// The quantity.
    pub value: T,
    /// Its first time derivative.
    pub first: T,
    /// Its second time derivative.
    pub second: T,
}

/// Puts a value and its derivatives together.
pub fn jet<T>(value: T, first: T, second: T) -> Jet<T> {
    Jet { value, first, second }
}

/// `(x y)' = x' y + x y'`, `(x y)'' = x'' y + 2 x' y' + x y''` for any bilinear product.
pub fn product<X: Copy, Y: Copy, Z: Add<Output = Z>>(
    x: Jet<X>,
    y: Jet<Y>,
    times: impl Fn(X, Y) -> Z,
) -> Jet<Z> {
    jet(
        times(x.value, y.value),
        times(x.first, y.value) + times(x.value, y.first),
        times(x.second, y.value)
            + times(x.first, y.first)
            + times(x.first, y.first)
            + times(x.value, y.second),
    )
}

/// Chain rule: `outer` gives a function's value, first and second derivative at `x`.
pub fn chain(x: Jet<f64>, outer: impl Fn(f64) -> [f64; 3]) -> Jet<f64> {
    let [value, slope, curvature] = outer(x.value);
    jet(value, slope * x.first, curvature * x.first * x.first + slope * x.second)
}

/// The chain rule for each component.
pub fn chain_each(x: Jet<DVec3>, outer: impl Fn(f64) -> [f64; 3]) -> Jet<DVec3> {
    let component = |i: usize| chain(jet(x.value[i], x.first[i], x.second[i]), &outer);
    let [x, y, z] = [component(0), component(1), component(2)];
    jet(
        DVec3::new(x.value, y.value, z.value),
        DVec3::new(x.first, y.first, z.first),
        DVec3::new(x.second, y.second, z.second),
    )
}

impl<T: Add<Output = T>> Add for Jet<T> {
    type Output = Self;
    fn add(self, y: Self) -> Self {
        jet(self.value + y.value, self.first + y.first, self.second + y.second)
    }
}

impl<T: Sub<Output = T>> Sub for Jet<T> {
    type Output = Self;
    fn sub(self, y: Self) -> Self {
        jet(self.value - y.value, self.first - y.first, self.second - y.second)
    }
}

impl Mul<Jet<DVec3>> for f64 {
    type Output = Jet<DVec3>;
    fn mul(self, y: Jet<DVec3>) -> Jet<DVec3> {
        jet(self * y.value, self * y.first, self * y.second)
    }
}

impl Mul<Jet<DVec3>> for DMat3 {
    type Output = Jet<DVec3>;
    fn mul(self, y: Jet<DVec3>) -> Jet<DVec3> {
        jet(self * y.value, self * y.first, self * y.second)
    }
}

impl Mul<Jet<DVec3>> for Jet<f64> {
    type Output = Jet<DVec3>;
    fn mul(self, y: Jet<DVec3>) -> Jet<DVec3> {
        product(self, y, |x, y| x * y)
    }
}

impl Jet<f64> {
    /// `1/x`.
    #[must_use]
    pub fn recip(self) -> Self {
        chain(self, |x| [1.0 / x, -1.0 / (x * x), 2.0 / (x * x * x)])
    }

    /// Square root.
    #[must_use]
    pub fn sqrt(self) -> Self {
        chain(self, |x| [x.sqrt(), 0.5 / x.sqrt(), -0.25 / (x * x.sqrt())])
    }
}

impl Jet<DVec3> {
    /// Scalar product.
    #[must_use]
    pub fn dot(self, y: Self) -> Jet<f64> {
        product(self, y, DVec3::dot)
    }

    /// Vector product.
    #[must_use]
    pub fn cross(self, y: Self) -> Self {
        product(self, y, DVec3::cross)
    }

    /// `|x|`.
    #[must_use]
    pub fn norm(self) -> Jet<f64> {
        self.dot(self).sqrt()
    }

    /// `x/|x|`.
    #[must_use]
    pub fn unit(self) -> Self {
        self.norm().recip() * self
    }
}
