//! Panic and hard fault: outputs off, evidence kept, reset. The next boot calls [`take_evidence`].

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use link::{FaultKind, FaultReport, REGISTERS};

use crate::board::{Active, Board};
use crate::evidence::{self, WORDS};

/// Control ticks since the start. Kept over a reset, for a watchdog leaves nothing else.
#[unsafe(link_section = ".evidence.uptime")]
pub static UPTIME: AtomicU32 = AtomicU32::new(0);

/// Memory that start-up code leaves alone (`memory.x`).
struct Kept(UnsafeCell<MaybeUninit<[u32; WORDS]>>);

// SAFETY: written only by a fault, which never returns, and read and cleared only by
// `take_evidence`; the processor has one core.
unsafe impl Sync for Kept {}

#[unsafe(link_section = ".evidence")]
static KEPT: Kept = Kept(UnsafeCell::new(MaybeUninit::uninit()));

/// The fault before this boot, once: the evidence it left, or none but the watchdog's.
pub fn fault_before_boot(watchdog_reset: bool) -> Option<FaultReport> {
    let uptime = UPTIME.swap(0, Relaxed);
    let watchdog = || evidence::report(FaultKind::Watchdog, uptime, [0; REGISTERS]);
    take_evidence().or_else(|| watchdog_reset.then(watchdog))
}

/// Puts a report into the log.
pub fn log(report: &FaultReport) {
    defmt::error!(
        "fault before this boot: {=str} at tick {=u32}: {=str}, line {=u32}",
        evidence::kind_name(report.kind),
        report.uptime_ticks,
        report.text.as_str(),
        report.line
    );
    for (name, value) in evidence::REGISTER_NAMES.iter().zip(report.registers) {
        defmt::error!("{=str} = {=u32:#010x}", name, value);
    }
}

/// The evidence of a fault before this boot, once.
pub fn take_evidence() -> Option<FaultReport> {
    let mut words = [0; WORDS];
    let kept = KEPT.0.get().cast::<u32>();
    for (i, word) in words.iter_mut().enumerate() {
        // SAFETY: inside the array; every bit pattern of RAM is a `u32`, and the volatile read
        // keeps the compiler from assuming anything of memory that it has not written.
        *word = unsafe { kept.add(i).read_volatile() };
        // SAFETY: as above.
        unsafe { kept.add(i).write_volatile(0) };
    }
    evidence::decode(&words)
}

/// Ends every output, keeps the evidence and resets.
fn fail(kind: FaultKind, registers: [u32; REGISTERS], info: Option<&PanicInfo>) -> ! {
    cortex_m::interrupt::disable();
    Active::outputs_off();
    let mut report = evidence::report(kind, UPTIME.load(Relaxed), registers);
    if let Some(info) = info {
        describe(&mut report, info);
    }
    let kept = KEPT.0.get().cast::<u32>();
    for (i, word) in evidence::encode(&report).into_iter().enumerate() {
        // SAFETY: inside the array; interrupts are off and nobody else writes here.
        unsafe { kept.add(i).write_volatile(word) };
    }
    SCB::sys_reset()
}

/// Message and place of a panic. A message with arguments is left out, since formatting needs more
/// stack and code than a failing program should trust; its place identifies it.
fn describe(report: &mut FaultReport, info: &PanicInfo) {
    if let Some(message) = info.message().as_str() {
        evidence::append(&mut report.text, message);
    }
    if let Some(location) = info.location() {
        evidence::append(&mut report.text, " at ");
        evidence::append(&mut report.text, location.file());
        report.line = location.line();
    }
}

/// Registers that locate a fault: fault status and the active exception.
fn fault_registers() -> [u32; 6] {
    // SAFETY: reads of system registers without side effect.
    let (scb, icsr) = unsafe { (&*SCB::PTR, (*SCB::PTR).icsr.read()) };
    let msp = cortex_m::register::msp::read();
    [scb.cfsr.read(), scb.hfsr.read(), scb.mmfar.read(), scb.bfar.read(), msp, icsr]
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    let mut registers = [0; REGISTERS];
    registers[8..].copy_from_slice(&fault_registers());
    fail(FaultKind::Panic, registers, Some(info))
}

// SAFETY: never returns, and touches only what `fail` may touch.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    let [cfsr, hfsr, mmfar, bfar, msp, icsr] = fault_registers();
    let stacked = [frame.r0(), frame.r1(), frame.r2(), frame.r3(), frame.r12()];
    let [r0, r1, r2, r3, r12] = stacked;
    let (lr, pc, xpsr) = (frame.lr(), frame.pc(), frame.xpsr());
    let registers = [r0, r1, r2, r3, r12, lr, pc, xpsr, cfsr, hfsr, mmfar, bfar, msp, icsr];
    fail(FaultKind::HardFault, registers, None)
}

// SAFETY: never returns, and touches only what `fail` may touch.
#[exception]
unsafe fn DefaultHandler(_interrupt: i16) -> ! {
    let mut registers = [0; REGISTERS];
    registers[8..].copy_from_slice(&fault_registers());
    fail(FaultKind::UnexpectedInterrupt, registers, None)
}
