//! Rotations. The conventions, stated once:
//!
//! - World frame: right-handed, z up (ENU). Body frame: forward, left, up; thrust along body +z.
//! - An attitude `q` (or its matrix `R(q)`) takes body to world coordinates: `x_world = R x_body`.
//! - Quaternions multiply as Hamilton's (`i j = k`), so `R(p ⊗ q) = R(p) R(q)`. In the equations the
//!   scalar comes first, `q = [eta, eps]`; [`glam::Quat`] stores `(x, y, z, w) = (eps, eta)`.
//! - Body rates are in body axes, and `q' = 1/2 q ⊗ [0, w] = 1/2 A(q) w` (9).
//! - `q` and `-q` are the same attitude; [`nearest_sign`] keeps an error quaternion continuous.

use glam::{Mat3, Quat, Vec3};

use crate::sqrt::sqrt;

/// `R^T x`: world to body coordinates.
#[inline(always)]
#[must_use]
pub fn transpose_mul(r: &Mat3, x: Vec3) -> Vec3 {
    Vec3::new(r.x_axis.dot(x), r.y_axis.dot(x), r.z_axis.dot(x))
}

/// `eps`, the vector part of `q`.
#[inline(always)]
#[must_use]
pub fn vector_part(q: Quat) -> Vec3 {
    Vec3::new(q.x, q.y, q.z)
}

/// `q^-1 ⊗ p` of unit quaternions, written out.
#[inline(always)]
#[must_use]
pub fn inverse_mul(q: Quat, p: Quat) -> Quat {
    let (qe, pe) = (vector_part(q), vector_part(p));
    let eps = q.w * pe - p.w * qe - qe.cross(pe);
    Quat::from_xyzw(eps.x, eps.y, eps.z, q.w * p.w + qe.dot(pe))
}

/// `R(q) x`, without forming the matrix: cheaper for one or two vectors.
#[inline(always)]
#[must_use]
pub fn rotate(q: Quat, x: Vec3) -> Vec3 {
    let eps = vector_part(q);
    let twice = 2.0 * eps.cross(x);
    x + q.w * twice + eps.cross(twice)
}

/// `R(q)^T x`, without forming the matrix.
#[inline(always)]
#[must_use]
pub fn rotate_back(q: Quat, x: Vec3) -> Vec3 {
    let eps = vector_part(q);
    let twice = 2.0 * eps.cross(x);
    x - q.w * twice + eps.cross(twice)
}

/// `q' = 1/2 A(q) w` (9), returned as the rates of `(eta, eps)`.
#[inline(always)]
#[must_use]
pub fn quaternion_rate(q: Quat, rate_body: Vec3) -> (f32, Vec3) {
    let eps = vector_part(q);
    let half = 0.5 * rate_body;
    (-eps.dot(half), q.w * half + eps.cross(half))
}

/// A quaternion near unit length brought back to it; `None` unless `0.25 <= |q|^2 <= 4`.
///
/// Within 1e-3 of unit length one Newton step of `1/sqrt` is exact to f32 rounding (its error is
/// `3/8 (|q|^2 - 1)^2 < 4e-7`) and leaves a unit quaternion as it is, to the bit.
#[inline(always)]
#[must_use]
pub fn renormalised(q: Quat) -> Option<Quat> {
    brought_to_unit(q).map(|(q, _)| q)
}

/// [`renormalised`], and `true` if `q` was within 1e-3 of unit length.
#[inline(always)]
pub(crate) fn brought_to_unit(q: Quat) -> Option<(Quat, bool)> {
    let excess = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0;
    if excess.abs() <= 1e-3 {
        return Some((q * (1.0 - 0.5 * excess), true));
    }
    (-0.75..=3.0).contains(&excess).then(|| (q * (1.0 / sqrt(1.0 + excess)), false))
}

/// The unit quaternion of the matrix whose columns are the orthonormal `r` (either sign).
///
/// Divides by the largest component of the quaternion, which is at least 1/2.
#[inline(always)]
#[must_use]
pub fn from_axes(r: &Mat3) -> Quat {
    let (r1, r2, r3) = (r.x_axis, r.y_axis, r.z_axis);
    // Components of 4 q q^T: a row of it, divided by its length, is +-q.
    let (wx, wy, wz) = (r2.z - r3.y, r3.x - r1.z, r1.y - r2.x);
    let (xy, xz, yz) = (r2.x + r1.y, r3.x + r1.z, r3.y + r2.z);
    let (sum, difference) = (r1.x + r2.y, r1.x - r2.y);
    let row = if r3.z >= 0.0 {
        if sum >= 0.0 {
            let ww = 1.0 + r3.z + sum;
            (wx, wy, wz, ww, ww)
        } else {
            let zz = 1.0 + r3.z - sum;
            (xz, yz, zz, wz, zz)
        }
    } else if difference >= 0.0 {
        let xx = 1.0 - r3.z + difference;
        (xx, xy, xz, wx, xx)
    } else {
        let yy = 1.0 - r3.z - difference;
        (xy, yy, yz, wy, yy)
    };
    let (x, y, z, w, largest) = row;
    let scale = 0.5 / sqrt(largest);
    Quat::from_xyzw(x * scale, y * scale, z * scale, w * scale)
}

