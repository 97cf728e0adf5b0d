//! Stack depth by painting: fill the memory below the stack pointer, see later what was overwritten.

use core::ptr;

const COLOUR: u32 = 0x57AC_4A4E;
const WORDS: usize = 256;

/// 1 KiB of painted memory directly below the caller's stack frame.
pub struct Paint {
    top: *mut u32,
}

impl Paint {
    /// Paints below the current stack pointer. Both functions are inlined and call nothing.
    #[inline(always)]
    pub fn below_here() -> Self {
        let top = ptr::with_exposed_provenance_mut(cortex_m::register::msp::read() as usize);
        let paint = Self { top };
        for index in 1..=WORDS {
            // SAFETY: unused stack memory of this single-threaded image without interrupts; RAM
            // is far larger than what is in use plus the painted part.
            unsafe { ptr::write_volatile(paint.top.wrapping_sub(index), COLOUR) };
        }
        paint
    }

    /// Depth below the painting frame that was written to since (B).
    #[inline(always)]
    pub fn depth(&self) -> u32 {
        for index in (1..=WORDS).rev() {
            // SAFETY: as for painting.
            if unsafe { ptr::read_volatile(self.top.wrapping_sub(index)) } != COLOUR {
                return index as u32 * 4;
            }
        }
        0
    }
}
