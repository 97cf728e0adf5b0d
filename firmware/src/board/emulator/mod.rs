//! QEMU's `netduinoplus2`: an STM32F405 whose peripherals are partly there.
//!
//! The clock tree is a stub whose ready flags never rise, so it stays at reset; the processor
//! runs at a fixed 168 MHz and timers count 1 GHz all the same. Rotors are recorded, not driven.
//!
//! Directives of the command line (`emulate.sh IMAGE ticks=5000 provoke=panic`):
//!
//! | directive | meaning |
//! |---|---|
//! | `ticks=N` | end the run with success at control tick N |
//! | `provoke=panic`, `hard-fault`, `overrun` | do so from tick 500 on, unless after a fault |
//! | `link=PATH` | the link in lock step over FIFOs, see [`lockstep`] |
//! | `lock-step-timeout=N` | lock step ends after N seconds of virtual time without a step |
//! | `parameters=PATH` | the file that parameters are kept in, see [`parameter_file`] |
//!
//! Without a link, a boot after a fault writes the report to standard error as plain text and ends
//! the run.

mod lockstep;
mod parameter_file;

use core::convert::Infallible;
use core::sync::atomic::{AtomicU8, AtomicU16, AtomicU32, Ordering::Relaxed};

use cortex_m::peripheral::{DCB, DWT};
use embedded_hal::pwm::{ErrorType, SetDutyCycle};
use link::FaultReport;
use semihosting::{eprintln, process};
use stm32f4xx_hal::pac::{FLASH, Interrupt, TIM3, TIM5, USART2};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Config, Rcc};
use stm32f4xx_hal::serial::{Rx, Tx};

use parameter_file::ParameterFile;

use super::{Board, ROTORS, RotorPins};
use crate::evidence::{REGISTER_NAMES, kind_name};
use crate::rotor_output::PULSE_RATE;

/// See the module's documentation.
pub struct Emulator;

impl Board for Emulator {
    type Rotor = RotorRecorder;
    type Storage = ParameterFile;

    const CORE_CLOCK: u32 = 168_000_000;
    const STOPWATCH_CLOCK: u32 = 1_000_000_000;
    const NAME: &'static str = "emulated STM32F405";
    const TELEMETRY_PERIOD_MIN: u16 = 1;

    fn clocks() -> Config {
        read_directives();
        Config::hsi()
    }

    fn rotors(_: TIM3, _: RotorPins, _: &mut Rcc) -> [Self::Rotor; ROTORS] {
        [RotorRecorder(0), RotorRecorder(1), RotorRecorder(2), RotorRecorder(3)]
    }

    fn storage(_: FLASH) -> ParameterFile {
        ParameterFile::take()
    }

    /// TIM5, at one count for the 8 ns that an instruction takes under `-icount shift=3`.
    fn start_cost_counter(_: &mut DWT, _: &mut DCB, timer: TIM5, _: &mut Rcc) {
        timer.psc().write(|w| w.psc().set(7));
        timer.arr().write(|w| w.arr().set(u32::MAX));
        timer.egr().write(|w| w.ug().set_bit());
        timer.cr1().write(|w| w.cen().set_bit());
    }

    #[inline(always)]
    fn cost() -> u32 {
        // SAFETY: one read of a counter that nobody writes after the start.
        unsafe { TIM5::steal() }.cnt().read().bits()
    }

    fn outputs_off() {
        for duty in &RECORDED {
            duty.store(0, Relaxed);
        }
    }

    fn report(report: &FaultReport) {
        eprintln!("fault before this boot: {}", kind_name(report.kind));
        eprintln!("text: {}", report.text);
        eprintln!("line: {}", report.line);
        eprintln!("uptime: {} ticks", report.uptime_ticks);
        for (name, value) in REGISTER_NAMES.iter().zip(report.registers) {
            eprintln!("{name}: {value:#010x}");
        }
        FAULT.store(u8::MAX, Relaxed);
        if !lockstep::is_open() {
            process::exit(0);
        }
    }

    #[inline(never)]
    fn receive(receiver: &mut Rx<USART2>, mut take: impl FnMut(u8)) {
        if lockstep::receive(&mut take).is_none() {
            while let Ok(byte) = receiver.read() {
                take(byte);
            }
        }
    }

    #[inline(never)]
    fn transmit(transmitter: &mut Tx<USART2>, frame: &[u8]) {
        if lockstep::is_open() {
            lockstep::transmit(frame);
        } else {
            super::transmit(transmitter, frame);
        }
    }

    #[inline(never)]
    fn exchange() {
        if lockstep::exchange() {
            cortex_m::peripheral::NVIC::pend(Interrupt::USART2);
        }
    }

