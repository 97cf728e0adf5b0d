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

use super::{AppliedWrench, Disturbance, PlantParameters, PlantState};

/// A rigid body: its parameters and how finely a control tick is integrated.
#[derive(Clone, Copy, Debug)]
pub struct RigidBody {
    inverse_mass: f64,
    inverse_inertia: DVec3,
    /// `h [(J2 - J3)/J1, (J3 - J1)/J2, (J1 - J2)/J3]`: `h J^-1 ((J w) × w)` is this times
    /// `[w2 w3, w3 w1, w1 w2]`.
    gyroscopic: DVec3,
    sub_steps: u32,
    /// `h`: duration of one RK4 step (s).
    h: f64,
}

impl RigidBody {
    /// A body that moves `step_period` (s) a call of [`advance`](Self::advance), in `sub_steps`
    /// (at least one) RK4 steps. Mass and inertia must be positive.
    #[must_use]
    pub fn new(parameters: &PlantParameters, step_period: f64, sub_steps: u32) -> Self {
        let PlantParameters { mass, inertia: j, .. } = *parameters;
        let sub_steps = sub_steps.max(1);
        let h = step_period / f64::from(sub_steps);
        Self {
            inverse_mass: 1.0 / mass,
            inverse_inertia: 1.0 / j,
            gyroscopic: h * DVec3::new(j.y - j.z, j.z - j.x, j.x - j.y) / j,
            sub_steps,
            h,
        }
    }

    /// The state one step period later, under a held wrench and a held disturbance.
    #[inline]
    #[must_use]
    pub fn advance(&self, state: &PlantState, wrench: &Wrench, held: &Disturbance) -> PlantState {
        let wrench = AppliedWrench::from(*wrench);
        let thrust = wrench.thrust * self.inverse_mass;
        let (free, spin) = (free(held), self.spin(&wrench, held));
        let mut state = *state;
        for _ in 0..self.sub_steps {
            state = self.sub_step(&state, thrust, free, spin);
        }
        state
    }

    /// RK4 steps per step period.
    #[must_use]
    pub fn sub_steps(&self) -> u32 {
        self.sub_steps
    }

    /// Length of an RK4 step (s).
    #[must_use]
    pub fn sub_step_duration(&self) -> f64 {
        self.h
    }

    /// The state one RK4 step later; `sub_steps` of them are one [`advance`](Self::advance), to the bit.
    pub(super) fn sub_step_held(
        &self,
        state: &PlantState,
        wrench: &AppliedWrench,
        held: &Disturbance,
    ) -> PlantState {
        let thrust = wrench.thrust * self.inverse_mass;
        self.sub_step(state, thrust, free(held), self.spin(wrench, held))
    }

    /// The state one RK4 step later, under a wrench that changes: at the step's start, in its middle,
    /// and at its end.
    pub(super) fn sub_step_varying(
        &self,
        state: &PlantState,
        wrench: &[AppliedWrench; 3],
        held: &Disturbance,
    ) -> PlantState {
        let thrust = wrench.map(|wrench| wrench.thrust * self.inverse_mass);
        let spin = wrench.map(|wrench| self.spin(&wrench, held));
        self.stages(state, thrust, free(held), spin)
    }

    /// Change of the rate by wrench and disturbance over one RK4 step (rad/s).
    #[inline(always)]
    fn spin(&self, wrench: &AppliedWrench, held: &Disturbance) -> DVec3 {
        self.h * self.inverse_inertia * (wrench.torque_body + held.torque_body)
    }

    /// One RK4 step: `thrust` and `free` are the accelerations (m/s^2) along `R e3` and without
    /// it, `spin` is what the torque adds to the rate in one step (rad/s).
    #[inline]
    fn sub_step(&self, state: &PlantState, thrust: f64, free: DVec3, spin: DVec3) -> PlantState {
        let turned = self.turned(state, [spin; 3]);
        let (h, velocity, [z1, z23, z4]) = (self.h, state.velocity_world, turned.thrust_axes);
        PlantState {
            position_world: state.position_world
                + h * (velocity + h * (thrust / 6.0 * (z1 + z23) + 0.5 * free)),
            velocity_world: velocity + h * (thrust / 6.0 * (z1 + 2.0 * z23 + z4) + free),
            attitude: turned.attitude,
            rate_body: turned.rate_body,
        }
    }

