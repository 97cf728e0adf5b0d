//! Conversion to PX4's frames: world north-east-down (NED), body forward-right-down (FRD).
//!
//! Ours are east-north-up (ENU) and forward-left-up (FLU); see [`ctrl_core::rotation`].

use core::f64::consts::FRAC_1_SQRT_2;

use glam::{DQuat, DVec3};

/// World coordinates: ENU to NED. Its own inverse.
#[must_use]
pub fn ned(enu: DVec3) -> DVec3 {
    DVec3::new(enu.y, enu.x, -enu.z)
}

/// Body coordinates: FLU to FRD. Its own inverse.
#[must_use]
pub fn frd(flu: DVec3) -> DVec3 {
    DVec3::new(flu.x, -flu.y, -flu.z)
}

/// Attitude: FLU to ENU becomes FRD to NED.
///
/// Both changes of axes are half turns, about `(1, 1, 0)` in the world and about x in the body:
/// `(i + j)/sqrt(2) q i`, up to sign, is
///
/// ```text
/// [w + z, x + y, x - y, w - z]/sqrt(2)
/// ```
#[must_use]
pub fn ned_from_frd(q: DQuat) -> DQuat {
    DQuat::from_xyzw(q.x + q.y, q.x - q.y, q.w - q.z, q.w + q.z) * FRAC_1_SQRT_2
}

/// Heading of an attitude in NED: from north, positive towards east (rad).
#[must_use]
pub fn yaw(ned_from_frd: DQuat) -> f64 {
    let DQuat { x, y, z, w } = ned_from_frd;
    (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z))
}

#[cfg(test)]
mod tests {
    use core::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    fn assert_same(a: DQuat, b: DQuat) {
        assert!((a.dot(b).abs() - 1.0).abs() < 1e-15, "{a} {b}");
    }

    fn attitudes() -> impl Iterator<Item = DQuat> {
        let parts = [-0.9, -0.3, 0.0, 0.2, 0.8];
        let pairs = parts.into_iter().flat_map(move |a| parts.map(|b| (a, b)));
        pairs.flat_map(move |(a, b)| parts.map(|c| DQuat::from_xyzw(a, b, c, 0.7 - a).normalize()))
    }

    #[test]
    fn a_vector_is_the_same_by_either_way_round() {
        let body = DVec3::new(0.3, -1.7, 2.9);
        for q in attitudes() {
            let there = ned(q * body);
            let around = ned_from_frd(q) * frd(body);
            assert!((there - around).length() < 1e-14, "{q}: {there} {around}");
        }
    }

    #[test]
    fn converting_twice_gives_back_what_was() {
        let x = DVec3::new(1.0, 2.0, 3.0);
        assert_eq!((ned(ned(x)), frd(frd(x))), (x, x));
        for q in attitudes() {
            assert_same(ned_from_frd(ned_from_frd(q)), q);
        }
    }

    #[test]
    fn level_facing_east_is_a_yaw_of_a_quarter_turn() {
        let q = ned_from_frd(DQuat::IDENTITY);
        assert_same(q, DQuat::from_rotation_z(FRAC_PI_2));
        assert!((yaw(q) - FRAC_PI_2).abs() < 1e-15);
    }

    #[test]
    fn turning_left_lowers_the_yaw() {
        for (heading, expected) in [(FRAC_PI_2, 0.0), (0.3, FRAC_PI_2 - 0.3), (-FRAC_PI_2, PI)] {
            let q = ned_from_frd(DQuat::from_rotation_z(heading));
            assert!((yaw(q) - expected).abs() < 1e-15, "{heading}");
        }
    }

    #[test]
    fn leaning_forward_is_a_negative_pitch() {
        // Facing north, nose 0.2 rad down: about body left by +0.2, about body right by -0.2.
        let q = DQuat::from_rotation_z(FRAC_PI_2) * DQuat::from_rotation_y(0.2);
        assert_same(ned_from_frd(q), DQuat::from_rotation_y(-0.2));
        let thrust = ned_from_frd(q) * DVec3::NEG_Z;
        assert!(thrust.x > 0.19 && thrust.y.abs() < 1e-15 && thrust.z < -0.97, "{thrust}");
    }

    #[test]
    fn rolling_right_is_a_positive_roll() {
        let q = DQuat::from_rotation_z(FRAC_PI_2) * DQuat::from_rotation_x(0.2);
        assert_same(ned_from_frd(q), DQuat::from_rotation_x(0.2));
    }
}
