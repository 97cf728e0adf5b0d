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
//! stage of a 13-component state, with the same result in fewer operations. The components of a vector, and those of
//! a quaternion, are worked on side by side in SIMD lanes, and so are the four stages' `R e3`.

use ctrl_core::vehicle::{GRAVITY, Wrench};
use glam::DVec3;

use super::components::Components;
use super::{AppliedWrench, Disturbance, PlantParameters, PlantState};
use crate::lanes::{LANES, Quaternions, Vectors};

/// A rigid body: its parameters and how finely a control tick is integrated.
#[derive(Clone, Copy, Debug)]
pub struct RigidBody {
    inverse_mass: f64,
    /// `h J^-1`.
    inverse_inertia: Components,
    /// `h [(J2 - J3)/J1, (J3 - J1)/J2, (J1 - J2)/J3]`: `h J^-1 ((J w) × w)` is this times
    /// `[w2 w3, w3 w1, w1 w2]`.
    gyroscopic: Components,
    sub_steps: u32,
    /// `h`: duration of one RK4 step (s).
    h: f64,
}

/// State of the body, component by component in lanes.
#[derive(Clone, Copy)]
struct State {
    position: Components,
    velocity: Components,
    attitude: Components,
    rate: Components,
}

impl RigidBody {
    /// A body that moves `step_period` (s) a call of [`advance`](Self::advance), in `sub_steps`
    /// (at least one) RK4 steps. Mass and inertia must be positive.
    #[must_use]
    pub fn new(parameters: &PlantParameters, step_period: f64, sub_steps: u32) -> Self {
        let PlantParameters { mass, inertia: j, .. } = *parameters;
        let sub_steps = sub_steps.max(1);
        let h = step_period / f64::from(sub_steps);
        let gyroscopic = h * DVec3::new(j.y - j.z, j.z - j.x, j.x - j.y) / j;
        Self {
            inverse_mass: 1.0 / mass,
            inverse_inertia: Components::from(h * (1.0 / j)),
            gyroscopic: Components::from(gyroscopic),
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
        let mut state = State::from(state);
        for _ in 0..self.sub_steps {
            state = self.sub_step(&state, thrust, free, spin);
        }
        state.into()
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
        self.sub_step(&State::from(state), thrust, free(held), self.spin(wrench, held)).into()
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
        self.stages(&State::from(state), thrust, free(held), spin).into()
    }

    /// Change of the rate by wrench and disturbance over one RK4 step (rad/s).
    #[inline(always)]
    fn spin(&self, wrench: &AppliedWrench, held: &Disturbance) -> Components {
        let torque = Components::from(wrench.torque_body) + Components::from(held.torque_body);
        self.inverse_inertia * torque
    }

    /// One RK4 step: `thrust` and `free` are the accelerations (m/s^2) along `R e3` and without
    /// it, `spin` is what the torque adds to the rate in one step (rad/s).
    #[inline(always)]
    fn sub_step(&self, state: &State, thrust: f64, free: Components, spin: Components) -> State {
        let turned = self.turned(state, [spin; 3]);
        let (h, velocity, [z1, z23, z4]) = (self.h, state.velocity, turned.thrust_axes);
        let sixth = thrust / 6.0;
        State {
            position: state.position + (velocity + ((z1 + z23) * sixth + free * 0.5) * h) * h,
            velocity: velocity + ((z1 + z23 * 2.0 + z4) * sixth + free) * h,
            attitude: turned.attitude,
            rate: turned.rate,
        }
    }

    /// As [`sub_step`](Self::sub_step), with thrust and spin at start, middle and end of the step.
    #[inline(always)]
    fn stages(
        &self,
        state: &State,
        [f1, f23, f4]: [f64; 3],
        free: Components,
        spin: [Components; 3],
    ) -> State {
        let turned = self.turned(state, spin);
        let (h, velocity, [z1, z23, z4]) = (self.h, state.velocity, turned.thrust_axes);
        let (start, middle, end) = (z1 * f1, z23 * f23, z4 * f4);
        State {
            position: state.position + (velocity + ((start + middle) / 6.0 + free * 0.5) * h) * h,
            velocity: velocity + ((start + middle * 2.0 + end) / 6.0 + free) * h,
            attitude: turned.attitude,
            rate: turned.rate,
        }
    }

    /// (3), (4) over one RK4 step, under the spins of its start, middle and end. `dw` and `dq` are
    /// the increments of the four stages, derivative times `h`.
    #[inline(always)]
    fn turned(&self, state: &State, [s1, s23, s4]: [Components; 3]) -> Turned {
        let w1 = state.rate;
        let dw1 = self.rate_increment(w1, s1);
        let w2 = w1 + dw1 * 0.5;
        let dw2 = self.rate_increment(w2, s23);
        let w3 = w1 + dw2 * 0.5;
        let dw3 = self.rate_increment(w3, s23);
        let w4 = w1 + dw3;
        let dw4 = self.rate_increment(w4, s4);

        let half = 0.5 * self.h;
        let q1 = state.attitude;
        let dq1 = attitude_increment(q1, w1 * half);
        let q2 = q1 + dq1 * 0.5;
        let dq2 = attitude_increment(q2, w2 * half);
        let q3 = q1 + dq2 * 0.5;
        let dq3 = attitude_increment(q3, w3 * half);
        let q4 = q1 + dq3;
        let dq4 = attitude_increment(q4, w4 * half);
        let [z1, z2, z3, z4] = thrust_axes([q1, q2, q3, q4]);
        Turned {
            rate: w1 + (dw1 + (dw2 + dw3) * 2.0 + dw4) * (1.0 / 6.0),
            attitude: (q1 + (dq1 + (dq2 + dq3) * 2.0 + dq4) * (1.0 / 6.0)).unit(),
            thrust_axes: [z1, z2 + z3, z4],
        }
    }

    /// (4): `h w'` of a body with principal axes.
    #[inline(always)]
    fn rate_increment(&self, w: Components, spin: Components) -> Components {
        self.gyroscopic * (w.yzx() * w.zxy()) + spin
    }
}

/// Rotation of the body over one RK4 step. The stages' `p` and `v` differ by multiples of the
/// accelerations only, which collapses RK4 of (1), (2) to sums of the stages' thrust axes.
struct Turned {
    rate: Components,
    attitude: Components,
    /// `R e3` of the first stage, the sum of the two in the middle, and of the last.
    thrust_axes: [Components; 3],
}

/// Acceleration without thrust (m/s^2).
#[inline(always)]
fn free(held: &Disturbance) -> Components {
    Components::from(held.acceleration_world - DVec3::Z * f64::from(GRAVITY))
}

/// (3): `h q'`, where `turn` is `h/2 w`.
#[inline(always)]
fn attitude_increment(q: Components, turn: Components) -> Components {
    // q_w t1 + q2 t3 - q3 t2    ..    -(q1 t1 + q2 t2 + q3 t3)
    let first = q.wwwx() * turn.xyzx() + q.yzxy() * turn.zxyy();
    (first + (q.zxyz() * turn.yzxz()).but_w_negated()).w_negated()
}

/// `R e3` of the four stages; a stage's quaternion is off unit length by `O(h^2)`, which RK4 expects.
#[inline(always)]
fn thrust_axes(q: [Components; LANES]) -> [Components; LANES] {
    let (Vectors { x, y, z }, w) = Vectors::of_fours(q.map(|q| q.0));
    let axes = Quaternions { x, y, z, w }.thrust_axis();
    axes.padded().map(Components)
}

impl From<&PlantState> for State {
    #[inline(always)]
    fn from(state: &PlantState) -> Self {
        Self {
            position: state.position_world.into(),
            velocity: state.velocity_world.into(),
            attitude: state.attitude.into(),
            rate: state.rate_body.into(),
        }
    }
}

impl From<State> for PlantState {
    #[inline(always)]
    fn from(state: State) -> Self {
        Self {
            position_world: state.position.into(),
            velocity_world: state.velocity.into(),
            attitude: state.attitude.into(),
            rate_body: state.rate.into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    /// (3) and `R e3` of a stage, component by component.
    fn plain(q: DQuat, turn: DVec3) -> (DQuat, DVec3) {
        let increment = DQuat::from_xyzw(
            q.w * turn.x + q.y * turn.z - q.z * turn.y,
            q.w * turn.y + q.z * turn.x - q.x * turn.z,
            q.w * turn.z + q.x * turn.y - q.y * turn.x,
            -(q.x * turn.x + q.y * turn.y + q.z * turn.z),
        );
        let axis = DVec3::new(
            2.0 * (q.x * q.z + q.w * q.y),
            2.0 * (q.y * q.z - q.w * q.x),
            q.w * q.w - q.x * q.x - q.y * q.y + q.z * q.z,
        );
        (increment, axis)
    }

    #[test]
    fn lanes_have_the_bits_of_the_formulas() {
        let turns = [DVec3::ZERO, DVec3::new(-0.0, 0.3, -1.7), DVec3::new(1e-3, -2e-5, 0.7)];
        let quaternions = [
            DQuat::IDENTITY,
            DQuat::from_xyzw(1.0, 0.0, -0.0, 0.0),
            DQuat::from_xyzw(0.1, -0.7, 0.4, -0.58),
            DQuat::from_xyzw(-0.31, 0.22, 0.9, 0.2),
        ];
        let axes = thrust_axes(quaternions.map(Components::from)).map(DVec3::from);
        for (q, axis) in quaternions.into_iter().zip(axes) {
            for turn in turns {
                let found = DQuat::from(attitude_increment(q.into(), turn.into()));
                let (increment, expected) = plain(q, turn);
                let bits = |it: DQuat| it.to_array().map(f64::to_bits);
                assert_eq!(bits(found), bits(increment), "{q} {turn}");
                assert_eq!(
                    axis.to_array().map(f64::to_bits),
                    expected.to_array().map(f64::to_bits)
                );
            }
            let unit = DQuat::from(Components::from(q).unit());
            assert_eq!(unit, q * (1.0 / q.length_squared().sqrt()));
        }
    }
}