    /// As [`sub_step`](Self::sub_step), with thrust and spin at start, middle and end of the step.
    fn stages(
        &self,
        state: &PlantState,
        [f1, f23, f4]: [f64; 3],
        free: DVec3,
        spin: [DVec3; 3],
    ) -> PlantState {
        let turned = self.turned(state, spin);
        let (h, velocity, [z1, z23, z4]) = (self.h, state.velocity_world, turned.thrust_axes);
        let (start, middle, end) = (f1 * z1, f23 * z23, f4 * z4);
        PlantState {
            position_world: state.position_world
                + h * (velocity + h * ((start + middle) / 6.0 + 0.5 * free)),
            velocity_world: velocity + h * ((start + 2.0 * middle + end) / 6.0 + free),
            attitude: turned.attitude,
            rate_body: turned.rate_body,
        }
    }

    /// (3), (4) over one RK4 step, under the spins of its start, middle and end. `dw` and `dq` are
    /// the increments of the four stages, derivative times `h`.
    #[inline(always)]
    fn turned(&self, state: &PlantState, [s1, s23, s4]: [DVec3; 3]) -> Turned {
        let w1 = state.rate_body;
        let dw1 = self.rate_increment(w1, s1);
        let w2 = w1 + 0.5 * dw1;
        let dw2 = self.rate_increment(w2, s23);
        let w3 = w1 + 0.5 * dw2;
        let dw3 = self.rate_increment(w3, s23);
        let w4 = w1 + dw3;
        let dw4 = self.rate_increment(w4, s4);

        let h = self.h;
        let q1 = state.attitude;
        let dq1 = attitude_increment(q1, 0.5 * h * w1);
        let q2 = q1 + dq1 * 0.5;
        let dq2 = attitude_increment(q2, 0.5 * h * w2);
        let q3 = q1 + dq2 * 0.5;
        let dq3 = attitude_increment(q3, 0.5 * h * w3);
        let q4 = q1 + dq3;
        let dq4 = attitude_increment(q4, 0.5 * h * w4);
        Turned {
            rate_body: w1 + (dw1 + 2.0 * (dw2 + dw3) + dw4) * (1.0 / 6.0),
            attitude: normalised(q1 + (dq1 + (dq2 + dq3) * 2.0 + dq4) * (1.0 / 6.0)),
            thrust_axes: [thrust_axis(q1), thrust_axis(q2) + thrust_axis(q3), thrust_axis(q4)],
        }
    }

    /// (4): `h w'` of a body with principal axes.
    #[inline(always)]
    fn rate_increment(&self, w: DVec3, spin: DVec3) -> DVec3 {
        self.gyroscopic * DVec3::new(w.y * w.z, w.z * w.x, w.x * w.y) + spin
    }
}

/// Rotation of the body over one RK4 step. The stages' `p` and `v` differ by multiples of the
/// accelerations only, which collapses RK4 of (1), (2) to sums of the stages' thrust axes.
struct Turned {
    rate_body: DVec3,
    attitude: DQuat,
    /// `R e3` of the first stage, the sum of the two in the middle, and of the last.
    thrust_axes: [DVec3; 3],
}

/// Acceleration without thrust (m/s^2).
#[inline(always)]
fn free(held: &Disturbance) -> DVec3 {
    held.acceleration_world - DVec3::Z * f64::from(GRAVITY)
}

/// (3): `h q'`, where `turn` is `h/2 w`.
#[inline(always)]
fn attitude_increment(q: DQuat, turn: DVec3) -> DQuat {
    DQuat::from_xyzw(
        q.w * turn.x + q.y * turn.z - q.z * turn.y,
        q.w * turn.y + q.z * turn.x - q.x * turn.z,
        q.w * turn.z + q.x * turn.y - q.y * turn.x,
        -(q.x * turn.x + q.y * turn.y + q.z * turn.z),
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
