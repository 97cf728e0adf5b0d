//! Motion of a rigid body under thrust, torque, gravity and disturbance, by fourth-order
//! Runge-Kutta steps (RK4):
//!
//! ```text
//! p' = v                                    (1)
//! v' = -g e3 + (f/m) R e3 + d1              (2)
//! q' = 1/2 q (x) [0, w]                     (3)
//! J w' = (J w) × w + tau + d2               (4)
//! ```
//!
//! `f`, `tau`, `d1`, `d2` are held over the step. Then (4) stands alone, (3) needs only (4), and
//! (1), (2) need only `R e3`: the four stages of each follow one another instead of being one
//! stage of a 13-component state, with the same result in fewer operations.

use ctrl_core::vehicle::{GRAVITY, Wrench};
use glam::{DQuat, DVec3};

use super::{Disturbance, PlantParameters, PlantState};

/// A rigid body: its parameters and how finely a control tick is integrated.
#[derive(Clone, Copy, Debug)]
pub struct RigidBody {
    inverse_mass: f64,
    inverse_inertia: DVec3,
    /// `[J2 - J3, J3 - J1, J1 - J2]`: `(J w) × w` is this times `[w2 w3, w3 w1, w1 w2]`.
    inertia_difference: DVec3,
    sub_steps: u32,
    sub_step_period: f64,
}

impl RigidBody {
    /// A body that moves `step_period` [s] a call of [`advance`](Self::advance), in `sub_steps`
    /// (at least one) RK4 steps. Mass and inertia must be positive.
    #[must_use]
    pub fn new(parameters: &PlantParameters, step_period: f64, sub_steps: u32) -> Self {
        let PlantParameters { mass, inertia: j } = *parameters;
        let sub_steps = sub_steps.max(1);
        Self {
            inverse_mass: 1.0 / mass,
            inverse_inertia: 1.0 / j,
            inertia_difference: DVec3::new(j.y - j.z, j.z - j.x, j.x - j.y),
            sub_steps,
            sub_step_period: step_period / f64::from(sub_steps),
        }
    }

    /// The state one step period later, under a held wrench and a held disturbance.
    #[inline]
    #[must_use]
    pub fn advance(&self, state: &PlantState, wrench: &Wrench, held: &Disturbance) -> PlantState {
        let thrust_acceleration = f64::from(wrench.thrust) * self.inverse_mass;
        let free_acceleration = held.acceleration_world - DVec3::Z * f64::from(GRAVITY);
        let torque = wrench.torque_body.as_dvec3() + held.torque_body;
        let mut state = *state;
        for _ in 0..self.sub_steps {
            state = self.sub_step(&state, thrust_acceleration, free_acceleration, torque);
        }
        state
    }

    #[inline]
    fn sub_step(&self, state: &PlantState, thrust: f64, free: DVec3, torque: DVec3) -> PlantState {
        let h = self.sub_step_period;
        let w1 = state.rate_body;
        let k1 = self.rate_derivative(w1, torque);
        let w2 = w1 + 0.5 * h * k1;
        let k2 = self.rate_derivative(w2, torque);
        let w3 = w1 + 0.5 * h * k2;
        let k3 = self.rate_derivative(w3, torque);
        let w4 = w1 + h * k3;
        let k4 = self.rate_derivative(w4, torque);

        let q1 = state.attitude;
        let r1 = attitude_derivative(q1, w1);
        let q2 = q1 + r1 * (0.5 * h);
        let r2 = attitude_derivative(q2, w2);
        let q3 = q1 + r2 * (0.5 * h);
        let r3 = attitude_derivative(q3, w3);
        let q4 = q1 + r3 * h;
        let r4 = attitude_derivative(q4, w4);

        // p and v of the stages differ by multiples of the accelerations only, which collapses
        // RK4 of (1), (2) to these two sums.
        let a1 = thrust * thrust_axis(q1) + free;
        let a23 = thrust * (thrust_axis(q2) + thrust_axis(q3)) + 2.0 * free;
        let a4 = thrust * thrust_axis(q4) + free;

        PlantState {
            position_world: state.position_world
                + h * state.velocity_world
                + (h * h / 6.0) * (a1 + a23),
            velocity_world: state.velocity_world + (h / 6.0) * (a1 + 2.0 * a23 + a4),
            attitude: normalised(q1 + (r1 + (r2 + r3) * 2.0 + r4) * (h / 6.0)),
            rate_body: w1 + (h / 6.0) * (k1 + 2.0 * (k2 + k3) + k4),
        }
    }

    /// (4): `w'` of a body with principal axes.
    #[inline(always)]
    fn rate_derivative(&self, w: DVec3, torque: DVec3) -> DVec3 {
        let products = DVec3::new(w.y * w.z, w.z * w.x, w.x * w.y);
        self.inverse_inertia * (self.inertia_difference * products + torque)
    }
}

/// (3): `1/2 q (x) [0, w]`.
#[inline(always)]
fn attitude_derivative(q: DQuat, w: DVec3) -> DQuat {
    let half = 0.5 * w;
    DQuat::from_xyzw(
        q.w * half.x + q.y * half.z - q.z * half.y,
        q.w * half.y + q.z * half.x - q.x * half.z,
        q.w * half.z + q.x * half.y - q.y * half.x,
        -(q.x * half.x + q.y * half.y + q.z * half.z),
    )
}

/// `R e3` of a stage; a stage's quaternion is off unit length by `O(h^2)`, which RK4 expects.
#[inline(always)]
fn thrust_axis(q: DQuat) -> DVec3 {
    DVec3::new(
        2.0 * (q.x * q.z + q.w * q.y),
        2.0 * (q.y * q.z - q.w * q.x),
        q.w * q.w - q.x * q.x - q.y * q.y + q.z * q.z,
    )
}

#[inline(always)]
fn normalised(q: DQuat) -> DQuat {
    q * (1.0 / q.length_squared().sqrt())
}
