//! Cycles of the Cortex-M4F, estimated from the executed instructions.
//!
//! From the instruction timing tables of the Cortex-M4 technical reference manual (ARM 100166,
//! tables 3-1 and 7-1), taken to the slow side: no load is pipelined behind another, every branch
//! is taken and refills the pipeline in 3 cycles, and divisions take their longest. Left out:
//! wait states of the flash (the STM32F405's accelerator hides most), stalls between dependent
//! floating-point instructions, and interrupts. So it is an estimate; the bound is in `wcet`.

use crate::call_graph::is_direct_branch;
use crate::disassembly::Instruction;

/// Pipeline refill `P` after a taken branch: 1 to 3.
pub const REFILL: u64 = 3;
/// Core clock of the STM32F405 (Hz).
pub const CLOCK: f64 = 168e6;

/// Cycles of one instruction; of a conditional branch, when taken.
pub fn cycles(instruction: &Instruction) -> u64 {
    let (name, operands) = (instruction.name(), instruction.operands.as_str());
    let stem = name.split('.').next().unwrap_or(name);
    let to_pc = if operands.contains("pc}") || operands.starts_with("pc,") { REFILL } else { 0 };
    let has = |prefixes: &[&str]| prefixes.iter().any(|prefix| stem.starts_with(prefix));
    if is_direct_branch(name) || stem.starts_with("bx") || stem.starts_with("blx") {
        1 + REFILL
    } else if stem == "tbb" || stem == "tbh" {
        2 + REFILL
    } else if has(&["vsqrt", "vdiv"]) {
        14
    } else if has(&["udiv", "sdiv"]) {
        12
    } else if has(&["vmla", "vmls", "vnmla", "vnmls", "vfma", "vfms", "vfnma", "vfnms"]) {
        3
    } else if has(&["vldm", "vstm", "vpush", "vpop", "ldm", "stm", "push", "pop"]) {
        1 + registers(operands) + to_pc
    } else if has(&["ldrd", "strd"]) {
        3
    } else if has(&["vldr", "vstr"]) {
        if operands.starts_with('d') { 3 } else { 2 }
    } else if has(&["ldr", "str"]) {
        2 + to_pc
    } else if has(&["mla", "mls"]) || moves_two(stem, operands) {
        2
    } else {
        1
    }
}

/// `vmov` between two core registers and two single registers.
fn moves_two(stem: &str, operands: &str) -> bool {
    stem == "vmov" && operands.split(',').count() > 2
}

/// Words named by a register list such as `{r4, r5, lr}`, `{s0, s1}` or `{d8, d9}`.
pub fn registers(operands: &str) -> u64 {
    let list = operands.split(['{', '}']).nth(1).unwrap_or("");
    let names = list.split(',').map(str::trim).filter(|name| !name.is_empty());
    names.map(|name| if name.starts_with('d') { 2 } else { 1 }).sum()
}

#[cfg(test)]
mod tests {
    use super::cycles;
    use crate::disassembly::Instruction;

    #[test]
    fn timings_are_those_of_the_manual() {
        for (mnemonic, operands, expected) in [
            ("vadd.f32", "s0, s1, s2", 1),
            ("vmla.f32", "s0, s1, s2", 3),
            ("vdiv.f32", "s0, s1, s2", 14),
            ("vsqrt.f32", "s0, s0", 14),
            ("vldr", "s0, [r0, #0x8]", 2),
            ("vpush", "{d8, d9, d10}", 7),
            ("push.w", "{r4, r5, lr}", 4),
            ("pop", "{r4, pc}", 6),
            ("bl", "0x8000400 <f>", 4),
            ("beq", "0x8000400 <f>", 4),
            ("bic", "r0, r0, #0x1", 1),
            ("ldr", "r0, [pc, #0x8]", 2),
            ("strd", "r0, r1, [r2]", 3),
            ("add.w", "r0, r0, #0x1", 1),
            ("udiv", "r0, r0, r1", 12),
        ] {
            let instruction = Instruction { mnemonic: mnemonic.into(), operands: operands.into() };
            assert_eq!(cycles(&instruction), expected, "{mnemonic} {operands}");
        }
    }
}
