//! Quaternions, scalar first, and rotation matrices, both taking body to world.

use glam::{DMat3, DVec3};
use serde::Deserialize;

/// `q = [eta, eps]`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(from = "[f64; 4]")]
pub struct Quaternion {
    /// Scalar part.
    pub eta: f64,
    /// Vector part.
    pub eps: DVec3,
}

impl From<[f64; 4]> for Quaternion {
    fn from([eta, x, y, z]: [f64; 4]) -> Self {
        Self { eta, eps: DVec3::new(x, y, z) }
    }
}

/// `S(x)`: `S(x) y = x × y`.
#[must_use]
pub fn skew(x: DVec3) -> DMat3 {
    DMat3::from_cols(
        DVec3::new(0.0, x.z, -x.y),
        DVec3::new(-x.z, 0.0, x.x),
        DVec3::new(x.y, -x.x, 0.0),
    )
}

/// `vee(m)`: the `x` of `S(x)` nearest to `m`, from its antisymmetric part.
#[must_use]
pub fn vee(m: DMat3) -> DVec3 {
    let [a, b, c] = [m.x_axis, m.y_axis, m.z_axis]; // columns: m_ij is column j, component i
    0.5 * DVec3::new(b.z - c.y, c.x - a.z, a.y - b.x)
}

impl Quaternion {
    /// No rotation.
    pub const IDENTITY: Self = Self { eta: 1.0, eps: DVec3::ZERO };

    /// Components, scalar first.
    #[must_use]
    pub fn to_array(self) -> [f64; 4] {
        [self.eta, self.eps.x, self.eps.y, self.eps.z]
    }

    /// `self (x) q`: first `q`, then `self`.
    #[must_use]
    pub fn times(self, q: Self) -> Self {
        Self {
            eta: self.eta * q.eta - self.eps.dot(q.eps),
            eps: self.eta * q.eps + q.eta * self.eps + self.eps.cross(q.eps),
        }
    }

    /// `q^-1` of a unit quaternion.
    #[must_use]
    pub fn inverse(self) -> Self {
        Self { eta: self.eta, eps: -self.eps }
    }

    /// `-q`, the same rotation.
    #[must_use]
    pub fn negated(self) -> Self {
        Self { eta: -self.eta, eps: -self.eps }
    }

    /// Scalar product of the four components.
    #[must_use]
    pub fn dot(self, q: Self) -> f64 {
        self.eta * q.eta + self.eps.dot(q.eps)
    }

    /// Unit quaternion of the same direction.
    #[must_use]
    pub fn normalised(self) -> Self {
        let norm = self.dot(self).sqrt();
        Self { eta: self.eta / norm, eps: self.eps / norm }
    }

    /// `R = I + 2 eta S(eps) + 2 S(eps)^2`.
    #[must_use]
    pub fn matrix(self) -> DMat3 {
        let s = skew(self.eps);
        DMat3::IDENTITY + s * (2.0 * self.eta) + s * s * 2.0
    }

    /// `1/2 A(q) x`: the quaternion's rate when it turns at `x` in its own axes.
    #[must_use]
    pub fn rate(self, x: DVec3) -> Self {
        Self {
            eta: -0.5 * self.eps.dot(x),
            eps: 0.5 * ((DMat3::from_diagonal(DVec3::splat(self.eta)) + skew(self.eps)) * x),
        }
    }

    /// The rotation matrix's quaternion, from its largest component (Shepperd), either sign.
    #[must_use]
    pub fn from_matrix(r: DMat3) -> Self {
        let (a, b, c) = (r.x_axis, r.y_axis, r.z_axis);
        let four_squares = [
            1.0 + a.x + b.y + c.z,
            1.0 + a.x - b.y - c.z,
            1.0 - a.x + b.y - c.z,
            1.0 - a.x - b.y + c.z,
        ];
        let largest = (0..4).fold(0, |i, j| if four_squares[j] > four_squares[i] { j } else { i });
        let products = match largest {
            0 => [four_squares[0], b.z - c.y, c.x - a.z, a.y - b.x],
            1 => [b.z - c.y, four_squares[1], a.y + b.x, a.z + c.x],
            2 => [c.x - a.z, a.y + b.x, four_squares[2], b.z + c.y],
            _ => [a.y - b.x, a.z + c.x, b.z + c.y, four_squares[3]],
        };
        Self::from(products).normalised()
    }

    /// `(eta I + S(eps))^T`, the factor of (31), (49).
    #[must_use]
    pub fn coupling(self) -> DMat3 {
        (DMat3::from_diagonal(DVec3::splat(self.eta)) + skew(self.eps)).transpose()
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::{Quaternion, skew, vee};
    use crate::tolerance::Tolerance;

    const EXACT: Tolerance = Tolerance { absolute: 1e-15, relative: 1e-15 };

    fn some() -> [Quaternion; 4] {
        [[1.0, 2.0, -3.0, 0.5], [-1e-3, 1.0, 0.0, 0.2], [0.1, -0.3, 4.0, 0.2], [0.0, 0.1, 0.2, 0.9]]
            .map(|q| Quaternion::from(q).normalised())
    }

    #[test]
    fn matrix_and_quaternion_agree() {
        for p in some() {
            for q in some() {
                let product = p.times(q).matrix();
                EXACT.check(
                    "R(p q)",
                    &product.to_cols_array(),
                    &(p.matrix() * q.matrix()).to_cols_array(),
                );
            }
            let back = Quaternion::from_matrix(p.matrix());
            let back = if back.dot(p) < 0.0 { back.negated() } else { back };
            EXACT.check("q", &back.to_array(), &p.to_array());
        }
    }

    #[test]
    fn vee_undoes_skew_and_skew_is_the_cross_product() {
        let (x, y) = (DVec3::new(1.0, -2.0, 0.3), DVec3::new(0.2, 5.0, -1.0));
        assert_eq!(vee(skew(x)), x);
        assert_eq!(skew(x) * y, x.cross(y));
    }

    #[test]
    fn turns_at_the_rate_it_is_given() {
        let (w, dt) = (DVec3::new(0.3, -0.2, 0.9), 1e-6);
        for q in some() {
            let rate = q.rate(w);
            let ahead = Quaternion { eta: q.eta + dt * rate.eta, eps: q.eps + dt * rate.eps };
            let turn: DMat3 = q.matrix().transpose() * ahead.normalised().matrix();
            Tolerance { absolute: 0.0, relative: 2e-9 }.check(
                "w",
                &(vee(turn) / dt).to_array(),
                &w.to_array(),
            );
        }
    }
}
