//! Square root of an `f32`, correctly rounded (IEEE 754) on host and target alike.
//!
//! Portable Rust has no hardware square root without `std`: `libm::sqrtf` is 55 instructions on a
//! Cortex-M4F, whose `vsqrt.f32` is one. Both round correctly, so the bits agree.
//! This file holds the only `unsafe` code of the crate.

/// Square root of `x`, correctly rounded; NaN for `x < 0`.
///
/// ```
/// assert_eq!(ctrl_core::sqrt::sqrt(2.0), 1.4142135);
/// ```
#[inline(always)]
#[must_use]
pub fn sqrt(x: f32) -> f32 {
    #[cfg(any(
        all(target_arch = "arm", target_abi = "eabihf"),
        all(target_arch = "x86_64", target_feature = "sse2")
    ))]
    {
        hardware(x)
    }
    #[cfg(not(any(
        all(target_arch = "arm", target_abi = "eabihf"),
        all(target_arch = "x86_64", target_feature = "sse2")
    )))]
    {
        libm::sqrtf(x)
    }
}

/// The instruction in the encoding that the build is for. `libm` writes it out in the legacy encoding,
/// and amid AVX code the processor pays about 70 cycles for each switch between the two.
#[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
#[allow(unsafe_code)]
#[inline(always)]
fn hardware(x: f32) -> f32 {
    use core::arch::x86_64::{_mm_cvtss_f32, _mm_set_ss, _mm_sqrt_ss};
    // SAFETY: the build is for processors with SSE2, of which these are.
    unsafe { _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(x))) }
}

#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
#[allow(unsafe_code)]
#[inline(always)]
fn hardware(x: f32) -> f32 {
    let mut bits = x.to_bits();
    // The argument passes through a core register: `asm!` offers the register class `sreg` only with
    // the feature `vfp2`, which stands for double precision too and is off on a Cortex-M4F.
    // SAFETY: the hard-float ABI implies the floating-point unit; the instructions change the named
    // registers only and touch neither memory, stack nor flags.
    unsafe {
        core::arch::asm!(
            "vmov s15, {bits}",
            "vsqrt.f32 s15, s15",
            "vmov {bits}, s15",
            bits = inout(reg) bits,
            out("s15") _,
            options(pure, nomem, nostack, preserves_flags)
        );
    }
    f32::from_bits(bits)
}

#[cfg(test)]
mod tests {
    use super::sqrt;

    #[test]
    fn rounds_like_the_double_precision_root() {
        // sqrt in f64 rounded to f32 is the correctly rounded f32 root (53 >= 2 * 24 + 2).
        let mut bits = 1u32;
        while bits < f32::INFINITY.to_bits() {
            let x = f32::from_bits(bits);
            assert_eq!(sqrt(x), f64::from(x).sqrt() as f32, "x = {x:e}");
            bits += 65_521;
        }
        assert_eq!(sqrt(0.0), 0.0);
        assert_eq!(sqrt(f32::INFINITY), f32::INFINITY);
        assert!(sqrt(-1.0).is_nan());
    }
}
