//! Flat ground under a vehicle: it stands until its thrust lifts it, and stays where it touches down.
//!
//! The contact is rigid and does not slide: what sinks below the ground is put at rest on it, level, with its
//! heading. There is no bounce, and a crash is a landing; [`GroundedVehicle::touchdown_speed`] tells them apart.

use crate::norm::Norm;
use ctrl_core::vehicle::Wrench;
use glam::{DQuat, DVec3, Vec3};

use super::rotors::BatteryState;
use super::vehicle::{Plant, Vehicle};
use super::{AppliedWrench, Disturbance, PlantState};

/// A [`Vehicle`] over ground at a height.
#[derive(Clone, Debug)]
pub struct GroundedVehicle {
    vehicle: Vehicle,
    /// Height of the centre of mass when the vehicle stands (m).
    ground: f64,
    /// `true` while it stands.
    stands: bool,
    touchdown_speed: f64,
}

impl GroundedVehicle {
    /// `vehicle` over the height `ground` (m) at which its centre of mass stands.
    #[must_use]
    pub fn new(mut vehicle: Vehicle, ground: f64) -> Self {
        let truth = *vehicle.truth();
        let stands = truth.position_world.z <= ground;
        if stands {
            vehicle.place(at_rest(&truth, ground));
        }
        Self { vehicle, ground, stands, touchdown_speed: 0.0 }
    }

    /// Returns `true` while the vehicle stands on the ground.
    #[must_use]
    pub fn stands(&self) -> bool {
        self.stands
    }

    /// The vehicle.
    #[must_use]
    pub fn vehicle(&self) -> &Vehicle {
        &self.vehicle
    }

    /// The vehicle, to command it by the thrusts of its rotors.
    pub fn vehicle_mut(&mut self) -> &mut Vehicle {
        &mut self.vehicle
    }

    /// Length of the velocity at the latest touchdown (m/s).
    #[must_use]
    pub fn touchdown_speed(&self) -> f64 {
        self.touchdown_speed
    }
}

impl Plant for GroundedVehicle {
    fn truth(&self) -> &PlantState {
        self.vehicle.truth()
    }

    fn command(&mut self, wrench: &Wrench) -> AppliedWrench {
        self.vehicle.command(wrench)
    }

    fn tells_law(&self) -> bool {
        self.vehicle.tells_law()
    }

    fn made(&self, command: &Wrench) -> Vec3 {
        self.vehicle.made(command)
    }

    fn add_drag(&self, held: &mut Disturbance) {
        self.vehicle.add_drag(held);
    }

    fn battery(&self) -> Option<BatteryState> {
        self.vehicle.battery()
    }

    fn advance(&mut self, disturbance: &Disturbance) {
        self.vehicle.advance(disturbance);
        let truth = *self.vehicle.truth();
        if truth.position_world.z > self.ground {
            self.stands = false;
            return;
        }
        if !self.stands {
            self.touchdown_speed = truth.velocity_world.norm();
        }
        self.stands = true;
        self.vehicle.place(at_rest(&truth, self.ground));
    }
}

/// At rest on the ground, level, with the heading of `truth`.
fn at_rest(truth: &PlantState, ground: f64) -> PlantState {
    let forward = truth.attitude * DVec3::X;
    let level = DVec3::new(forward.x, forward.y, 0.0);
    // Nose up or down: any heading will do.
    let half =
        0.5 * if level.length_squared() > 1e-12 { libm::atan2(level.y, level.x) } else { 0.0 };
    PlantState {
        position_world: truth.position_world.with_z(ground),
        velocity_world: DVec3::ZERO,
        attitude: DQuat::from_xyzw(0.0, 0.0, libm::sin(half), libm::cos(half)),
        rate_body: DVec3::ZERO,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::PlantParameters;
    use crate::plant::rigid_body::RigidBody;

    const PARAMETERS: PlantParameters = PlantParameters::new(1.0, DVec3::new(0.05, 0.05, 0.1));

    fn vehicle(height: f64) -> GroundedVehicle {
        let body = RigidBody::new(&PARAMETERS, 1e-3, 1);
        let truth = PlantState {
            position_world: DVec3::new(1.0, 2.0, height),
            velocity_world: DVec3::ZERO,
            attitude: DQuat::from_rotation_z(0.7),
            rate_body: DVec3::ZERO,
        };
        GroundedVehicle::new(Vehicle::new(body, None, truth), 0.0)
    }

    fn fly(vehicle: &mut GroundedVehicle, thrust: f32, ticks: u32) {
        for _ in 0..ticks {
            vehicle.command(&Wrench { thrust, ..Wrench::default() });
            vehicle.advance(&Disturbance::default());
        }
    }

    #[test]
    fn stands_until_the_thrust_exceeds_the_weight() {
        let mut vehicle = vehicle(0.0);
        let start = *vehicle.truth();
        for thrust in [0.0, 5.0, 9.8] {
            fly(&mut vehicle, thrust, 500);
            assert!(vehicle.stands());
            assert_eq!(vehicle.truth().position_world, start.position_world);
        }
        fly(&mut vehicle, 10.0, 500);
        assert!(!vehicle.stands() && vehicle.truth().position_world.z > 0.01);
    }

    #[test]
    fn falls_and_stays_where_it_touches_down_with_its_heading() {
        let mut vehicle = vehicle(1.0);
        fly(&mut vehicle, 0.0, 1000);
        let truth = vehicle.truth();
        assert_eq!(truth.position_world, DVec3::new(1.0, 2.0, 0.0));
        assert_eq!(truth.velocity_world, DVec3::ZERO);
        assert!(
            (truth.attitude * DVec3::X - DVec3::new(0.7f64.cos(), 0.7f64.sin(), 0.0)).length()
                < 1e-9
        );
        let expected = (2.0 * 9.81f64).sqrt();
        assert!((vehicle.touchdown_speed() - expected).abs() < 0.01);
    }
}
