//! Handshake with the vehicle, and subscription to its telemetry.

use ctrl_core::vehicle::VehicleState;
use link::{Downlink, Identity, Uplink};

use super::{AGAIN_AFTER, VehicleSession};
use crate::pil::PilError;

/// Telemetry of a vehicle by the timer over a wire, which can carry every tick in lock step only
/// (ticks).
const SUBSCRIPTION: u16 = 20;

impl VehicleSession {
    /// Handshake and subscription to telemetry at every tick; returns the vehicle's identity.
    ///
    /// # Errors
    /// As [`expect_ok`](Self::expect_ok).
    pub fn subscribe(&mut self, state: VehicleState) -> Result<Identity, PilError> {
        let identity = self.handshake()?;
        // In lock step any subscription gives every tick.
        let period = if self.uptime.is_some() { SUBSCRIPTION } else { 1 };
        self.expect_ok("telemetry at every tick", Uplink::Subscribe { period }, state)?;
        Ok(identity)
    }

    /// Handshake; returns the vehicle's identity.
    pub(super) fn handshake(&mut self) -> Result<Identity, PilError> {
        let mut received = self.send(&[Uplink::Hello])?;
        for round in 1..=self.patience() {
            let identity = received.into_iter().find_map(|message| match message {
                Downlink::Identity(identity) => Some(identity),
                _ => None,
            });
            if let Some(identity) = identity {
                return Ok(identity);
            }
            let again = [Uplink::Hello];
            received = self.send(if round % AGAIN_AFTER == 0 { &again } else { &[] })?;
        }
        Err(PilError::Answer("Hello".to_owned(), "nothing".to_owned()))
    }
}
