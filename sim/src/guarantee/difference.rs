//! Bounds of a quantity and of its change between two states, carried through the operations of a law.
//!
//! [`Change`] stands for any number, vector (2-norm), matrix (operator norm) or diagonal matrix (largest entry) `y(x)`: `size` bounds `|y|` at
//! both states, `change` bounds `|y(x) - y(x^)|`. Each operation is the Lipschitz rule of the operation that it is named after, so
//! that a chain of them bounds a chain of the law's.

use core::ops::{Add, Mul};

/// See the module's documentation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Change {
    /// Bound of the quantity at either state.
    pub size: f64,
    /// Bound of its change from one to the other.
    pub change: f64,
}

impl Change {
    pub const fn new(size: f64, change: f64) -> Self {
        Self { size, change }
    }

    /// A quantity of which only its size is known, the same at both states.
    pub const fn fixed(size: f64) -> Self {
        Self::new(size, 0.0)
    }

    /// No change exceeds twice the size.
    pub fn within_its_size(self) -> Self {
        Self { change: self.change.min(2.0 * self.size), ..self }
    }

    /// Length of a vector with orthogonal parts `self` and `other`.
    pub fn beside(self, other: Self) -> Self {
        Self::new(self.size.hypot(other.size), self.change.hypot(other.change))
    }
}

impl Add for Change {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.size + other.size, self.change + other.change)
    }
}

/// Products of any kind whose norm is at most that of the factors: numbers, scalar, cross and element-wise products, matrices.
impl Mul for Change {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self::new(self.size * other.size, self.size * other.change + self.change * other.size)
    }
}

impl Mul<Change> for f64 {
    type Output = Change;
    fn mul(self, other: Change) -> Change {
        Change::new(self * other.size, self * other.change)
    }
}

/// `sqrt(3)`: length of a vector over its largest component.
pub(super) const ROOT_OF_THREE: f64 = 1.732_050_807_568_877_2;

/// `M tanh(x)` of each component with its first and second derivatives; `largest` bounds the components of `x`, `change` the length
/// of its change.
pub(super) fn saturation(m: f64, largest: f64, change: f64) -> [Change; 3] {
    // |tanh''| <= 4/(3 sqrt(3)) < 0.7699, |tanh'''| <= 2.
    let value = ROOT_OF_THREE * m * libm::tanh(largest);
    [
        Change::new(value, m * change).within_its_size(),
        Change::new(m, (0.7699 * m * change).min(m)),
        Change::new(0.7699 * m, 2.0 * m * change).within_its_size(),
    ]
}

/// `h(x, delta)` of each component with its first and second derivatives.
pub(super) fn smooth_sign(x: Change, delta: f64) -> [Change; 3] {
    // |h''| <= 48/(25 sqrt(5)) < 0.8587 over delta^2, |h'''| <= 3 over delta^3.
    let value = (x.size / delta).min(ROOT_OF_THREE);
    let (first, second) = (1.0 / delta, 0.8587 / (delta * delta));
    [
        Change::new(value, x.change / delta).within_its_size(),
        Change::new(first, (second * x.change).min(first)),
        Change::new(second, 3.0 * x.change / (delta * delta * delta)).within_its_size(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every pair of points keeps the bounds of values and derivatives.
    #[test]
    fn curves_keep_their_bounds_over_all_pairs_of_points() {
        let points: Vec<f64> = (-60..=60).map(|i| f64::from(i) * 0.05).collect();
        let tanh = |x: f64| {
            let (t, c) = (libm::tanh(x), libm::cosh(x).powi(-2));
            [1.3 * t, 1.3 * c, -2.6 * t * c]
        };
        let delta = 0.4;
        let sign = |x: f64| {
            let r = (x * x + delta * delta).sqrt();
            let d2 = delta * delta;
            [x / r, d2 / r.powi(3), -3.0 * d2 * x / r.powi(5)]
        };
        for &x in &points {
            for &y in &points {
                let (largest, change) = (x.abs().max(y.abs()), (x - y).abs());
                let bounds = saturation(1.3, largest, change);
                let signs = smooth_sign(Change::new(largest, change), delta);
                for (function, bounds) in [(tanh(x), bounds), (sign(x), signs)]
                    .into_iter()
                    .zip([tanh(y), sign(y)])
                    .map(|((a, bounds), b)| ((a, b), bounds))
                {
                    let (a, b) = function;
                    for i in 0..3 {
                        assert!(a[i].abs() <= bounds[i].size * (1.0 + 1e-9), "{x} {y} {i}");
                        assert!(
                            (a[i] - b[i]).abs() <= bounds[i].change * (1.0 + 1e-9) + 1e-12,
                            "{x} {y} {i}"
                        );
                    }
                }
            }
        }
    }
}
