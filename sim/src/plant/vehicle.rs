//! The plant of a flight: the interface [`Plant`], and the built-in [`Vehicle`].

use ctrl_core::allocation::RotorThrusts;
use ctrl_core::vehicle::Wrench;
use glam::Vec3;

use super::actuation::Actuators;
use super::rigid_body::RigidBody;
use super::rotors::{BatteryState, Rotors};
use super::{AppliedWrench, Disturbance, PlantState};

/// A simulated vehicle in a flight.
pub trait Plant {
    /// The true state now.
    fn truth(&self) -> &PlantState;

    /// Receives the command of a tick, once before each [`advance`](Self::advance). Returns the wrench that
    /// acts at this instant.
    fn command(&mut self, wrench: &Wrench) -> AppliedWrench;

    /// `true` if the law is to take what the rotors [make](Self::made) of its command for the torque that acts.
    fn tells_law(&self) -> bool {
        false
    }

    /// Torque that the mixer makes of a command that it would receive now (N m): the command's own without a mixer.
    fn made(&self, command: &Wrench) -> Vec3 {
        command.torque_body
    }

    /// Adds to the disturbance of the tick whose command was received last what the vehicle itself makes of its motion
    /// through the air: nothing, unless it has rotors with drag.
    fn add_drag(&self, _held: &mut Disturbance) {}

    /// The battery, if there is one.
    fn battery(&self) -> Option<BatteryState> {
        None
    }

    /// Moves on by one step period under the latest command and a held disturbance.
    fn advance(&mut self, disturbance: &Disturbance);
}

/// What is between the command and the body.
#[derive(Clone, Debug)]
enum Drive {
    /// Nothing: every command acts at once and exactly.
    Ideal,
    Wrench(Actuators),
    Rotors(Box<Rotors>),
}

/// A rigid body with or without rotor dynamics.
#[derive(Clone, Debug)]
pub struct Vehicle {
    body: RigidBody,
    drive: Drive,
    command: Wrench,
    truth: PlantState,
}

impl Vehicle {
    /// A vehicle in the state `truth`; without `actuators` every command acts at once and exactly.
    #[must_use]
    pub fn new(body: RigidBody, actuators: Option<Actuators>, truth: PlantState) -> Self {
        let drive = actuators.map_or(Drive::Ideal, Drive::Wrench);
        Self { body, drive, command: Wrench::default(), truth }
    }

    /// The same vehicle by its rotors, in place of its actuators.
    #[must_use]
    pub fn by_rotors(self, rotors: Rotors) -> Self {
        Self { drive: Drive::Rotors(Box::new(rotors)), ..self }
    }

    /// Receives the thrusts (N) of a flight controller that allocates itself, in place of
    /// [`command`](Plant::command); none stops the rotors. `None` if the vehicle has no rotors.
    pub fn command_thrusts(&mut self, thrusts: Option<&RotorThrusts>) -> Option<AppliedWrench> {
        match &mut self.drive {
            Drive::Rotors(rotors) => Some(rotors.take_thrusts(thrusts)),
            Drive::Ideal | Drive::Wrench(_) => None,
        }
    }

    /// Puts the vehicle into another state, before a flight.
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
        match &mut self.drive {
            Drive::Ideal => AppliedWrench::from(*wrench),
            Drive::Wrench(actuators) => actuators.take(wrench),
            Drive::Rotors(rotors) => rotors.take(wrench),
        }
    }

    #[inline]
    fn tells_law(&self) -> bool {
        matches!(&self.drive, Drive::Rotors(rotors) if rotors.tells_law())
    }

    fn made(&self, command: &Wrench) -> Vec3 {
        match &self.drive {
            Drive::Rotors(rotors) => rotors.made(command),
            Drive::Ideal | Drive::Wrench(_) => command.torque_body,
        }
    }

    #[inline]
    fn add_drag(&self, held: &mut Disturbance) {
        if let Drive::Rotors(rotors) = &self.drive {
            rotors.add_drag(&self.truth, held);
        }
    }

    #[inline]
    fn battery(&self) -> Option<BatteryState> {
        match &self.drive {
            Drive::Rotors(rotors) => rotors.battery(),
            Drive::Ideal | Drive::Wrench(_) => None,
        }
    }

    #[inline]
    fn advance(&mut self, disturbance: &Disturbance) {
        self.truth = match &mut self.drive {
            Drive::Ideal => self.body.advance(&self.truth, &self.command, disturbance),
            Drive::Wrench(actuators) => actuators.advance(&self.body, &self.truth, disturbance),
            Drive::Rotors(rotors) => rotors.advance(&self.body, &self.truth, disturbance),
        };
    }
}