    /// Idle time passes some hundred times as fast as on the wall: long enough for a busy host.
    fn lock_step_timeout() -> u32 {
        LOCK_STEP_TIMEOUT.load(Relaxed)
    }

    /// Lets time pass in large blocks that are quick to emulate. Waiting for an interrupt would let
    /// QEMU 7.2 skip every second tick (`sleep=off`) or wake late by the machine's load.
    fn idle() {
        // SAFETY: instructions that do nothing.
        unsafe { core::arch::asm!(".rept 512", "nop", ".endr", options(nomem, nostack)) };
    }

    #[inline(always)]
    fn exercise(tick: u32) {
        if tick == TICKS.load(Relaxed) {
            end_run(tick);
        } else if tick >= PROVOKE_AT {
            provoke();
        }
    }
}

/// Tick at which a fault is provoked.
const PROVOKE_AT: u32 = 500;

/// Tick that ends the run.
static TICKS: AtomicU32 = AtomicU32::new(u32::MAX);
/// Time without a step after which lock step ends (s).
static LOCK_STEP_TIMEOUT: AtomicU32 = AtomicU32::new(100_000);
/// Index of the fault to provoke in [`FAULTS`]; past its end for none.
static FAULT: AtomicU8 = AtomicU8::new(u8::MAX);
/// Latest duty cycle of each rotor.
static RECORDED: [AtomicU16; ROTORS] = [const { AtomicU16::new(0) }; ROTORS];

/// Faults of the directive `provoke`.
const FAULTS: [&str; 3] = ["panic", "hard-fault", "overrun"];

fn read_directives() {
    let Ok(arguments) = semihosting::experimental::env::args::<512>() else { return };
    for argument in arguments.into_iter().flatten() {
        if let Some(ticks) = argument.strip_prefix("ticks=").and_then(|n| n.parse().ok()) {
            TICKS.store(ticks, Relaxed);
        }
        let timeout = argument.strip_prefix("lock-step-timeout=");
        if let Some(timeout) = timeout.and_then(|n| n.parse().ok()) {
            LOCK_STEP_TIMEOUT.store(timeout, Relaxed);
        }
        if let Some(path) = argument.strip_prefix("link=") {
            lockstep::open(path);
        }
        if let Some(path) = argument.strip_prefix("parameters=") {
            parameter_file::open(path);
        }
        let fault = argument.strip_prefix("provoke=");
        if let Some(index) = FAULTS.iter().position(|name| Some(*name) == fault) {
            FAULT.store(index as u8, Relaxed);
        }
    }
}

#[cold]
#[inline(never)]
fn end_run(tick: u32) {
    let duty = RECORDED.each_ref().map(|duty| duty.load(Relaxed));
    eprintln!("end of run at tick {tick}, rotor duty {duty:?}");
    let (used, size) = stack();
    eprintln!("stack: {used} of {size} bytes used");
    process::exit(0);
}

/// Deepest use of the stack so far, from what is left of the start-up code's paint, and its size.
fn stack() -> (usize, usize) {
    unsafe extern "C" {
        static _stack_end: u32;
        static _stack_start: u32;
    }
    let (low, high) = (&raw const _stack_end, &raw const _stack_start);
    let mut lowest = low;
    // SAFETY: the linker's symbols enclose the stack, which is readable memory, word by word.
    while lowest < high && unsafe { lowest.read_volatile() } == cortex_m_rt::STACK_PAINT_VALUE {
        lowest = lowest.wrapping_add(1);
    }
    (high as usize - lowest as usize, high as usize - low as usize)
}

#[cold]
#[inline(never)]
fn provoke() {
    match FAULTS.get(usize::from(FAULT.load(Relaxed))).copied() {
        Some("panic") => panic!("provoked"),
        // SAFETY: none; reading where there is no memory is the fault that was asked for.
        Some("hard-fault") => _ = unsafe { core::ptr::read_volatile(0x6000_0000 as *const u32) },
        // Two instructions of 8 ns a count: a fifth beyond control's deadline, in every tick.
        Some("overrun") => cortex_m::asm::delay(crate::rates::TICK / 2 * 125 / 2 * 6 / 5),
        _ => {}
    }
}

/// Records the duty cycle of a rotor.
pub struct RotorRecorder(usize);

impl ErrorType for RotorRecorder {
    type Error = Infallible;
}

impl SetDutyCycle for RotorRecorder {
    /// One count is a tenth of a microsecond.
    fn max_duty_cycle(&self) -> u16 {
        (10_000_000 / PULSE_RATE) as u16
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        if let Some(recorded) = RECORDED.get(self.0) {
            recorded.store(duty, Relaxed);
        }
        Ok(())
    }
}
