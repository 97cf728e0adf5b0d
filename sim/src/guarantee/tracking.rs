//! Tracking (5), (6) of the true vehicle after a settling time.

use ctrl_core::reference::Reference;
use glam::{DQuat, DVec3};

use super::GuaranteeConfig;
use super::angle::{Angle, Angles, LargestAngle};
use super::block::Block;
use super::verdict::{Extreme, Requirement, Verdict};
use crate::lanes::{Scalars, Vectors, all};

/// Position, attitude, tilt and heading error after `settle_time`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tracking {
    config: GuaranteeConfig,
    position: Extreme,
    /// Half of the angle of `q_e`; none for a controller without one.
    attitude: Option<LargestAngle>,
    tilt: LargestAngle,
    heading: LargestAngle,
}

impl Tracking {
    /// The monitor for a law of the paper, with the bounds of `config`.
    #[must_use]
    pub fn new(config: &GuaranteeConfig) -> Self {
        let attitude = Some(LargestAngle::default());
        Self { attitude, ..Self::of_any_controller(config) }
    }

    /// The monitor for a controller without an attitude error `q_e` of its own.
    #[must_use]
    pub fn of_any_controller(config: &GuaranteeConfig) -> Self {
        let none = LargestAngle::default();
        let position = Extreme::default();
        Self { config: *config, position, attitude: None, tilt: none, heading: none }
    }
}

/// Angle between body z and the thrust direction `b3d` that the reference needs (rad).
#[must_use]
pub fn tilt_error(attitude: DQuat, reference: &Reference) -> f64 {
    tilt(attitude, reference).radians()
}

/// Angle between body z and `b3d`.
pub fn tilt(attitude: DQuat, reference: &Reference) -> Angle {
    Angle::between(attitude * DVec3::Z, reference.specific_force().value.as_dvec3())
}

/// Angle between body y and the reference's `b2d` (rad).
#[must_use]
pub fn heading_error(attitude: DQuat, reference: &Reference) -> f64 {
    heading(attitude, reference).radians()
}

/// Angle between body y and `b2d`.
pub fn heading(attitude: DQuat, reference: &Reference) -> Angle {
    Angle::between(attitude * DVec3::Y, reference.left_world.as_dvec3())
}

/// Rotation angle of `error`, the same for `q` and `-q` (rad).
#[must_use]
pub fn rotation_angle(error: DQuat) -> f64 {
    2.0 * Angle::half_turn(error).radians()
}

impl Tracking {
    /// The lanes of a block whose ticks are judged.
    pub fn due(&self, block: &Block) -> u32 {
        let settled = Scalars::new(block.time).simd_ge(all(self.config.settle_time)).to_bitmask();
        settled & block.lanes()
    }

    /// Observes position, tilt and heading of the lanes `due`.
    pub fn observe(&mut self, block: &Block, due: u32) {
        if due == 0 {
            return;
        }
        let (time, reference) = (&block.time, &block.reference);
        self.position.highest_of((block.position - reference.position).norm(), due, time);
        let axis = |axis| block.attitude * Vectors::all(axis);
        let tilt = Angles::between(axis(DVec3::Z), reference.specific_force);
        self.tilt.observe_block(tilt, due, time);
        self.heading.observe_block(Angles::between(axis(DVec3::Y), reference.left), due, time);
    }

    /// Observes half the angles of `q_e` in the lanes `due`.
    pub fn observe_attitude(&mut self, block: &Block, due: u32, half: Angles) {
        if let Some(largest) = &mut self.attitude {
            largest.observe_block(half, due, &block.time);
        }
    }

    /// The rows of the table so far.
    pub fn verdicts(&self) -> Vec<Verdict> {
        let row = |name, equation, unit, bound, extreme| {
            Verdict::new((name, equation, unit), Requirement::AtMost(bound), extreme)
        };
        let config = &self.config;
        let mut rows = vec![row(
            "position error after settling",
            "(5)",
            "m",
            config.position_error_max,
            self.position,
        )];
        rows.extend(self.attitude.map(|largest| {
            let (name, bound) = ("attitude error (q_e) after settling", config.attitude_error_max);
            row(name, "(36), (53)", "rad", bound, largest.extreme(2.0))
        }));
        let (tilt, heading) = (self.tilt.extreme(1.0), self.heading.extreme(1.0));
        rows.extend([
            row("tilt error (b3, b3d) after settling", "(2)", "rad", config.tilt_error_max, tilt),
            row(
                "heading error (b2, b2d) after settling",
                "(6)",
                "rad",
                config.heading_error_max,
                heading,
            ),
        ]);
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::{FRAC_PI_2, PI};
    use glam::Vec3;

    #[test]
    fn angles_of_known_attitudes() {
        let reference = Reference::hover(Vec3::ZERO);
        for tilt in [1e-9, 0.1, 1.0, 3.0] {
            let rolled = DQuat::from_rotation_x(tilt);
            assert!((tilt_error(rolled, &reference) - tilt).abs() < 1e-12);
            assert!((heading_error(rolled, &reference) - tilt).abs() < 1e-12);
            assert!((rotation_angle(rolled) - tilt).abs() < 1e-12);
            assert!((rotation_angle(-rolled) - tilt).abs() < 1e-12);
        }
        let yawed = DQuat::from_rotation_z(FRAC_PI_2);
        assert!(tilt_error(yawed, &reference) < 1e-12);
        assert!((heading_error(yawed, &reference) - FRAC_PI_2).abs() < 1e-12);
        assert!((tilt_error(DQuat::from_rotation_y(PI), &reference) - PI).abs() < 1e-12);
    }
}
