//! Limits of thrust and torque.

use ctrl_core::vehicle::Wrench;
use glam::{DVec3, Vec3};

/// Limits of thrust and torque. They are kept in `f32`, so that a command at a limit of the same number
/// is not beyond it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Most thrust; the least is zero. None: unlimited, also below zero (N).
    pub thrust_max: Option<f32>,
    /// Most torque about each body axis, either way round (N m).
    pub torque_max: Option<Vec3>,
}

impl Limits {
    /// None where neither is limited; both positive.
    pub(super) fn new(thrust_max: Option<f64>, torque_max: Option<DVec3>) -> Option<Self> {
        let limited = thrust_max.is_some() || torque_max.is_some();
        limited.then(|| Self {
            thrust_max: thrust_max.map(|limit| limit as f32),
            torque_max: torque_max.map(|limits| limits.as_vec3()),
        })
    }

    /// The nearest wrench that the rotors can give, each component by itself.
    #[must_use]
    pub fn clip(&self, command: &Wrench) -> Wrench {
        let torque = command.torque_body;
        Wrench {
            thrust: self.thrust_max.map_or(command.thrust, |max| command.thrust.clamp(0.0, max)),
            torque_body: self.torque_max.map_or(torque, |max| torque.clamp(-max, max)),
        }
    }

    /// `true` if the command is beyond the limits.
    #[must_use]
    pub fn cuts(&self, command: &Wrench) -> bool {
        self.clip(command) != *command
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_component_is_clipped_by_itself_and_what_is_possible_stays() {
        let limits = Limits::new(Some(12.0), Some(DVec3::new(0.05, 0.05, 0.03))).unwrap();
        let wrench = |thrust, x, y, z| Wrench { thrust, torque_body: Vec3::new(x, y, z) };
        let clipped = limits.clip(&wrench(13.0, 0.2, -0.04, -0.06));
        assert_eq!(clipped, wrench(12.0, 0.05, -0.04, -0.03));
        assert_eq!(limits.clip(&wrench(-1.0, 0.0, 0.0, 0.0)).thrust, 0.0);
        assert!(!limits.cuts(&wrench(12.0, 0.05, -0.05, 0.0)));
        assert!(limits.cuts(&wrench(12.0, 0.05, -0.05, 0.030_000_1)));
    }

    #[test]
    fn one_limit_leaves_the_other_component_alone() {
        let torque_only = Limits::new(None, Some(DVec3::splat(0.05))).unwrap();
        let command = Wrench { thrust: -100.0, torque_body: Vec3::ONE };
        assert_eq!(torque_only.clip(&command).thrust, -100.0);
        let thrust_only = Limits::new(Some(1.0), None).unwrap();
        assert_eq!(thrust_only.clip(&command).torque_body, Vec3::ONE);
        assert_eq!(Limits::new(None, None), None);
    }
}
