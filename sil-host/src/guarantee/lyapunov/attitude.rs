//! Step 2 from the truth: desired attitude (22)-(24) and its error (27), (46).

use ctrl_core::reference::Reference;
use glam::{DMat3, DQuat, DVec3};

/// Attitudes at one tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attitude {
    /// `q_d`.
    pub desired: DQuat,
    /// `q_e`, with the sign that the law chose.
    pub error: DQuat,
}

impl Attitude {
    /// `auxiliary` is `q_a`, identity for controller 1; `chosen` is the law's own `q_e`.
    pub fn new(
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
    let r3 = alpha.normalize();
    let b3d = reference.specific_force().value.as_dvec3().normalize();
    let b2d = reference.left_world.as_dvec3();
    let r2 = (r3.dot(b3d) * b2d - r3.dot(b2d) * b3d).normalize();
    DQuat::from_mat3(&DMat3::from_cols(r2.cross(r3), r2, r3))
}

/// Rotation vector that turns `from` into `to`, in the axes of `from`, the short way [rad].
pub(super) fn turn(from: DQuat, to: DQuat) -> DVec3 {
    let between = from.inverse() * to;
    let half = between.xyz() * between.w.signum();
    let sine = half.length();
    if sine < 1e-4 {
        return half * (2.0 + sine * sine / 3.0); // asin to third order
    }
    half * (2.0 * sine.atan2(between.w.abs()) / sine)
}

#[cfg(test)]
mod tests {
    use super::*;

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
