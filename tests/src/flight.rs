//! Closed-loop flights of the simulated vehicle, one control tick after another.

use ctrl_core::vehicle::Wrench;
use glam::{DQuat, DVec3};
use sim::plant::rigid_body::RigidBody;
use sim::plant::{Disturbance, PlantParameters, PlantState};

use crate::paper_example::Circle;
use crate::transcription::{Quaternion, Truth};

/// The plant's state as the laws take it.
#[must_use]
pub fn truth(state: &PlantState) -> Truth {
    let q = state.attitude;
    Truth {
        p: state.position_world,
        v: state.velocity_world,
        q: Quaternion::from([q.w, q.x, q.y, q.z]),
        w: state.rate_body,
    }
}

/// At rest beside the circle's start, tilted by `tilt` (rad) about `axis`.
#[must_use]
pub fn start(circle: &Circle, offset: DVec3, axis: DVec3, tilt: f64) -> PlantState {
    PlantState {
        position_world: circle.at(0.0).p + offset,
        velocity_world: DVec3::ZERO,
        attitude: DQuat::from_rotation_z(std::f64::consts::PI)
            * DQuat::from_axis_angle(axis.normalize(), tilt),
        rate_body: DVec3::ZERO,
    }
}

/// Thrust and torque held over one tick.
#[derive(Clone, Copy, Debug)]
pub struct Held {
    /// Command.
    pub wrench: Wrench,
    /// True mass (kg).
    pub mass: f64,
    /// Disturbance.
    pub disturbance: Disturbance,
}

/// Flies `ticks` ticks of `dt` (s): `control` sees the tick and the truth; returns the last state.
pub fn fly(
    start: PlantState,
    inertia: DVec3,
    dt: f64,
    ticks: u32,
    mut control: impl FnMut(u32, &PlantState) -> Held,
) -> PlantState {
    (0..ticks).fold(start, |state, tick| {
        let Held { wrench, mass, disturbance } = control(tick, &state);
        RigidBody::new(&PlantParameters::new(mass, inertia), dt, 1).advance(
            &state,
            &wrench,
            &disturbance,
        )
    })
}
