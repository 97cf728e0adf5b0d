//! Flat ground under a vehicle: it stands until its thrust lifts it, lands on its feet or as it falls, slides and tumbles.
//!
//! [`contact`](super::contact) has the forces; while nothing touches they are absent, and the flight has the bits of one without ground.

use crate::norm::Norm;
use ctrl_core::vehicle::Wrench;
use glam::{DQuat, DVec3, Vec3};

use super::contact::Contact;
use super::rotors::BatteryState;
use super::vehicle::{Plant, Vehicle};
use super::{AppliedWrench, Disturbance, PlantState};

/// Speed (m/s) and rate (rad/s) below which a vehicle that touches the ground is at rest ...
const REST: [f64; 2] = [0.05, 0.2];
/// ... after this time (s).
const REST_TIME: f64 = 0.1;
/// Time without contact after which the next contact is a touchdown, not a bounce (s).
const AIRBORNE_TIME: f64 = 0.3;

/// A [`Vehicle`] over ground at a height.
#[derive(Clone, Debug)]
pub struct GroundedVehicle {
    vehicle: Vehicle,
    contact: Contact,
    /// Time at rest on the ground, and in the air (s).
    at_rest: f64,
    in_air: f64,
    touchdown_speed: f64,
}

impl GroundedVehicle {
    /// `vehicle` on or over the ground of `contact`, whose forces are held for as long as the vehicle moves at a time.
    #[must_use]
    pub fn new(mut vehicle: Vehicle, mut contact: Contact) -> Self {
        let truth = *vehicle.truth();
        let stands = truth.position_world.z <= contact.ground();
        if stands {
            vehicle.place(standing(&truth, contact.ground()));
        }
        contact.push(vehicle.truth());
        let at_rest = if stands { REST_TIME } else { 0.0 };
        Self { vehicle, contact, at_rest, in_air: 0.0, touchdown_speed: 0.0 }
    }

    /// Returns `true` while the vehicle is at rest on the ground, on its feet or otherwise.
    #[must_use]
    pub fn stands(&self) -> bool {
        self.at_rest >= REST_TIME
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

    /// Length of the velocity at the latest touchdown (m/s); what bounces touches down once.
    #[must_use]
    pub fn touchdown_speed(&self) -> f64 {
        self.touchdown_speed
    }

    /// Takes note of contact and rest during the tick that begins.
    fn judge(&mut self, touches: bool) {
        let PlantState { velocity_world, rate_body, .. } = *self.vehicle.truth();
        if touches && self.in_air >= AIRBORNE_TIME {
            self.touchdown_speed = velocity_world.norm();
        }
        self.in_air = if touches { 0.0 } else { self.in_air + self.contact.step_period() };
        let rests = touches && velocity_world.norm() < REST[0] && rate_body.norm() < REST[1];
        self.at_rest = if rests { self.at_rest + self.contact.step_period() } else { 0.0 };
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
        let push = self.contact.push(self.vehicle.truth());
        self.judge(push.is_some());
        let Some(push) = push else { return self.vehicle.advance(disturbance) };
        self.vehicle.advance(&Disturbance {
            acceleration_world: disturbance.acceleration_world + push.acceleration_world,
            torque_body: disturbance.torque_body + push.torque_body,
            wind_world: disturbance.wind_world,
        });
    }
}

/// At rest on the ground, level, with the heading of `truth`.
fn standing(truth: &PlantState, ground: f64) -> PlantState {
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
#[path = "ground/tests.rs"]
mod tests;
