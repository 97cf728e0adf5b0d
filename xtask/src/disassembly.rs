//! The machine code of an image, one instruction a line, as `llvm-objdump` shows it.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use crate::{shell, toolchain};

/// One machine instruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// In lower case with its suffixes, such as `vadd.f32` or `beq.w`.
    pub mnemonic: String,
    /// Operands after the mnemonic, without comments.
    pub operands: String,
}

impl Instruction {
    /// The mnemonic without a width suffix.
    pub fn name(&self) -> &str {
        self.mnemonic.trim_end_matches(".w").trim_end_matches(".n")
    }

    /// Target address of a branch that has it in its operands.
    pub fn target(&self) -> Option<u64> {
        let last = self.operands.rsplit(',').next()?.trim();
        let digits = last.strip_prefix("0x")?.split_whitespace().next()?;
        u64::from_str_radix(digits, 16).ok()
    }
}

/// All instructions by address.
pub type Listing = BTreeMap<u64, Instruction>;

/// Disassembles the code sections of `image`.
pub fn disassemble(image: &Path) -> Result<Listing> {
    let tool = toolchain::llvm_tool("llvm-objdump")?;
    let text = shell::output(
        std::process::Command::new(tool).args(["-d", "-z", "--no-show-raw-insn"]).arg(image),
    )
    .context("disassembly")?;
    let listing: Listing = text.lines().filter_map(parse).collect();
    ensure!(!listing.is_empty(), "no code in {}", image.display());
    Ok(listing)
}

fn parse(line: &str) -> Option<(u64, Instruction)> {
    let (address, rest) = line.split_once(':')?;
    let address = u64::from_str_radix(address.trim(), 16).ok()?;
    let rest = rest.split('@').next()?.trim();
    let (mnemonic, operands) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
    if mnemonic.is_empty() {
        return None;
    }
    let instruction =
        Instruction { mnemonic: mnemonic.to_lowercase(), operands: operands.trim().to_owned() };
    Some((address, instruction))
}

/// The number of an immediate operand, `#12` or `#0x1f`.
pub fn immediate(operand: &str) -> Option<u64> {
    let text = operand.trim().strip_prefix('#')?;
    match text.strip_prefix("0x") {
        Some(digits) => u64::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::parse;

    #[test]
    fn reads_branches_and_plain_instructions() {
        let (address, branch) =
            parse(" 8000400:      \tbl\t0x8000fce <__pre_init>  @ imm = #0xbca").unwrap();
        assert_eq!((address, branch.name(), branch.target()), (0x800_0400, "bl", Some(0x800_0fce)));
        let (_, compare) = parse(" 80004aa:\tcbz\tr0, 0x80004c0 <f+0x2> @ imm = #0x12").unwrap();
        assert_eq!((compare.name(), compare.target()), ("cbz", Some(0x800_04c0)));
        let (_, root) = parse(" 80004ac:      \tvsqrt.f32\ts0, s1").unwrap();
        assert_eq!((root.name(), root.target()), ("vsqrt.f32", None));
        assert_eq!(parse("08000400 <__stext>:"), None);
    }
}
