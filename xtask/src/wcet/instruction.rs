//! The instructions that a bound may contain: kind and control flow of each.

use anyhow::{Context, Result, bail, ensure};

use crate::disassembly::Instruction;

/// Kind of an instruction, which decides its cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One cycle.
    Plain,
    /// Multiplication with accumulation in core registers.
    Double,
    /// Integer division.
    Divide,
    /// Load into registers.
    Load,
    /// Store of registers.
    Store,
    /// Floating-point arithmetic, comparison or conversion.
    Float,
    /// Floating-point multiplication with accumulation.
    FloatAccumulate,
    /// Floating-point division or square root.
    FloatDivide,
    /// Move between floating-point and core registers.
    FloatMove,
    /// Branch, call or return.
    Branch,
    /// Barrier, or access to a special register.
    System,
}

/// Continuation of an instruction besides the next one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// Only the next instruction.
    Next,
    /// Always to this address.
    Jump(u64),
    /// To this address or to the next instruction.
    Branch(u64),
    /// To the function at this address, then to the next instruction.
    Call(u64),
    /// Out of the function.
    Return,
    /// To one of several places, whose offsets are in a table of bytes or, if `wide`, half-words behind the
    /// instruction.
    Table {
        /// Entries of two bytes.
        wide: bool,
    },
    /// Into a fault: nothing follows.
    Trap,
}

/// A decoded instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decoded {
    /// Kind.
    pub kind: Kind,
    /// Continuation.
    pub flow: Flow,
}

