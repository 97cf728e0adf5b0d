//! Frame of the vehicle: the places of its rotors.

use ctrl_core::allocation::{MAX_ROTORS, Rotor, RotorGeometry, Spin};
use ctrl_core::list::List;
use ctrl_core::vehicle::Interval;
use serde::{Deserialize, Serialize};

/// Rotors of a vehicle, in the order of the outputs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Frame {
    /// Equal rotors evenly on a circle.
    Ring(Ring),
    /// Each rotor by itself.
    Rotors(List<Rotor, MAX_ROTORS>),
}

/// Equal rotors evenly on a circle about the centre of mass, anticlockwise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ring {
    /// Direction of rotation of each, seen from above; 4 to 8.
    pub spins: List<Spin, MAX_ROTORS>,
    /// Distance from the centre of mass (m).
    pub arm: f32,
    /// Angle of the first rotor from body x towards body y (deg).
    pub first_angle_deg: f32,
    /// Reaction torque for each newton of thrust (m).
    pub torque_ratio: f32,
    /// Idle and largest thrust of each (N).
    pub thrust: Interval,
}

impl Frame {
    /// The geometry that allocation takes.
    #[must_use]
    pub fn geometry(&self) -> RotorGeometry {
        match self {
            Self::Ring(Ring { spins, arm, first_angle_deg, torque_ratio, thrust }) => {
                let first_angle = first_angle_deg.to_radians();
                RotorGeometry::ring(spins, *arm, first_angle, *torque_ratio, *thrust)
            }
            Self::Rotors(rotors) => RotorGeometry { rotors: *rotors },
        }
    }
}
