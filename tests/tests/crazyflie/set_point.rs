//! State and set-point as the firmware hands them to a controller: single precision, degrees for rates and
//! yaw, no snap.

use ctrl_core::reference::Reference;
use ctrl_core::vehicle::VehicleState;
use glam::Vec3;

/// The words that `integrations/crazyflie/test/flight.c` reads for a tick.
pub const WORDS: usize = 27;

const DEGREES_PER_RADIAN: f32 = 57.295_78;

/// State and set-point of one tick.
#[derive(Clone, Copy, Debug)]
pub struct SetPoint {
    /// As the vehicle's, but for the rate.
    pub vehicle: VehicleState,
    /// Gyroscope (deg/s).
    pub gyro: Vec3,
    /// Position and its derivatives up to the jerk.
    pub reference: Reference,
    /// Yaw (deg).
    pub yaw: f32,
    /// Yaw rate (deg/s).
    pub yaw_rate: f32,
}

impl SetPoint {
    /// Derives the set-point from a reference of the simulation.
    pub fn new(vehicle: &VehicleState, reference: &Reference) -> Self {
        let left = reference.left_world;
        let yaw = libm::atan2f(-left.x, left.y);
        let forward = Vec3::new(left.y, -left.x, 0.0);
        Self {
            vehicle: *vehicle,
            gyro: vehicle.rate_body * DEGREES_PER_RADIAN,
            reference: *reference,
            yaw: yaw * DEGREES_PER_RADIAN,
            yaw_rate: -reference.left_rate_world.dot(forward) * DEGREES_PER_RADIAN,
        }
    }

    /// In the order of `flight.c`.
    pub fn words(&self) -> [f32; WORDS] {
        let (state, set) = (&self.vehicle, &self.reference);
        let mut words = [0.0; WORDS];
        words[0..3].copy_from_slice(&state.position_world.to_array());
        words[3..6].copy_from_slice(&state.velocity_world.to_array());
        words[6..10].copy_from_slice(&state.attitude.to_array());
        words[10..13].copy_from_slice(&self.gyro.to_array());
        words[13..16].copy_from_slice(&set.position_world.to_array());
        words[16..19].copy_from_slice(&set.velocity_world.to_array());
        words[19..22].copy_from_slice(&set.acceleration_world.to_array());
        words[22..25].copy_from_slice(&set.jerk_world.to_array());
        words[25..27].copy_from_slice(&[self.yaw, self.yaw_rate]);
        words
    }
}
