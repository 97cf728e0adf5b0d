//! Contact of a vehicle with flat ground: a spring, a damper and dry friction at each of its points.
//!
//! A point at depth `d > 0` below the surface, moving with the velocity `v`, is pushed by
//!
//! ```text
//! N = max(0, k d - c v_z)                                    upwards: the ground never pulls
//! T = -k (x - a) - c v_xy,   |T| <= mu N                     along the ground
//! ```
//!
//! `a` is where the point sticks: where it touched first, and dragged along behind it while the friction is at its limit. So what
//! rests does not creep. Forces are held over a tick; they are those of the place in its middle, so that a spring neither gains nor
//! loses energy to second order. With no point below the surface there is no force at all.

use glam::{DVec2, DVec3};

use super::{Disturbance, PlantState};
use crate::norm::Norm;

/// Feet, tips of the rotors' guards, and top, four of each.
pub const POINTS: usize = 12;

/// Points of a vehicle that can touch the ground, and the material of both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactConfig {
    /// Distance of each foot, of each guard and of each upper corner from body z, along x as along y (m).
    pub arms: [f64; 3],
    /// Body z of feet, guards and upper corners (m).
    pub heights: [f64; 3],
    /// Depth to which the vehicle's weight presses its four feet (m).
    pub sag: f64,
    /// Damping ratio of the weight on the four feet.
    pub damping: f64,
    /// `mu`: coefficient of friction.
    pub friction: f64,
}

/// The vehicle of `firmware/vehicle.toml`: arms of 0.2 m, feet 0.1 m below the centre of mass. Friction of rubber on stone.
pub const QUADROTOR: ContactConfig = ContactConfig {
    arms: [0.1, 0.2, 0.05],
    heights: [-0.1, 0.0, 0.06],
    sag: 0.001,
    damping: 0.7,
    friction: 0.7,
};

/// The contact with its memory.
#[derive(Clone, Debug)]
pub struct Contact {
    points_body: [DVec3; POINTS],
    /// Places where points stick.
    anchors: [Option<DVec2>; POINTS],
    /// `k` (N/m), `c` (N s/m), `mu`.
    stiffness: f64,
    damping: f64,
    friction: f64,
    /// Heights of the surface, and of the centre of mass at rest (m).
    surface: f64,
    ground: f64,
    mass: f64,
    step_period: f64,
}

impl Contact {
    /// Contact of a vehicle of `mass` (kg) whose centre of mass rests at the height `ground` (m), with forces every `step_period` (s).
    #[must_use]
    pub fn new(config: &ContactConfig, mass: f64, ground: f64, step_period: f64) -> Self {
        let ContactConfig { arms, heights, sag, damping, friction } = *config;
        let quarter = 0.25 * mass;
        let stiffness = quarter * f64::from(ctrl_core::vehicle::GRAVITY) / sag;
        let point = |i: usize| {
            let (ring, corner) = (i / 4, i % 4);
            let sign = |bit: usize| if corner & bit == 0 { 1.0 } else { -1.0 };
            DVec3::new(sign(1) * arms[ring], sign(2) * arms[ring], heights[ring])
        };
        Self {
            points_body: core::array::from_fn(point),
            anchors: [None; POINTS],
            stiffness,
            damping: 2.0 * damping * (stiffness * quarter).sqrt(),
            friction,
            surface: ground + heights[0] + sag,
            ground,
            mass,
            step_period,
        }
    }

    /// Height at which the centre of mass rests (m).
    #[must_use]
    pub fn ground(&self) -> f64 {
        self.ground
    }

    /// Time over which a force is held (s).
    #[must_use]
    pub fn step_period(&self) -> f64 {
        self.step_period
    }

    /// Returns `true` while any point is below the surface.
    #[must_use]
    pub fn touches(&self) -> bool {
        self.anchors.iter().any(Option::is_some)
    }

    /// What the ground adds to the disturbance over the tick that begins with `truth`; none while nothing touches.
    pub fn push(&mut self, truth: &PlantState) -> Option<Disturbance> {
        // The lowest point is above the surface: by far the most frequent case.
        let reach = self.points_body[4].norm();
        let later =
            truth.position_world.z + 0.5 * self.step_period * truth.velocity_world.z.min(0.0);
        if later - reach > self.surface + self.step_period * truth.rate_body.norm() * reach {
            self.anchors = [None; POINTS];
            return None;
        }
        let (mut force_world, mut torque_world) = (DVec3::ZERO, DVec3::ZERO);
        for i in 0..POINTS {
            let arm = truth.attitude * self.points_body[i];
            let velocity =
                truth.velocity_world + truth.attitude * truth.rate_body.cross(self.points_body[i]);
            let place = truth.position_world + arm + 0.5 * self.step_period * velocity;
            let force = self.force(i, place, velocity);
            force_world += force;
            torque_world += arm.cross(force);
        }
        self.touches().then(|| Disturbance {
            acceleration_world: force_world / self.mass,
            torque_body: truth.attitude.conjugate() * torque_world,
            wind_world: DVec3::ZERO,
        })
    }

    /// Force on the point `i` (N).
    fn force(&mut self, i: usize, place: DVec3, velocity: DVec3) -> DVec3 {
        let Self { stiffness, damping, friction, .. } = *self;
        let depth = self.surface - place.z;
        if depth <= 0.0 {
            self.anchors[i] = None;
            return DVec3::ZERO;
        }
        let normal = (stiffness * depth - damping * velocity.z).max(0.0);
        let (place, velocity) = (place.truncate(), velocity.truncate());
        let anchor = self.anchors[i].unwrap_or(place);
        let stretched = -stiffness * (place - anchor);
        let sticking = stretched - damping * velocity;
        let (most, asked) =
            (friction * normal, (sticking.x * sticking.x + sticking.y * sticking.y).sqrt());
        let tangential = if asked > most {
            // The spring is left as long as the friction holds it.
            let spring = (stretched.x * stretched.x + stretched.y * stretched.y).sqrt();
            let left = if spring > most { stretched * (most / spring) } else { stretched };
            self.anchors[i] = Some(place + left / stiffness);
            sticking * (most / asked)
        } else {
            self.anchors[i] = Some(anchor);
            sticking
        };
        tangential.extend(normal)
    }
}
