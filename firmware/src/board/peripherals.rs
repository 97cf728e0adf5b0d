//! Set-up shared by every F405 board: clocks, stopwatch, control tick, link, rotors, watchdog.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use stm32f4xx_hal::pac;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::serial::{Config, Rx, Tx};
use stm32f4xx_hal::watchdog::IndependentWatchdog;

use super::{Active, Board, ROTORS, RotorPins};
use crate::rotor_output::RotorOutput;

/// Bit rate of the link (bit/s).
pub const LINK_RATE: u32 = 2_000_000;

/// Bit rate of the ground station's port (bit/s), which QGroundControl offers and most adapters know.
pub const MAVLINK_RATE: u32 = 921_600;

/// Time without a feed after which the watchdog resets the chip (ms).
pub const WATCHDOG_TIMEOUT: u32 = 250;

/// The rotor outputs of the active board.
pub type Rotors = RotorOutput<<Active as Board>::Rotor, ROTORS>;

/// Everything that the tasks own.
pub struct Peripherals {
    /// Rotor outputs, stopped.
    pub rotors: Rotors,
    /// Sends to the host.
    pub transmitter: Tx<pac::USART2>,
    /// Receives from the host; raises an interrupt for each byte.
    pub receiver: Rx<pac::USART2>,
    /// Sends to a ground station.
    pub mavlink_transmitter: Tx<pac::USART3>,
    /// Receives from a ground station; raises an interrupt for each byte.
    pub mavlink_receiver: Rx<pac::USART3>,
    /// Keeps parameters.
    pub storage: <Active as Board>::Storage,
    /// Not started yet.
    pub watchdog: IndependentWatchdog,
    /// The watchdog caused the start before this one.
    pub watchdog_reset: bool,
}

impl Peripherals {
    /// Sets up clocks and peripherals; `thrust_max` is each rotor's thrust at full speed (N).
    #[must_use]
    pub fn new(
        device: pac::Peripherals,
        core: &mut cortex_m::Peripherals,
        thrust_max: [f32; ROTORS],
    ) -> Self {
        let watchdog_reset = take_watchdog_reset(&device.RCC);
        let mut rcc = device.RCC.freeze(Active::clocks());
        Active::start_cost_counter(&mut core.DWT, &mut core.DCB, device.TIM5, &mut rcc);
        start_stopwatch(&device.TIM2, &rcc);
        let gpioa = device.GPIOA.split(&mut rcc);
        let gpiob = device.GPIOB.split(&mut rcc);
        let pins = RotorPins(gpioa.pa6, gpioa.pa7, gpiob.pb0, gpiob.pb1);
        let rotors = Active::rotors(device.TIM3, pins, &mut rcc);
        let config = Config::default().baudrate(LINK_RATE.bps());
        let serial = device.USART2.serial((gpioa.pa2, gpioa.pa3), config, &mut rcc);
        // The rate is a constant to which both clocks divide: an error is a programming error.
        let Ok(serial) = serial else { panic!("link rate") };
        let (transmitter, mut receiver) = serial.split();
        receiver.listen();
        let config = Config::default().baudrate(MAVLINK_RATE.bps());
        let serial = device.USART3.serial((gpiob.pb10, gpiob.pb11), config, &mut rcc);
        let Ok(serial) = serial else { panic!("rate of MAVLink") };
        let (mavlink_transmitter, mut mavlink_receiver) = serial.split();
        mavlink_receiver.listen();
        Self {
            rotors: RotorOutput::new(rotors, thrust_max),
            transmitter,
            receiver,
            mavlink_transmitter,
            mavlink_receiver,
            storage: Active::storage(device.FLASH),
            watchdog: IndependentWatchdog::new(device.IWDG),
            watchdog_reset,
        }
    }
}

/// Lets SysTick raise the control task's exception `rate` times a second.
pub fn start_control_tick(systick: &mut SYST, rate: u32) {
    systick.set_clock_source(SystClkSource::Core);
    systick.set_reload(Active::CORE_CLOCK / rate - 1);
    systick.clear_current();
    systick.enable_counter();
    systick.enable_interrupt();
}

/// `true` if the watchdog caused this start; clears the flag.
fn take_watchdog_reset(rcc: &pac::RCC) -> bool {
    let reset = rcc.csr().read().wdgrstf().bit_is_set();
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    reset
}

/// Lets TIM2 count microseconds.
fn start_stopwatch(timer: &pac::TIM2, rcc: &pac::RCC) {
    rcc.apb1enr().modify(|_, w| w.tim2en().set_bit());
    let prescaler = (Active::STOPWATCH_CLOCK / 1_000_000 - 1) as u16;
    timer.psc().write(|w| w.psc().set(prescaler));
    timer.arr().write(|w| w.arr().set(u32::MAX));
    timer.egr().write(|w| w.ug().set_bit());
    timer.cr1().write(|w| w.cen().set_bit());
}

/// Time since the start (us); wraps after 71 minutes.
#[inline(always)]
#[must_use]
pub fn now() -> u32 {
    // SAFETY: one read of a counter that nobody writes after the start.
    unsafe { pac::TIM2::steal() }.cnt().read().bits()
}
