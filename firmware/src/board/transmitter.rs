//! Transmission of messages to the host, and of frames to a ground station.

use link::{Downlink, Encoder, MAX_FRAME};
use stm32f4xx_hal::pac::{USART2, USART3};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::serial::Tx;

use super::peripherals::now;
use super::{Active, Board};

/// Sends messages to the host.
pub struct Transmitter {
    wire: Tx<USART2>,
    encoder: Encoder<Downlink>,
}

impl Transmitter {
    /// Sends over `wire` from now on.
    #[must_use]
    pub fn new(wire: Tx<USART2>) -> Self {
        Self { wire, encoder: Encoder::default() }
    }

    /// Sends one message; returns the time that the wire took (us).
    pub fn send(&mut self, message: &Downlink) -> u32 {
        let mut frame = [0; MAX_FRAME];
        // Every message of the core fits a frame (tested there).
        let Ok(frame) = self.encoder.encode(message, &mut frame) else { return 0 };
        let start = now();
        Active::transmit(&mut self.wire, frame);
        now().wrapping_sub(start)
    }
}

/// Most looks at the wire for one byte: over a millisecond, a hundred times the byte's own time. No clear-to-send
/// is used, so that more means a wire that is not clocked.
const LOOKS: u32 = 50_000;

/// Sends frames of MAVLink.
pub struct MavlinkTransmitter(Tx<USART3>);

impl MavlinkTransmitter {
    /// Sends over `wire` from now on.
    #[must_use]
    pub fn new(wire: Tx<USART3>) -> Self {
        Self(wire)
    }

    /// Sends a frame, byte by byte, or drops the rest of it.
    pub fn send(&mut self, frame: &[u8]) {
        // wcet: at most 280 iterations
        for byte in frame {
            // wcet: at most LOOKS iterations
            if !(0..LOOKS).any(|_| self.0.write(*byte).is_ok()) {
                return;
            }
        }
    }
}
