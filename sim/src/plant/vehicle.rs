//! The plant of a flight: the interface [`Plant`], and the built-in [`Vehicle`].

use ctrl_core::vehicle::Wrench;

use super::actuation::Actuators;
use super::rigid_body::RigidBody;
use super::{AppliedWrench, Disturbance, PlantState};

/// A simulated vehicle in a flight.
pub trait Plant {
    /// The true state now.
    fn truth(&self) -> &PlantState;

    /// Receives the command of a tick, once before each [`advance`](Self::advance). Returns the wrench that
    /// acts at this instant.
    fn command(&mut self, wrench: &Wrench) -> AppliedWrench;

    /// Moves on by one step period under the latest command and a held disturbance.
    fn advance(&mut self, disturbance: &Disturbance);
}

/// A rigid body with or without rotor dynamics.
#[derive(Clone, Debug)]
pub struct Vehicle {
    body: RigidBody,
    /// If absent, every command acts at once and exactly.
    actuators: Option<Actuators>,
    command: Wrench,
    truth: PlantState,
}

impl Vehicle {
    /// A vehicle in the state `truth`; without `actuators` every command acts at once and exactly.
    #[must_use]
    pub fn new(body: RigidBody, actuators: Option<Actuators>, truth: PlantState) -> Self {
        Self { body, actuators, command: Wrench::default(), truth }
    }
}

impl Vehicle {
    /// Puts the vehicle into another state: what it touches may move it, too.
    pub(super) fn place(&mut self, truth: PlantState) {
        self.truth = truth;
    }
}

impl Plant for Vehicle {
    #[inline]
    fn truth(&self) -> &PlantState {
        &self.truth
    }

    #[inline]
    fn command(&mut self, wrench: &Wrench) -> AppliedWrench {
        self.command = *wrench;
        match &mut self.actuators {
            None => AppliedWrench::from(*wrench),
            Some(actuators) => actuators.take(wrench),
        }
    }

    #[inline]
    fn advance(&mut self, disturbance: &Disturbance) {
        self.truth = match &mut self.actuators {
            None => self.body.advance(&self.truth, &self.command, disturbance),
            Some(actuators) => actuators.advance(&self.body, &self.truth, disturbance),
        };
    }
}
