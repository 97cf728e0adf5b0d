//! Frames at the rim: NED and FRD outside, ENU and FLU inside.
//!
//! ```text
//! ned = (y, x, -z)      of a world vector (x east, y north, z up)
//! frd = (x, -y, -z)     of a body vector (x forward, y left, z up)
//! q_frd_to_ned = C q_flu_to_enu X,   X half a turn about body x, C of (x, y, z) -> (y, x, -z)
//! yaw_ned = pi/2 - yaw_world
//! ```
//!
//! Global coordinates are local ones on a plane that touches the sphere at the origin.

use core::f32::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI, TAU};

use ctrl_core::trigonometry::sin_cos;
use glam::{Quat, Vec3};

/// Radius of the sphere (m): the equatorial one of WGS 84.
const EARTH_RADIUS: f32 = 6_378_137.0;
/// Length of 1e-7 degrees along a meridian (m).
const UNIT_LENGTH: f32 = EARTH_RADIUS * PI / 180.0 * 1e-7;
/// Half a turn of longitude (1e-7 deg).
const HALF_TURN: i64 = 1_800_000_000;

/// North, east and down of a world vector, and the other way round: the mapping is its own inverse.
#[must_use]
pub fn ned(world: Vec3) -> Vec3 {
    Vec3::new(world.y, world.x, -world.z)
}

/// Forward, right and down of a body vector, and the other way round.
#[must_use]
pub fn frd(body: Vec3) -> Vec3 {
    Vec3::new(body.x, -body.y, -body.z)
}

/// The attitude from FRD to NED of one from FLU to ENU.
#[must_use]
pub fn attitude_ned(attitude: Quat) -> Quat {
    // C is half a turn about the horizontal diagonal, X half a turn about x.
    let diagonal = Quat::from_xyzw(FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0, 0.0);
    let turned = diagonal * attitude * Quat::from_xyzw(1.0, 0.0, 0.0, 0.0);
    if turned.w < 0.0 { -turned } else { turned }
}

/// Roll, pitch and yaw (rad) of an attitude from FRD to NED.
#[must_use]
pub fn euler(q: Quat) -> Vec3 {
    let roll = libm::atan2f(2.0 * (q.w * q.x + q.y * q.z), 1.0 - 2.0 * (q.x * q.x + q.y * q.y));
    let sine = 2.0 * (q.w * q.y - q.z * q.x);
    let pitch = libm::asinf(sine.clamp(-1.0, 1.0));
    let yaw = libm::atan2f(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z));
    Vec3::new(roll, pitch, yaw)
}

/// A heading from north towards east (rad) of one from world x towards world y, and the other way round.
#[must_use]
pub fn yaw_ned(yaw: f32) -> f32 {
    let turned = FRAC_PI_2 - yaw;
    turned - TAU * libm::roundf(turned / TAU)
}

/// Place of the world frame's origin on the globe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Origin {
    /// Latitude (1e-7 deg).
    pub latitude: i32,
    /// Longitude (1e-7 deg).
    pub longitude: i32,
    /// Altitude above mean sea level (m).
    pub altitude: f32,
}

impl Origin {
    /// Length of 1e-7 degrees along the parallel (m).
    fn parallel_unit(&self) -> f32 {
        UNIT_LENGTH * sin_cos(self.latitude as f32 * 1e-7 * PI / 180.0).1.max(0.01)
    }

    /// Latitude, longitude (1e-7 deg) and altitude (m) of a place in the world frame.
    #[must_use]
    pub fn global(&self, world: Vec3) -> (i32, i32, f32) {
        let north = libm::roundf(world.y / UNIT_LENGTH) as i32;
        let east = libm::roundf(world.x / self.parallel_unit()) as i32;
        let (latitude, longitude) =
            (self.latitude.saturating_add(north), self.longitude.saturating_add(east));
        (latitude, longitude, self.altitude + world.z)
    }

    /// The place in the world frame (m) of latitude, longitude (1e-7 deg) and altitude (m).
    #[must_use]
    pub fn world(&self, latitude: i32, longitude: i32, altitude: f32) -> Vec3 {
        let north = i64::from(latitude) - i64::from(self.latitude);
        let east = i64::from(longitude) - i64::from(self.longitude);
        let east = (east + HALF_TURN).rem_euclid(2 * HALF_TURN) - HALF_TURN;
        let height = altitude - self.altitude;
        Vec3::new(east as f32 * self.parallel_unit(), north as f32 * UNIT_LENGTH, height)
    }
}
