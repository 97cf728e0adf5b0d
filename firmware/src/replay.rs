//! Records of the replay image (`bin/replay.rs`): samples in, replies out, both of fixed size.
//!
//! The host writes a [`ReplaySample`] for each tick and reads a [`ReplayReply`]; through two FIFOs it can wait
//! for the one before it makes the next, which is a processor in the loop in lock step.

use ctrl_core::controller::{StepOutput, TrackingController};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::{VehicleState, Wrench};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Input of one step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReplaySample {
    /// State of the vehicle.
    pub vehicle: VehicleState,
    /// Reference of the same tick.
    pub reference: Reference,
}

/// Result of one step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReplayReply {
    /// The command.
    pub wrench: Wrench,
    /// Torque before saturation (N m).
    pub torque_demand_body: Vec3,
    /// Bits of the step's status.
    #[serde(with = "postcard::fixint::le")]
    pub status: u16,
}

impl From<StepOutput> for ReplayReply {
    fn from(output: StepOutput) -> Self {
        let StepOutput { wrench, torque_demand_body, status } = output;
        Self { wrench, torque_demand_body, status: status.bits() }
    }
}

impl ReplaySample {
    /// Size of the record: 13 + 24 numbers of four bytes, little-endian (bytes).
    pub const SIZE: usize = 148;

    /// The record of this sample.
    ///
    /// # Errors
    /// None: the record has a fixed size.
    pub fn encode(&self) -> Result<[u8; Self::SIZE], postcard::Error> {
        let mut bytes = [0; Self::SIZE];
        postcard::to_slice(self, &mut bytes)?;
        Ok(bytes)
    }

    /// The sample in a record.
    ///
    /// # Errors
    /// None: every bit pattern is a sample.
    pub fn decode(bytes: &[u8; Self::SIZE]) -> Result<Self, postcard::Error> {
        postcard::from_bytes(bytes)
    }

    /// One step of `controller` with this sample.
    pub fn step<C: TrackingController>(&self, controller: &C, state: &mut C::State) -> ReplayReply {
        controller.step(state, &self.vehicle, &self.reference).into()
    }
}

impl ReplayReply {
    /// Size of the record: 7 numbers of four bytes and one of two, little-endian (bytes).
    pub const SIZE: usize = 30;

    /// The record of this reply.
    ///
    /// # Errors
    /// None: the record has a fixed size.
    pub fn encode(&self) -> Result<[u8; Self::SIZE], postcard::Error> {
        let mut bytes = [0; Self::SIZE];
        postcard::to_slice(self, &mut bytes)?;
        Ok(bytes)
    }

    /// The reply in a record.
    ///
    /// # Errors
    /// None: every bit pattern is a reply.
    pub fn decode(bytes: &[u8; Self::SIZE]) -> Result<Self, postcard::Error> {
        postcard::from_bytes(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_little_endian_numbers_in_order() {
        let vehicle = VehicleState::at_rest(Vec3::new(1.0, 2.0, 3.0));
        let sample =
            ReplaySample { vehicle, reference: Reference::hover(Vec3::new(4.0, 5.0, 6.0)) };
        let bytes = sample.encode().unwrap();
        let number = |i: usize| f32::from_le_bytes(bytes[4 * i..4 * i + 4].try_into().unwrap());
        assert_eq!([number(0), number(1), number(2)], [1.0, 2.0, 3.0]);
        assert_eq!([number(6), number(9)], [0.0, 1.0], "attitude is x, y, z, w");
        assert_eq!([number(13), number(14), number(15), number(29)], [4.0, 5.0, 6.0, 1.0]);
        assert_eq!(ReplaySample::decode(&bytes).unwrap(), sample);
    }

    #[test]
    fn a_reply_fills_its_record() {
        let reply = ReplayReply {
            wrench: Wrench { thrust: 1.0, torque_body: Vec3::new(2.0, 3.0, 4.0) },
            torque_demand_body: Vec3::new(5.0, 6.0, f32::MAX),
            status: 0x8001,
        };
        let bytes = reply.encode().unwrap();
        assert_eq!(bytes[..4], 1.0f32.to_le_bytes());
        assert_eq!(bytes[24..28], f32::MAX.to_le_bytes());
        assert_eq!(bytes[28..], [0x01, 0x80]);
        assert_eq!(ReplayReply::decode(&bytes).unwrap(), reply);
    }
}
