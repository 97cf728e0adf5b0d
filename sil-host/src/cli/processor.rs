//! Check of the processor: the project's own `.cargo/config.toml` builds for x86-64-v3.

/// Extensions of x86-64-v3 that this build uses and the processor lacks, by name.
///
/// Asks the processor itself: the standard library's macro takes for granted what the build assumes.
#[cfg(target_arch = "x86_64")]
pub fn missing_extensions() -> Vec<&'static str> {
    use core::arch::x86_64::{__cpuid, __cpuid_count};
    let basic = __cpuid(1).ecx;
    let structured = if __cpuid(0).eax >= 7 { __cpuid_count(7, 0).ebx } else { 0 };
    let extended =
        if __cpuid(0x8000_0000).eax > 0x8000_0000 { __cpuid(0x8000_0001).ecx } else { 0 };
    let (avx, avx2) = (cfg!(target_feature = "avx"), cfg!(target_feature = "avx2"));
    let (fma, bmi2) = (cfg!(target_feature = "fma"), cfg!(target_feature = "bmi2"));
    let lzcnt = cfg!(target_feature = "lzcnt");
    [
        ("AVX", avx, basic, 28),
        ("OSXSAVE", avx, basic, 27),
        ("FMA", fma, basic, 12),
        ("AVX2", avx2, structured, 5),
        ("BMI2", bmi2, structured, 8),
        ("LZCNT", lzcnt, extended, 5),
    ]
    .into_iter()
    .filter(|(_, used, register, bit)| *used && register >> bit & 1 == 0)
    .map(|(name, ..)| name)
    .collect()
}

/// Extensions that this build uses and the processor lacks: none are checked on this architecture.
#[cfg(not(target_arch = "x86_64"))]
pub fn missing_extensions() -> Vec<&'static str> {
    Vec::new()
}
