//! The host ahead of the vehicle: it flies the plant by the law's own output, sends the samples of several ticks at
//! once, and holds the vehicle's answers against the law afterwards.
//!
//! While every bit is the law's, this is the flight that the vehicle's wrenches give. After the first difference it
//! is not: such a flight is to be flown again tick by tick.

use std::collections::VecDeque;

use ctrl_core::vehicle::VehicleState;

use super::comparison::Step;

/// Ticks of which a vehicle in the emulator has not answered.
#[derive(Debug)]
pub struct Ahead {
    batch: usize,
    /// Packets that have not been sent.
    packets: Vec<Vec<u8>>,
    /// The sample of each tick without an answer, and the law's step with it.
    unanswered: VecDeque<(VehicleState, Step)>,
}

impl Ahead {
    /// No tick yet; `batch` of them, at least 1, are sent at once.
    pub fn new(batch: usize) -> Self {
        Self { batch: batch.max(1), packets: Vec::new(), unanswered: VecDeque::new() }
    }

    /// Ticks that are sent at once.
    pub fn batch(&self) -> usize {
        self.batch
    }

    /// Ticks without an answer.
    pub fn unanswered(&self) -> usize {
        self.unanswered.len()
    }

    /// Puts a tick behind the others: its packet, its sample and the law's step; `true` if a batch is to be sent.
    pub fn push(&mut self, packet: Vec<u8>, sample: VehicleState, expected: Step) -> bool {
        self.packets.push(packet);
        self.unanswered.push_back((sample, expected));
        self.packets.len() >= self.batch
    }

    /// The packets that have not been sent.
    pub fn take_packets(&mut self) -> Vec<Vec<u8>> {
        std::mem::take(&mut self.packets)
    }

    /// The oldest tick without an answer, if more than `left` have none.
    pub fn next_unanswered(&mut self, left: usize) -> Option<(VehicleState, Step)> {
        if self.unanswered.len() > left { self.unanswered.pop_front() } else { None }
    }
}
