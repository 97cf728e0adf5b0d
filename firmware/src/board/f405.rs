//! A board with an STM32F405RG and an 8 MHz crystal, such as the Olimex STM32-H405.
//!
//! | pin | use |
//! |---|---|
//! | PA2, PA3 | USART2 transmit, receive: the link |
//! | PA6, PA7, PB0, PB1 | TIM3 channels 1 to 4: rotors 1 to 4 |
//! | PB10, PB11 | USART3 transmit, receive: MAVLink, 921,600 bit/s |
//! | PA13, PA14 | SWDIO, SWCLK: probe, log over RTT |

use cortex_m::peripheral::{DCB, DWT};
use stm32f4xx_hal::pac::{FLASH, TIM3, TIM5};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Config, Rcc};
use stm32f4xx_hal::timer::pwm::ErasedChannel;

use super::parameter_flash::ParameterFlash;
use super::{Board, ROTORS, RotorPins};
use crate::rotor_output::PULSE_RATE;

/// See the module's documentation.
pub struct F405;

impl Board for F405 {
    type Rotor = ErasedChannel<TIM3>;
    type Storage = ParameterFlash;

    const CORE_CLOCK: u32 = 168_000_000;

    /// Timers of APB1 run at twice its 42 MHz.
    const STOPWATCH_CLOCK: u32 = 84_000_000;

    const NAME: &'static str = "STM32F405";

    /// A frame of telemetry is some 170 bytes: 0.85 ms at 2 Mbit/s.
    const TELEMETRY_PERIOD_MIN: u16 = 2;

    fn clocks() -> Config {
        Config::hse(8.MHz()).sysclk(Self::CORE_CLOCK.Hz())
    }

    fn rotors(timer: TIM3, pins: RotorPins, rcc: &mut Rcc) -> [Self::Rotor; ROTORS] {
        let (_, (ch1, ch2, ch3, ch4)) = timer.pwm_hz(PULSE_RATE.Hz(), rcc);
        let mut ch1 = ch1.with(pins.0);
        let mut ch2 = ch2.with(pins.1);
        let mut ch3 = ch3.with(pins.2);
        let mut ch4 = ch4.with(pins.3);
        ch1.enable();
        ch2.enable();
        ch3.enable();
        ch4.enable();
        [ch1.erase(), ch2.erase(), ch3.erase(), ch4.erase()]
    }

    fn storage(flash: FLASH) -> ParameterFlash {
        ParameterFlash::new(flash)
    }

    /// The processor's own cycle counter.
    fn start_cost_counter(dwt: &mut DWT, dcb: &mut DCB, _: TIM5, _: &mut Rcc) {
        dcb.enable_trace();
        dwt.enable_cycle_counter();
    }

    #[inline(always)]
    fn cost() -> u32 {
        DWT::cycle_count()
    }

    fn outputs_off() {
        // SAFETY: only the output-enable bits of TIM3 are written, in one store, and the caller
        // never returns to the code that owns the timer.
        unsafe { TIM3::steal() }.ccer().reset();
    }
}
