//! Vectors and matrices of a loop's states: a fixed size that holds the largest loop, zero beyond a loop's order.

use core::ops::{Add, Index, IndexMut, Mul, Neg, Sub};

use num_complex::Complex64;

/// Most states of a loop: position, velocity, tilt, rate and two estimates of integral action.
pub const STATES: usize = 6;

/// A state, or a row that multiplies one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vector(pub [f64; STATES]);

/// Rows of a linear map of states.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Matrix(pub [Vector; STATES]);

impl Vector {
    /// Zero.
    pub const ZERO: Self = Self([0.0; STATES]);

    /// The unit vector of state `i`.
    #[must_use]
    pub fn unit(i: usize) -> Self {
        let mut unit = Self::ZERO;
        unit[i] = 1.0;
        unit
    }

    /// Scalar product.
    #[must_use]
    pub fn dot(self, other: Self) -> f64 {
        (0..STATES).map(|i| self[i] * other[i]).sum()
    }
}

impl Vector {
    /// Response of this output, where those of the states are `responses`.
    #[must_use]
    pub fn through(self, responses: &[Complex64; STATES]) -> Complex64 {
        self.0.iter().zip(responses).map(|(gain, response)| gain * response).sum()
    }
}

impl Matrix {
    /// Identity.
    #[must_use]
    pub fn identity() -> Self {
        Self(core::array::from_fn(Vector::unit))
    }

    /// The map `x -> column (row . x)`.
    #[must_use]
    pub fn outer(column: Vector, row: Vector) -> Self {
        Self(column.0.map(|element| element * row))
    }

    /// Sum of the diagonal.
    #[must_use]
    pub fn trace(&self) -> f64 {
        (0..STATES).map(|i| self.0[i][i]).sum()
    }
}

impl Index<usize> for Vector {
    type Output = f64;

    fn index(&self, i: usize) -> &f64 {
        &self.0[i]
    }
}

impl IndexMut<usize> for Vector {
    fn index_mut(&mut self, i: usize) -> &mut f64 {
        &mut self.0[i]
    }
}

impl Add for Vector {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(core::array::from_fn(|i| self[i] + other[i]))
    }
}

impl Sub for Vector {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self(core::array::from_fn(|i| self[i] - other[i]))
    }
}

impl Neg for Vector {
    type Output = Self;

    fn neg(self) -> Self {
        -1.0 * self
    }
}

impl Mul<Vector> for f64 {
    type Output = Vector;

    fn mul(self, x: Vector) -> Vector {
        Vector(x.0.map(|element| self * element))
    }
}

impl Add for Matrix {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(core::array::from_fn(|i| self.0[i] + other.0[i]))
    }
}

impl Sub for Matrix {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self(core::array::from_fn(|i| self.0[i] - other.0[i]))
    }
}

impl Mul<Matrix> for f64 {
    type Output = Matrix;

    fn mul(self, a: Matrix) -> Matrix {
        Matrix(a.0.map(|row| self * row))
    }
}

impl Mul<Vector> for Matrix {
    type Output = Vector;

    fn mul(self, x: Vector) -> Vector {
        Vector(self.0.map(|row| row.dot(x)))
    }
}

impl Mul for Matrix {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let row =
            |left: Vector| (0..STATES).fold(Vector::ZERO, |sum, k| sum + left[k] * other.0[k]);
        Self(self.0.map(row))
    }
}
