//! Transmission of messages to the host.

use link::{Downlink, Encoder, MAX_FRAME};
use stm32f4xx_hal::pac::USART2;
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
