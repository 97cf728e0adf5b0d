//! TIM2, which counts instructions in the emulator when that runs with `-icount shift=0`.

use core::ptr;

const TIM2: usize = 0x4000_0000;
const CR1: *mut u32 = ptr::with_exposed_provenance_mut(TIM2);
const EGR: *mut u32 = ptr::with_exposed_provenance_mut(TIM2 + 0x14);
const CNT: *mut u32 = ptr::with_exposed_provenance_mut(TIM2 + 0x24);
const PSC: *mut u32 = ptr::with_exposed_provenance_mut(TIM2 + 0x28);
const ARR: *mut u32 = ptr::with_exposed_provenance_mut(TIM2 + 0x2C);

/// Starts it without prescaler.
pub fn start() {
    // SAFETY: the timer's registers; nothing else uses them.
    unsafe {
        ptr::write_volatile(PSC, 0);
        ptr::write_volatile(ARR, u32::MAX);
        ptr::write_volatile(EGR, 1);
        ptr::write_volatile(CR1, 1);
    }
}

/// Ticks since the start.
#[inline(always)]
pub fn ticks() -> u32 {
    // SAFETY: as above.
    unsafe { ptr::read_volatile(CNT) }
}
