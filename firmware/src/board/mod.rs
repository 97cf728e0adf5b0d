//! The only module that touches registers: one trait, one file per board.
//!
//! [`Active`] is the board that the features choose. What the boards share, because the chip is the
//! same, is in [`peripherals`].

#[cfg(feature = "emulator")]
mod emulator;
#[cfg(not(feature = "emulator"))]
mod f405;
#[cfg(not(feature = "emulator"))]
mod parameter_flash;
pub mod peripherals;
pub mod transmitter;

#[cfg(feature = "emulator")]
pub use emulator::Emulator as Active;
#[cfg(not(feature = "emulator"))]
pub use f405::F405 as Active;

use cortex_m::peripheral::{DCB, DWT};
use embedded_hal::pwm::SetDutyCycle;
use embedded_storage::nor_flash::NorFlash;
use link::FaultReport;
use stm32f4xx_hal::gpio::{PA6, PA7, PB0, PB1};
use stm32f4xx_hal::pac::{FLASH, TIM3, TIM5, USART2};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Config, Rcc};
use stm32f4xx_hal::serial::{Rx, Tx};

pub use crate::vehicle::ROTORS;

#[cfg(all(feature = "board", feature = "emulator"))]
compile_error!("choose one build variant: the feature `board` or the feature `emulator`");

/// The timer and the pins of the rotor outputs, in rotor order.
pub struct RotorPins(pub PA6, pub PA7, pub PB0, pub PB1);

/// Properties of one board.
pub trait Board: Sized {
    /// One rotor output.
    type Rotor: SetDutyCycle + Send;

    /// Memory for parameters: two sectors to erase.
    type Storage: NorFlash + Send;

    /// Frequency that SysTick counts (Hz).
    const CORE_CLOCK: u32;

    /// Frequency that the stopwatch timer TIM2 counts before its prescaler (Hz).
    const STOPWATCH_CLOCK: u32;

    /// Name of the board on the link, at most 24 bytes.
    const NAME: &'static str;

    /// Fewest ticks from one telemetry to the next that the link can carry.
    const TELEMETRY_PERIOD_MIN: u16;

    /// Starts the counter of [`cost`](Self::cost).
    fn start_cost_counter(dwt: &mut DWT, dcb: &mut DCB, timer: TIM5, rcc: &mut Rcc);

    /// Processor time spent so far: cycles, or instructions in the emulator; wraps.
    fn cost() -> u32;

    /// Clock tree to set up.
    fn clocks() -> Config;

    /// Takes the rotor outputs; none gives a pulse yet.
    fn rotors(timer: TIM3, pins: RotorPins, rcc: &mut Rcc) -> [Self::Rotor; ROTORS];

    /// Takes the memory for parameters.
    fn storage(flash: FLASH) -> Self::Storage;

    /// Ends every pulse now, from any context, whichever task owns the outputs: the last action of a
    /// failing program before it resets.
    fn outputs_off();

    /// Reports the fault before this boot to a person, beyond log and telemetry.
    fn report(_report: &FaultReport) {}

    /// Hands over what has come from the link: one byte, since another one interrupts again.
    #[inline(always)]
    fn receive(receiver: &mut Rx<USART2>, mut take: impl FnMut(u8)) {
        if let Ok(byte) = receiver.read() {
            take(byte);
        }
    }

    /// Sends a frame.
    fn transmit(transmitter: &mut Tx<USART2>, frame: &[u8]) {
        transmit(transmitter, frame);
    }

    /// Hook after the telemetry group has sent all, in which the emulator waits for its host.
    #[inline(always)]
    fn exchange() {}

    /// Time without a step after which lock step ends (s).
    fn lock_step_timeout() -> u32 {
        20
    }

    /// Waits for the next interrupt, or for a moment.
    #[inline(always)]
    fn idle() {
        cortex_m::asm::wfi();
    }

    /// Hook at every control tick, in which the emulator ends a run or provokes a fault.
    #[inline(always)]
    fn exercise(_tick: u32) {}
}

/// Sends a frame over the wire; each byte waits at most for the one before it.
fn transmit(transmitter: &mut Tx<USART2>, frame: &[u8]) {
    // wcet: at most 201 iterations
    for byte in frame {
        transmit_byte(transmitter, *byte);
    }
}

/// Waits until the byte before has left, 10 bits at 2 Mbit/s.
#[inline(never)]
fn transmit_byte(transmitter: &mut Tx<USART2>, byte: u8) {
    // wcet: at most 5 us
    while transmitter.write(byte).is_err() {}
}