/// Below this scalar part the attitude error changes sign, to turn the short way round.
pub const UNWINDING_THRESHOLD: f32 = -0.2;

/// The sign of `q_e` that continues `previous`; `true` when it was then flipped because the scalar
/// part had fallen below [`UNWINDING_THRESHOLD`]: `-q_e` is the shorter way to the same attitude,
/// and the hysteresis keeps noise at half a turn from flipping it back and forth.
#[inline(always)]
#[must_use]
pub fn nearest_sign(q_e: Quat, previous: Quat) -> (Quat, bool) {
    let along = q_e.x * previous.x + q_e.y * previous.y + q_e.z * previous.z + q_e.w * previous.w;
    let scalar = if along < 0.0 { -q_e.w } else { q_e.w };
    let unwound = scalar < UNWINDING_THRESHOLD;
    (if (along < 0.0) != unwound { -q_e } else { q_e }, unwound)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::assert;

    fn sample(i: u32) -> Quat {
        let mut bits = u64::from(i).wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        let mut next = || {
            bits ^= bits << 13;
            bits ^= bits >> 7;
            bits ^= bits << 17;
            (bits >> 40) as f32 / 16_777_216.0 * 2.0 - 1.0
        };
        let q = Quat::from_xyzw(next(), next(), next(), next());
        q * (1.0 / sqrt(q.dot(q)))
    }

    #[test]
    fn quaternion_and_axes_agree_in_every_branch() {
        let half_turns = [Quat::from_xyzw(1.0, 0.0, 0.0, 0.0), Quat::from_xyzw(0.0, 1.0, 0.0, 0.0)];
        let more = [Quat::from_xyzw(0.0, 0.0, 1.0, 0.0), Quat::IDENTITY];
        for q in (1..2000).map(sample).chain(half_turns).chain(more) {
            let back = from_axes(&Mat3::from_quat(q));
            assert!((back.dot(q).abs() - 1.0).abs() < 1e-6, "{q} became {back}");
        }
    }

    #[test]
    fn inverse_mul_is_the_relative_rotation() {
        for i in 1..500 {
            let (q, p) = (sample(i), sample(i + 7919));
            let expected = q.conjugate() * p;
            assert!((inverse_mul(q, p) - expected).length_squared() < 1e-12);
        }
    }

    #[test]
    fn rotating_by_quaternion_and_by_matrix_agree() {
        for i in 1..500 {
            let (q, x) = (sample(i), vector_part(sample(i + 3571)) * 5.0);
            let r = Mat3::from_quat(q);
            assert!((rotate(q, x) - r * x).length_squared() < 1e-11);
            assert!((rotate_back(q, x) - transpose_mul(&r, x)).length_squared() < 1e-11);
        }
    }

    #[test]
    fn renormalising_leaves_unit_quaternions_and_refuses_hopeless_ones() {
        assert_eq!(renormalised(Quat::IDENTITY), Some(Quat::IDENTITY));
        for i in 1..500 {
            for factor in [0.6, 0.9999, 1.0003, 1.9] {
                let q = renormalised(sample(i) * factor).unwrap();
                assert!((q.dot(q) - 1.0).abs() < 1e-6);
            }
        }
        assert_eq!(renormalised(Quat::from_xyzw(0.0, 0.0, 0.0, 0.4)), None);
        assert_eq!(renormalised(Quat::from_xyzw(0.0, f32::NAN, 0.0, 1.0)), None);
        assert_eq!(renormalised(Quat::from_xyzw(f32::INFINITY, 0.0, 0.0, 1.0)), None);
    }

    #[test]
    fn the_sign_follows_the_previous_one_until_the_short_way_is_the_other() {
        let near = |w: f32| Quat::from_xyzw(sqrt(1.0 - w * w), 0.0, 0.0, w);
        assert_eq!(nearest_sign(-near(0.5), near(0.4)), (near(0.5), false));
        assert_eq!(nearest_sign(near(-0.1), near(0.1)), (near(-0.1), false));
        assert_eq!(nearest_sign(near(-0.3), near(-0.1)), (-near(-0.3), true));
    }
}
