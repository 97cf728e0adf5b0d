//! Stack frames read off the machine code, for functions that the compiler gave no size for
//! (assembly, and what comes precompiled with the toolchain).

use anyhow::{Result, bail};

use crate::disassembly::{Instruction, immediate};

/// Bytes by which `instructions`, those of one function, lower the stack pointer: the sum of all
/// that do, even if no path meets them all. Fails when one lowers it by what a register holds.
pub fn frame<'a>(instructions: impl IntoIterator<Item = &'a Instruction>) -> Result<u64> {
    let mut frame = 0;
    for instruction in instructions {
        frame += lowering(instruction)?;
    }
    Ok(frame)
}

fn lowering(instruction: &Instruction) -> Result<u64> {
    let (name, operands) = (instruction.name(), instruction.operands.as_str());
    let shown = format!("`{} {operands}`", instruction.mnemonic);
    let list = || operands.split(['{', '}']).nth(1).unwrap_or("");
    if name.starts_with("push") || name.starts_with("vpush") {
        return Ok(bytes(list()));
    }
    let to_stack = operands.starts_with("sp!") && (name.contains("stm"));
    if to_stack {
        return Ok(bytes(list()));
    }
    if name.starts_with("sub") && operands.starts_with("sp,") {
        return match last_immediate(operands) {
            Some(bytes) => Ok(bytes),
            None => bail!("{shown} lowers the stack pointer by an unknown amount"),
        };
    }
    if name.starts_with("str") && operands.contains("[sp, #-") && operands.ends_with("]!") {
        return Ok(last_immediate(operands.trim_end_matches("]!")).unwrap_or(16));
    }
    Ok(0)
}

/// Bytes of the registers in a list; a range such as `d8-d11` does not occur in a disassembly.
fn bytes(list: &str) -> u64 {
    let names = list.split(',').map(str::trim).filter(|name| !name.is_empty());
    names.map(|name| if name.starts_with('d') { 8 } else { 4 }).sum()
}

/// The size of the number behind the last `#`.
fn last_immediate(operands: &str) -> Option<u64> {
    immediate(&operands[operands.rfind('#')?..].replace('-', ""))
}

#[cfg(test)]
mod tests {
    use super::frame;
    use crate::disassembly::Instruction;

    #[test]
    fn every_way_to_lower_the_stack_counts() {
        let code = [
            ("push.w", "{r4, r5, r6, lr}", 16),
            ("vpush", "{d8, d9}", 16),
            ("sub.w", "sp, sp, #0x1a0", 0x1a0),
            ("sub", "sp, #8", 8),
            ("str", "lr, [sp, #-4]!", 4),
            ("stmdb", "sp!, {r0, r1}", 8),
            ("sub", "r0, sp, #0x8", 0),
            ("str", "r0, [sp, #0x8]", 0),
            ("stm", "r0!, {r1, r2}", 0),
            ("pop", "{r4, pc}", 0),
        ];
        for (mnemonic, operands, bytes) in code {
            let code = [Instruction { mnemonic: mnemonic.into(), operands: operands.into() }];
            assert_eq!(frame(&code).unwrap(), bytes, "{mnemonic} {operands}");
        }
    }

    #[test]
    fn an_unknown_amount_is_refused() {
        let code = [Instruction { mnemonic: "sub.w".into(), operands: "sp, sp, r4".into() }];
        assert!(frame(&code).is_err());
    }
}
