//! Poles: roots of the characteristic polynomial of a small matrix.

use super::linear::{Matrix, STATES};
use aberth::AberthSolver;

/// A pole of a closed loop in continuous time (1/s); its conjugate is a pole, too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pole {
    /// Real part (1/s), negative where the mode decays.
    pub re: f64,
    /// Imaginary part (rad/s).
    pub im: f64,
}

impl Pole {
    /// Distance from the origin: the natural frequency (rad/s).
    #[must_use]
    pub fn modulus(self) -> f64 {
        self.re.hypot(self.im)
    }

    /// Damping ratio: 1 for a real stable pole, 0 on the imaginary axis, negative when it grows.
    #[must_use]
    pub fn damping(self) -> f64 {
        if self.modulus() > 0.0 { -self.re / self.modulus() } else { 0.0 }
    }

    /// `s` from a root of the sampled loop in the form `(z - 1)/dt`: `s = ln(z)/dt`.
    #[must_use]
    pub fn from_difference(root: Self, dt: f64) -> Self {
        let (x, y) = (dt * root.re, dt * root.im);
        // ln|1 + x + iy| keeps its digits for small steps.
        Self { re: 0.5 * libm::log1p(2.0 * x + x * x + y * y) / dt, im: y.atan2(1.0 + x) / dt }
    }

    /// `|z|` of the sampled loop.
    #[must_use]
    pub fn sampled_modulus(self, dt: f64) -> f64 {
        (self.re * dt).exp()
    }
}

/// Eigenvalues of the leading `order` rows and columns of `matrix`, slowest first; the rest of it
/// must be zero.
#[must_use]
pub fn eigenvalues(matrix: &Matrix, order: usize) -> Vec<Pole> {
    let coefficients = characteristic_polynomial(matrix);
    let mut polynomial: Vec<f64> = coefficients[STATES - order..].to_vec();
    // In units of the geometric mean of the moduli all coefficients are of order one.
    let unit = polynomial[0].abs().powf(1.0 / order as f64);
    let unit = if unit > 0.0 { unit } else { 1.0 };
    for (power, coefficient) in polynomial.iter_mut().enumerate() {
        *coefficient /= unit.powi((order - power) as i32);
    }
    let mut solver = AberthSolver::new();
    solver.epsilon = 1e-13;
    solver.max_iterations = 200;
    let roots = solver.find_roots(&polynomial);
    let mut poles: Vec<_> =
        roots.iter().map(|root| Pole { re: unit * root.re, im: unit * root.im }).collect();
    poles.sort_by(|a, b| a.modulus().total_cmp(&b.modulus()));
    poles
}

/// `[a0, a1, ..., 1]` with `det(s I - A) = s^n + ... + a1 s + a0` (Faddeev-LeVerrier).
fn characteristic_polynomial(a: &Matrix) -> [f64; STATES + 1] {
    let mut coefficients = [0.0; STATES + 1];
    coefficients[STATES] = 1.0;
    let mut m = Matrix::default();
    for k in 1..=STATES {
        m = *a * m + coefficients[STATES + 1 - k] * Matrix::identity();
        coefficients[STATES - k] = -(*a * m).trace() / k as f64;
    }
    coefficients
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::tune::linear::Vector;

    /// Companion matrix of `(s - r)(s - ...)`.
    fn companion(roots: &[f64]) -> Matrix {
        let mut polynomial = vec![1.0];
        for root in roots {
            let shifted: Vec<_> = [0.0].into_iter().chain(polynomial.iter().copied()).collect();
            let scaled = polynomial.iter().map(|it| -root * it).chain([0.0]);
            polynomial = shifted.iter().zip(scaled).map(|(a, b)| a + b).collect();
        }
        let order = roots.len();
        let mut a = Matrix::default();
        for i in 0..order - 1 {
            a.0[i] = Vector::unit(i + 1);
        }
        for (i, coefficient) in polynomial.iter().take(order).enumerate() {
            a.0[order - 1][i] = -coefficient;
        }
        a
    }

    /// Loops of the largest order with slow estimates and fast rates keep the five digits that are shown.
    #[test]
    fn known_eigenvalues_come_back() {
        let roots = [-0.05, -0.3, -0.8, -4.0, -20.0, -300.0];
        let poles = eigenvalues(&companion(&roots), 6);
        for (pole, root) in poles.iter().zip(roots) {
            let error = (pole.re - root).hypot(pole.im);
            assert!(error < 1e-5 * root.abs(), "{pole:?} is not {root}");
        }
    }

    #[test]
    fn lower_orders_leave_out_the_rest() {
        // -0.3 +- 0.4i
        let mut a = Matrix::default();
        (a.0[0], a.0[1]) = (Vector::unit(1), -0.25 * Vector::unit(0) - 0.6 * Vector::unit(1));
        let poles = eigenvalues(&a, 2);
        assert_eq!(poles.len(), 2);
        for pole in poles {
            assert!((pole.re + 0.3).abs() < 1e-9 && (pole.im.abs() - 0.4).abs() < 1e-9, "{pole:?}");
            assert!((pole.damping() - 0.6).abs() < 1e-8);
        }
    }

    #[test]
    fn a_sampled_pole_is_the_logarithm_of_z() {
        let dt = 1e-3;
        for s in [Pole { re: -0.5, im: 0.0 }, Pole { re: -3.0, im: 40.0 }] {
            let z = (s.re * dt).exp();
            let (x, y) = (z * (s.im * dt).cos(), z * (s.im * dt).sin());
            let back = Pole::from_difference(Pole { re: (x - 1.0) / dt, im: y / dt }, dt);
            assert!((back.re - s.re).hypot(back.im - s.im) < 1e-9, "{back:?}");
            assert!((back.sampled_modulus(dt) - z).abs() < 1e-12);
        }
    }
}
