//! Step 2 from the truth: desired attitude (22)-(24) and its error (27), (46).

use ctrl_core::reference::Reference;
use glam::{DQuat, DVec3, DVec4};

use crate::evaluation::Attitude;
use crate::norm::Norm;

impl Attitude {
    /// `auxiliary` is `q_a`, identity for controller 1; `chosen` is the law's own `q_e`.
    pub(super) fn new(
        alpha: DVec3,
        reference: &Reference,
        auxiliary: DQuat,
        attitude: DQuat,
        chosen: DQuat,
    ) -> Self {
        let desired = desired_attitude(auxiliary.inverse() * alpha, reference);
        let error = (auxiliary * desired).inverse() * attitude; // (27), (46)
        let aligned = error.dot(chosen) >= 0.0;
        Self { desired, error: if aligned { error } else { -error } }
    }
}

/// `q_d` of the desired attitude (22)-(24).
fn desired_attitude(alpha: DVec3, reference: &Reference) -> DQuat {
    let r3 = alpha.unit();
    let b3d = reference.specific_force().value.as_dvec3().unit();
    let b2d = reference.left_world.as_dvec3();
    let r2 = (r3.dot(b3d) * b2d - r3.dot(b2d) * b3d).unit();
    quaternion(r2.cross(r3), r2, r3)
}

/// The quaternion of the rotation with these columns. Like glam's `from_rotation_axes`, but for the
/// root: see [`Norm`].
fn quaternion(x: DVec3, y: DVec3, z: DVec3) -> DQuat {
    // A column of 4 q q^T (x, y, z, w); the square at its pivot is at least 1.
    let (column, pivot) = if z.z <= 0.0 {
        let (rest, difference) = (1.0 - z.z, y.y - x.x);
        if difference <= 0.0 {
            let square = rest - difference;
            (DVec4::new(square, x.y + y.x, x.z + z.x, y.z - z.y), square)
        } else {
            let square = rest + difference;
            (DVec4::new(x.y + y.x, square, y.z + z.y, z.x - x.z), square)
        }
    } else {
        let (rest, sum) = (1.0 + z.z, y.y + x.x);
        if sum <= 0.0 {
            let square = rest - sum;
            (DVec4::new(x.z + z.x, y.z + z.y, square, x.y - y.x), square)
        } else {
            let square = rest + sum;
            (DVec4::new(y.z - z.y, z.x - x.z, x.y - y.x, square), square)
        }
    };
    DQuat::from_vec4(column * (0.5 / pivot.sqrt()))
}

/// Rotation vector that turns `from` into `to`, in the axes of `from`, the short way (rad).
pub(super) fn turn(from: DQuat, to: DQuat) -> DVec3 {
    let between = from.inverse() * to;
    let half = between.xyz() * between.w.signum();
    let sine = half.norm();
    if sine < 1e-4 {
        return half * (2.0 + sine * sine / 3.0); // asin to third order
    }
    half * (2.0 * sine.atan2(between.w.abs()) / sine)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    #[test]
    fn the_quaternion_has_the_bits_of_glam_in_every_octant() {
        for turn in 0..400 {
            let axis = DVec3::new(1.0, f64::from(turn % 7) - 3.0, f64::from(turn % 5) - 2.0);
            let matrix = DMat3::from_axis_angle(axis.normalize(), 0.1 * f64::from(turn));
            let got = quaternion(matrix.x_axis, matrix.y_axis, matrix.z_axis);
            assert_eq!(got, DQuat::from_mat3(&matrix), "{turn}");
        }
    }

    #[test]
    fn turn_recovers_a_rotation_vector_through_both_signs() {
        let from = DQuat::from_rotation_x(0.7) * DQuat::from_rotation_z(-1.1);
        for angle in [1e-7, 1e-4, 0.3, 3.0] {
            let vector = angle * DVec3::new(1.0, -2.0, 2.0) / 3.0;
            let to = from * DQuat::from_scaled_axis(vector);
            assert!((turn(from, to) - vector).length() < 1e-12);
            assert!((turn(from, -to) - vector).length() < 1e-12);
        }
    }
}