const CONDITIONS: [&str; 15] =
    ["eq", "ne", "hs", "lo", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le", "al"];

/// Every known instruction without condition, width and type; the rest is refused.
const KNOWN: &[(Kind, &str)] = &[
    (Kind::Plain, "mov movs movw movt mvn mvns add adds addw adc adcs adr nop"),
    (Kind::Plain, "sub subs subw sbc sbcs rsb rsbs cmp cmn tst teq clz rbit rev rev16"),
    (Kind::Plain, "and ands orr orrs orn orns eor eors bic bics bfi bfc ubfx sbfx"),
    (Kind::Plain, "lsl lsls lsr lsrs asr asrs ror rors uxtb uxth sxtb sxth"),
    (
        Kind::Plain,
        "mul muls umull smull uadd8 uqadd16 uqadd8 uxtah uxtab sxtah sxtab sel usat ssat pkhbt rrx rrxs rev rev16 smulbb smulbt smultb smultt smlabb qadd qsub revsh",
    ),
    (Kind::Double, "mla mls umlal smlal"),
    (Kind::Divide, "udiv sdiv"),
    (Kind::Load, "ldr ldrb ldrh ldrsb ldrsh ldrd ldm ldmdb pop vldr vldmia vldmdb vpop"),
    (Kind::Load, "ldrex ldrexb ldrexh"),
    (Kind::Store, "str strb strh strd stm stmdb push vstr vstmia vstmdb vpush"),
    (Kind::Store, "strex strexb strexh"),
    (Kind::Float, "vadd vsub vmul vnmul vabs vneg vcmp vcmpe vcvt vcvtr"),
    (Kind::FloatAccumulate, "vmla vmls vnmla vnmls vfma vfms vfnma vfnms"),
    (Kind::FloatDivide, "vdiv vsqrt"),
    (Kind::FloatMove, "vmov vmrs vmsr"),
    (Kind::System, "mrs msr dmb dsb isb cpsid cpsie clrex"),
];

/// Number of instructions that `instruction` makes conditional; zero if it is no IT instruction.
pub fn covered_by_it(instruction: &Instruction) -> usize {
    let name = instruction.name();
    let pattern = name.strip_prefix("it").filter(|rest| rest.chars().all(|c| "te".contains(c)));
    pattern.filter(|rest| rest.len() < 4).map_or(0, |rest| rest.len() + 1)
}

/// Decodes an instruction; `conditional` inside an IT block. Fails on everything that a bound
/// cannot contain.
pub fn decode(instruction: &Instruction, conditional: bool) -> Result<Decoded> {
    let shown = || format!("`{} {}`", instruction.mnemonic, instruction.operands);
    let stem = stem(instruction, conditional).with_context(shown)?;
    ensure!(
        !writes_double(instruction, stem),
        "{} is a double-precision instruction, which the Cortex-M4F does not have",
        shown()
    );
    ensure!(
        !instruction.operands.contains('{') || !instruction.operands.contains('-'),
        "{} has a range of registers, whose words are not counted",
        shown()
    );
    if let Some(flow) = branch(instruction, stem).with_context(shown)? {
        return Ok(Decoded { kind: Kind::Branch, flow });
    }
    if covered_by_it(instruction) > 0 {
        return Ok(Decoded { kind: Kind::Plain, flow: Flow::Next });
    }
    let known = KNOWN.iter().find(|(_, names)| names.split(' ').any(|name| name == stem));
    let (kind, _) = known.with_context(|| {
        format!(
            "unknown instruction {}: add it to KNOWN in xtask/src/wcet/instruction.rs with its \
             kind from the Cortex-M4 technical reference manual",
            shown()
        )
    })?;
    let flow = if writes_pc(instruction, stem) { returns(instruction, stem)? } else { Flow::Next };
    Ok(Decoded { kind: *kind, flow })
}

/// The name without width, type and, in an IT block, condition.
fn stem(instruction: &Instruction, conditional: bool) -> Result<&str> {
    let stem = instruction.mnemonic.split('.').next().unwrap_or_default();
    if !conditional {
        return Ok(stem);
    }
    let bare = CONDITIONS.iter().find_map(|condition| stem.strip_suffix(condition));
    bare.context("an instruction without condition in an IT block")
}

/// `true` for arithmetic on double registers; moves, loads and stores of these are bits only.
fn writes_double(instruction: &Instruction, stem: &str) -> bool {
    instruction.mnemonic.contains(".f64") && stem != "vmov"
}

fn branch(instruction: &Instruction, stem: &str) -> Result<Option<Flow>> {
    let target = || instruction.target().context("a branch without address");
    let flow = match stem {
        "b" => Flow::Jump(target()?),
        "bl" => Flow::Call(target()?),
        "cbz" | "cbnz" => Flow::Branch(target()?),
        "bx" if instruction.operands == "lr" => Flow::Return,
        "bx" | "blx" => bail!("indirect: the target is in a register and cannot be followed"),
        "tbb" | "tbh" => Flow::Table { wide: stem == "tbh" },
        "udf" | "trap" => Flow::Trap, // the latter is llvm's name of `udf #0xfe`
        _ => match stem.strip_prefix('b') {
            Some(rest) if CONDITIONS.contains(&rest) => Flow::Branch(target()?),
            _ => return Ok(None),
        },
    };
    Ok(Some(flow))
}

/// `true` if the program counter is a destination.
fn writes_pc(instruction: &Instruction, stem: &str) -> bool {
    let operands = instruction.operands.as_str();
    let list = operands.split(['{', '}']).nth(1).unwrap_or_default();
    let loaded = (stem.starts_with("ldm") || stem == "pop")
        && list.split(',').any(|register| register.trim() == "pc");
    loaded || operands == "pc" || operands.starts_with("pc,")
}

/// Loads of the program counter from the stack return; nothing else may write it.
fn returns(instruction: &Instruction, stem: &str) -> Result<Flow> {
    let operands = instruction.operands.as_str();
    let from_stack = stem == "pop"
        || (stem == "ldm" && operands.starts_with("sp!"))
        || (stem == "ldr" && operands.starts_with("pc, [sp], #"));
    ensure!(
        from_stack,
        "indirect: `{} {operands}` writes the program counter and cannot be followed",
        instruction.mnemonic
    );
    Ok(Flow::Return)
}

#[cfg(test)]
mod tests {
    use super::{Decoded, Flow, Kind, covered_by_it, decode};
    use crate::disassembly::Instruction;

    fn instruction(text: &str) -> Instruction {
        let (mnemonic, operands) = text.split_once(' ').unwrap_or((text, ""));
        Instruction { mnemonic: mnemonic.into(), operands: operands.into() }
    }

    #[test]
    fn kinds_and_flow_of_known_instructions() {
        for (text, conditional, kind, flow) in [
            ("vadd.f32 s0, s1, s2", false, Kind::Float, Flow::Next),
            ("vmovmi.f32 s0, s1", true, Kind::FloatMove, Flow::Next),
            ("lslsne.w r0, r1, #0x2", true, Kind::Plain, Flow::Next),
            ("ble 0x10 <f>", false, Kind::Branch, Flow::Branch(0x10)),
            ("bleq 0x10 <f>", true, Kind::Branch, Flow::Call(0x10)),
            ("b.w 0x10 <f>", false, Kind::Branch, Flow::Jump(0x10)),
            ("bxhs lr", true, Kind::Branch, Flow::Return),
            ("cbnz r0, 0x10 <f>", false, Kind::Branch, Flow::Branch(0x10)),
            ("pop.w {r4, r8, pc}", false, Kind::Load, Flow::Return),
            ("ldr pc, [sp], #4", false, Kind::Load, Flow::Return),
            ("ldr r0, [pc, #0x38]", false, Kind::Load, Flow::Next),
            ("bic r0, r1, #0x1", false, Kind::Plain, Flow::Next),
            ("ittte ne", false, Kind::Plain, Flow::Next),
            ("tbh [pc, r10, lsl #1]", false, Kind::Branch, Flow::Table { wide: true }),
            ("udf #0xfe", false, Kind::Branch, Flow::Trap),
            ("trap ", false, Kind::Branch, Flow::Trap),
            ("msr basepri_max, r0", false, Kind::System, Flow::Next),
        ] {
            let decoded = decode(&instruction(text), conditional).unwrap();
            assert_eq!(decoded, Decoded { kind, flow }, "{text}");
        }
    }

    #[test]
    fn an_it_instruction_covers_up_to_four() {
        for (text, covered) in [("it ne", 1), ("ite eq", 2), ("itttt mi", 4), ("mov r0, r1", 0)] {
            assert_eq!(covered_by_it(&instruction(text)), covered, "{text}");
        }
    }

    #[test]
    fn what_cannot_be_followed_or_timed_is_refused() {
        for (text, conditional, reason) in [
            ("blx r3", false, "indirect"),
            ("bx r0", false, "indirect"),
            ("mov pc, r1", false, "indirect"),
            ("ldr.w pc, [r0, r1, lsl #2]", false, "indirect"),
            ("ldm.w r0, {r1, pc}", false, "indirect"),
            ("vpush {d8-d10}", false, "range"),
            ("svc #0x0", false, "unknown"),
            ("bkpt #0xab", false, "unknown"),
            ("40 00 20 <.word>", false, "unknown"),
            ("vadd.f64 d0, d1, d2", false, "double-precision"),
            ("mov r0, r1", true, "without condition"),
            ("moveq r0, r1", false, "unknown"),
        ] {
            let error = format!("{:#}", decode(&instruction(text), conditional).unwrap_err());
            assert!(error.contains(reason), "{text}: {error}");
        }
    }
}
