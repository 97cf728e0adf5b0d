//! Step 2 from the truth: desired attitude (22)-(24) and its error (27), (46).

use crate::lanes::{LANES, Quaternions, Vectors, all, copysign};

/// Attitudes at each tick of a block.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Attitude {
    /// `q_d`.
    pub desired: Quaternions,
    /// `q_e`, with the sign that the law chose.
    pub error: Quaternions,
}

impl Attitude {
    /// `force` and `left` are the reference's specific force and `b2d`; `auxiliary` is `q_a`, identity for
    /// controller 1; `chosen` is the law's own `q_e`.
    pub fn new(
        alpha: Vectors,
        (force, left): (Vectors, Vectors),
        auxiliary: Quaternions,
        attitude: Quaternions,
        chosen: Quaternions,
    ) -> Self {
        let desired = desired_attitude(auxiliary.inverse() * alpha, force.unit(), left);
        let error = (auxiliary * desired).inverse() * attitude; // (27), (46)
        let aligned = error.dot(chosen).simd_ge(all(0.0));
        Self { desired, error: Quaternions::select(aligned, error, -error) }
    }
}

/// `q_d` of the desired attitude (22)-(24).
fn desired_attitude(alpha: Vectors, b3d: Vectors, b2d: Vectors) -> Quaternions {
    let r3 = alpha.unit();
    let r2 = (b2d * r3.dot(b3d) - b3d * r3.dot(b2d)).unit();
    quaternion(r2.cross(r3), r2, r3)
}

/// The quaternion of the rotation with these columns, as glam's `from_rotation_axes`.
fn quaternion(x: Vectors, y: Vectors, z: Vectors) -> Quaternions {
    // A column of 4 q q^T (x, y, z, w); the square at its pivot is at least 1.
    let down = z.z.simd_le(all(0.0));
    let rest = down.select(all(1.0) - z.z, all(1.0) + z.z);
    let other = down.select(y.y - x.x, y.y + x.x);
    let first = other.simd_le(all(0.0));
    let square = first.select(rest - other, rest + other);
    let (xy, zx, yz) = (x.y + y.x, x.z + z.x, y.z + z.y);
    let (wx, wy, wz) = (y.z - z.y, z.x - x.z, x.y - y.x);
    let choose = |down_first, down_second, up_first, up_second| {
        down.select(first.select(down_first, down_second), first.select(up_first, up_second))
    };
    let column = Quaternions {
        x: choose(square, xy, zx, wx),
        y: choose(xy, square, yz, wy),
        z: choose(zx, yz, square, wz),
        w: choose(wx, wy, wz, square),
    };
    column * (all(0.5) / square.sqrt())
}

/// Rotation vector that turns `from` into `to`, in the axes of `from`, the short way (rad).
pub(super) fn turn(from: Quaternions, to: Quaternions) -> Vectors {
    let between = from.inverse() * to;
    let half = between.xyz() * copysign(all(1.0), between.w);
    let sine = half.norm();
    let mut factor = all(2.0) + sine * sine / all(3.0); // asin to third order
    let large = sine.simd_ge(all(1e-4)).to_bitmask();
    if large != 0 {
        let (sines, cosines) = (sine.to_array(), between.w.abs().to_array());
        for lane in (0..LANES).filter(|lane| large >> lane & 1 == 1) {
            let sine = sines[lane];
            factor.as_mut_array()[lane] = 2.0 * sine.atan2(cosines[lane]) / sine;
        }
    }
    half * factor
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DQuat, DVec3};

    #[test]
    fn the_quaternion_has_the_bits_of_glam_in_every_octant() {
        for turn in 0..400 {
            let axis = DVec3::new(1.0, f64::from(turn % 7) - 3.0, f64::from(turn % 5) - 2.0);
            let matrix = DMat3::from_axis_angle(axis.normalize(), 0.1 * f64::from(turn));
            let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(Vectors::all);
            assert_eq!(quaternion(x, y, z).lane(2), DQuat::from_mat3(&matrix), "{turn}");
        }
    }

    #[test]
    fn turn_recovers_a_rotation_vector_through_both_signs() {
        let all = |q: DQuat| Quaternions::of([q; LANES]);
        let turn = |from, to| turn(all(from), all(to)).lane(1);
        let from = DQuat::from_rotation_x(0.7) * DQuat::from_rotation_z(-1.1);
        for angle in [1e-7, 1e-4, 0.3, 3.0] {
            let vector = angle * DVec3::new(1.0, -2.0, 2.0) / 3.0;
            let to = from * DQuat::from_scaled_axis(vector);
            assert!((turn(from, to) - vector).length() < 1e-12);
            assert!((turn(from, -to) - vector).length() < 1e-12);
        }
    }
}
