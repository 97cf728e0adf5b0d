//! Code that must not get a worst-case bound, or one that is too high: compiled mutants for
//! `cargo xtask wcet`. The image is analysed and never run.
#![no_std]
#![no_main]

use core::arch::asm;
use core::hint::black_box;

use cortex_m_rt::entry;
use step_image as _; // panic handler

/// A loop whose iterations depend on an argument.
#[unsafe(no_mangle)]
#[inline(never)]
fn mutant_loop(iterations: u32) -> u32 {
    let mut sum = 0;
    for index in 0..iterations {
        sum += black_box(index);
    }
    sum
}

/// A loop that is limited over calls of a function which does not call this one.
#[unsafe(no_mangle)]
#[inline(never)]
fn mutant_scope(iterations: u32) -> u32 {
    let mut sum = 0;
    // wcet: at most 3 iterations in all of mutant_loop
    for index in 0..iterations {
        sum ^= black_box(index);
    }
    sum
}

/// Calls itself.
#[unsafe(no_mangle)]
#[inline(never)]
fn mutant_recursion(depth: u32) -> u32 {
    if depth == 0 { 0 } else { 1 + black_box(mutant_recursion(depth - 1)) }
}

/// Calls through a pointer.
#[unsafe(no_mangle)]
#[inline(never)]
fn mutant_pointer(function: fn(u32) -> u32, argument: u32) -> u32 {
    1 + function(argument)
}

/// A short function with a branch of 500 instructions that is taken for a single argument.
#[unsafe(no_mangle)]
#[inline(never)]
fn mutant_branch(argument: u32) -> u32 {
    if argument == 0x1234_5678 {
        // SAFETY: instructions without any effect.
        unsafe { asm!(".rept 500", "nop", ".endr", options(nomem, nostack, preserves_flags)) };
    }
    argument.wrapping_mul(3)
}

#[entry]
fn main() -> ! {
    black_box(mutant_loop(black_box(1)));
    black_box(mutant_scope(black_box(1)));
    black_box(mutant_recursion(black_box(1)));
    black_box(mutant_pointer(black_box(mutant_loop), 1));
    black_box(mutant_branch(black_box(1)));
    step_image::refuse()
}
