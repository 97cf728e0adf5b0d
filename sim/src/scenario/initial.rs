//! Initial state of the vehicle. Angles are in degrees here and nowhere further in.

use glam::{DQuat, DVec3};
use serde::Deserialize;

use crate::plant::PlantState;

/// State of the vehicle at the first tick.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InitialCondition {
    /// Position of the centre of mass in the world frame (m).
    pub position: DVec3,
    /// Velocity of the centre of mass in the world frame (m/s).
    pub velocity: DVec3,
    /// Angular velocity in body axes (rad/s).
    pub rate_body: DVec3,
    /// Angle of body x from world x about world z, before tilting (deg).
    pub heading_deg: f64,
    /// Angle between body z and world z, 0 to 180 (deg).
    pub tilt_deg: f64,
    /// Horizontal direction to which body z leans, from world x about world z (deg).
    pub tilt_direction_deg: f64,
}

impl InitialCondition {
    /// The plant's state: turned to the heading, then tilted about a horizontal world axis.
    #[must_use]
    pub fn state(&self) -> PlantState {
        let direction = self.tilt_direction_deg.to_radians();
        let axis = DVec3::new(-libm::sin(direction), libm::cos(direction), 0.0);
        let tilt = rotation(axis, self.tilt_deg.to_radians());
        let heading = rotation(DVec3::Z, self.heading_deg.to_radians());
        PlantState {
            position_world: self.position,
            velocity_world: self.velocity,
            attitude: tilt * heading,
            rate_body: self.rate_body,
        }
    }
}

/// Rotation by `angle` (rad) about a unit `axis`.
fn rotation(axis: DVec3, angle: f64) -> DQuat {
    let vector = axis * libm::sin(0.5 * angle);
    DQuat::from_xyzw(vector.x, vector.y, vector.z, libm::cos(0.5 * angle))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start(heading_deg: f64, tilt_deg: f64, tilt_direction_deg: f64) -> DQuat {
        let [position, velocity, rate_body] = [DVec3::ZERO; 3];
        InitialCondition {
            position,
            velocity,
            rate_body,
            heading_deg,
            tilt_deg,
            tilt_direction_deg,
        }
        .state()
        .attitude
    }

    #[test]
    fn heading_turns_body_x() {
        assert!((start(90.0, 0.0, 0.0) * DVec3::X - DVec3::Y).length() < 1e-15);
        assert!((start(180.0, 0.0, 0.0) * DVec3::Y + DVec3::Y).length() < 1e-15);
    }

    #[test]
    fn tilt_leans_the_thrust_to_its_direction_whatever_the_heading() {
        for heading in [0.0, 70.0, -120.0] {
            let up = start(heading, 30.0, 90.0) * DVec3::Z;
            assert!((up - DVec3::new(0.0, 0.5, 0.75f64.sqrt())).length() < 1e-15, "{up}");
        }
        assert!((start(0.0, 160.0, 10.0) * DVec3::Z).z < -0.93);
    }
}
