//! Poles: roots of the characteristic polynomial of a small matrix.

use aberth::AberthSolver;
use glam::{DMat4, DVec4};

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
/// must be zero. `order` is at most four.
#[must_use]
pub fn eigenvalues(matrix: &DMat4, order: usize) -> Vec<Pole> {
    let coefficients = characteristic_polynomial(matrix);
    let mut polynomial: Vec<f64> = coefficients[4 - order..].to_vec();
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

/// `[a0, a1, a2, a3, 1]` with `det(s I - A) = s^4 + a3 s^3 + a2 s^2 + a1 s + a0`
/// (Faddeev-LeVerrier).
fn characteristic_polynomial(a: &DMat4) -> [f64; 5] {
    let mut coefficients = [0.0, 0.0, 0.0, 0.0, 1.0];
    let mut m = DMat4::ZERO;
    for k in 1..=4 {
        m = *a * m + DMat4::from_diagonal(DVec4::splat(coefficients[5 - k]));
        coefficients[4 - k] = -trace(&(*a * m)) / k as f64;
    }
    coefficients
}

fn trace(a: &DMat4) -> f64 {
    a.x_axis.x + a.y_axis.y + a.z_axis.z + a.w_axis.w
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Block-diagonal with known roots, turned by a similarity.
    fn mixed(a: DMat4) -> DMat4 {
        let t = DMat4::from_cols_array(&[
            1.0, 0.2, -0.3, 0.4, 0.1, 1.0, 0.5, -0.2, 0.3, -0.4, 1.0, 0.1, -0.5, 0.3, 0.2, 1.0,
        ]);
        t * a * t.inverse()
    }

    #[test]
    fn known_eigenvalues_come_back() {
        // -0.3 +- 0.4i, -20, -300
        let a = DMat4::from_cols(
            DVec4::new(-0.3, -0.4, 0.0, 0.0),
            DVec4::new(0.4, -0.3, 0.0, 0.0),
            DVec4::new(0.0, 0.0, -20.0, 0.0),
            DVec4::new(0.0, 0.0, 0.0, -300.0),
        );
        let poles = eigenvalues(&mixed(a), 4);
        let expected = [(-0.3, 0.4), (-0.3, 0.4), (-20.0, 0.0), (-300.0, 0.0)];
        for (pole, (re, im)) in poles.iter().zip(expected) {
            let error = (pole.re - re).hypot(pole.im.abs() - im);
            assert!(error < 1e-8 * re.hypot(im), "{pole:?} is not {re} +- {im}i");
        }
        assert!((poles[0].damping() - 0.6).abs() < 1e-8);
    }

    #[test]
    fn lower_orders_leave_out_the_rest() {
        let a = DMat4::from_cols_array(&[
            0.0, -6.0, 0.0, 0.0, 1.0, -5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
        ]);
        let poles = eigenvalues(&a, 2);
        assert_eq!(poles.len(), 2);
        assert!((poles[0].re + 2.0).abs() < 1e-9 && (poles[1].re + 3.0).abs() < 1e-9, "{poles:?}");
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
