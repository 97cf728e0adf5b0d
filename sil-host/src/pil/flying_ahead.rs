//! The host ahead of the vehicle: it flies the plant by the law's own output, sends the samples of several ticks at
//! once, and holds the vehicle's answers against the law afterwards.
//!
//! While every bit is the law's, this is the flight that the vehicle's wrenches give. After the first difference it
//! is not: such a flight is to be flown again tick by tick.

use std::collections::VecDeque;

use ctrl_core::vehicle::VehicleState;

use super::PilError;
use super::comparison::{Step, first_difference};
use super::on_vehicle::InFlight;

/// Ticks of which a vehicle in the emulator has not answered.
#[derive(Debug)]
pub struct Ahead {
    /// Ticks that are sent at once, at least 1.
    batch: usize,
    /// Packets that have not been sent.
    packets: Vec<Vec<u8>>,
    /// The sample of each tick without an answer, and the law's step with it.
    unanswered: VecDeque<(VehicleState, Step)>,
}

impl InFlight<'_> {
    /// The host flies ahead of the vehicle, and sends `batch` ticks at once.
    #[must_use]
    pub fn ahead(mut self, batch: usize) -> Self {
        let batch = batch.max(1);
        self.ahead = Some(Ahead { batch, packets: Vec::new(), unanswered: VecDeque::new() });
        self
    }

    /// A control tick with the sample `vehicle`, in which the law did `expected`. The vehicle flies it later: while
    /// it is at one batch, the host is at the next.
    pub(super) fn step_ahead(
        &mut self,
        vehicle: &VehicleState,
        expected: Step,
    ) -> Result<(), PilError> {
        let Some(ahead) = &self.ahead else { return Ok(()) };
        let unanswered = ahead.unanswered.len() as u64;
        let messages = self.messages(self.ticks + unanswered, vehicle);
        let packet = self.session.packet(&messages, unanswered);
        let Some(ahead) = &mut self.ahead else { return Ok(()) };
        ahead.packets.push(packet);
        ahead.unanswered.push_back((*vehicle, expected));
        let batch = ahead.batch;
        if ahead.packets.len() < batch {
            return Ok(());
        }
        self.send_batch()?;
        self.receive_until(batch)
    }

    /// Sends what waits, and takes in the answers of all ticks.
    ///
    /// # Errors
    /// When the vehicle is silent or has left flight.
    pub fn finish(&mut self) -> Result<(), PilError> {
        self.send_batch()?;
        self.receive_until(0)
    }

    fn send_batch(&mut self) -> Result<(), PilError> {
        let Some(ahead) = &mut self.ahead else { return Ok(()) };
        self.session.send_ahead(&std::mem::take(&mut ahead.packets))
    }

    /// Takes in answers until only `left` are missing.
    fn receive_until(&mut self, left: usize) -> Result<(), PilError> {
        while let Some(ahead) = self.ahead.as_mut().filter(|ahead| ahead.unanswered.len() > left) {
            let Some((vehicle, expected)) = ahead.unanswered.pop_front() else { break };
            let tick = self.ticks;
            let received = self.session.receive()?;
            if let Some(telemetry) = self.take(&received, &vehicle)?
                && self.difference.is_none()
            {
                self.difference = first_difference(tick, &Step::from(&telemetry), &expected);
            }
        }
        Ok(())
    }
}
