//! The simulated vehicle: truth in `f64`, from which the controller's `f32` state is rounded.
//!
//! One file per physical effect: [`rigid_body`] dynamics, [`disturbance`]s, the [`actuation`] between
//! commanded and applied wrench, the [`rotors`] that make it, and [`contact`] with the
//! [`ground`]. `docs/plant.md` gives the equations.

pub mod actuation;
mod components;
pub mod contact;
pub mod disturbance;
pub mod ground;
pub mod rigid_body;
pub mod rotors;
pub mod vehicle;

use ctrl_core::vehicle::VehicleState;
use glam::{DQuat, DVec3};

/// Truth of the vehicle at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantState {
    /// `p`: position of the centre of mass in the world frame (m).
    pub position_world: DVec3,
    /// `v`: velocity of the centre of mass in the world frame (m/s).
    pub velocity_world: DVec3,
    /// `q`: unit quaternion that takes body to world coordinates.
    pub attitude: DQuat,
    /// `w`: angular velocity in body axes (rad/s).
    pub rate_body: DVec3,
}

impl PlantState {
    /// The state that the controller receives: the truth, rounded to `f32`.
    #[inline]
    #[must_use]
    pub fn measured(&self) -> VehicleState {
        VehicleState {
            position_world: self.position_world.as_vec3(),
            velocity_world: self.velocity_world.as_vec3(),
            attitude: self.attitude.as_quat(),
            rate_body: self.rate_body.as_vec3(),
        }
    }
}

/// True parameters of the vehicle, unknown to the controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantParameters {
    /// `m`: mass (kg).
    pub mass: f64,
    /// `J`: principal moments of inertia (kg m^2).
    pub inertia: DVec3,
    /// `d_c`, `t_c`: the part of the disturbance that lasts and is what the integral action estimates.
    /// It is for the monitors; what acts on the vehicle is the flight's disturbance.
    pub lasting: Disturbance,
}

impl PlantParameters {
    /// A vehicle under no lasting disturbance that an integral action estimates.
    #[must_use]
    pub const fn new(mass: f64, inertia: DVec3) -> Self {
        Self { mass, inertia, lasting: Disturbance::NONE }
    }
}

/// Thrust and torque that act on the vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AppliedWrench {
    /// Thrust along body z (N).
    pub thrust: f64,
    /// Torque in body axes (N m).
    pub torque_body: DVec3,
}

/// Disturbance of the vehicle, held over one control tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disturbance {
    /// `d1`: acceleration in the world frame (m/s^2).
    pub acceleration_world: DVec3,
    /// `d2`: torque in body axes (N m).
    pub torque_body: DVec3,
    /// Velocity of the air in the world frame, which a rotor's drag is relative to (m/s).
    pub wind_world: DVec3,
}

impl Disturbance {
    /// None, in still air.
    pub const NONE: Self =
        Self { acceleration_world: DVec3::ZERO, torque_body: DVec3::ZERO, wind_world: DVec3::ZERO };
}
