//! Everything that one function can reach, from the machine code, and what must not be there.

use std::collections::BTreeMap;

use anyhow::{Context, Result, bail, ensure};

use crate::disassembly::{Instruction, Listing};
use crate::elf::{Function, Image};
use crate::frames::frame;

/// A function with its instructions and calls.
pub struct Node {
    /// Name and addresses.
    pub function: Function,
    /// Its instructions.
    pub instructions: Vec<(u64, Instruction)>,
    /// Its calls and jumps: address of the instruction, start of the function.
    pub calls: Vec<(u64, u64)>,
}

impl Node {
    /// Its own stack frame (B), as the compiler gave it or else as the code shows it.
    pub fn frame(&self, image: &Image) -> Result<u64> {
        let Function { name, range } = &self.function;
        let instructions = self.instructions.iter().map(|(_, instruction)| instruction);
        match image.stack_size(range.start) {
            Some(size) => Ok(size),
            None => frame(instructions).with_context(|| format!("stack frame of `{name}`")),
        }
    }
}

/// A function and everything reachable from it; complete, or it could not be built.
pub struct CallGraph {
    root: u64,
    nodes: BTreeMap<u64, Node>,
}

impl CallGraph {
    /// Walks all direct calls from `root`.
    ///
    /// Fails on a call or jump whose target is not in the instruction itself, and on one to where
    /// no function is: what cannot be followed cannot be vouched for.
    pub fn walk(image: &Image, listing: &Listing, root: &str) -> Result<Self> {
        Self::walk_from(image, listing, image.named(root)?.range.start)
    }

    /// As [`walk`](Self::walk), from the function that starts at `root`.
    pub fn walk_from(image: &Image, listing: &Listing, root: u64) -> Result<Self> {
        Self::walk_without(image, listing, root, &[])
    }

    /// As [`walk_from`](Self::walk_from), but for functions whose names contain one of `apart`, and what only they
    /// call.
    pub fn walk_without(
        image: &Image,
        listing: &Listing,
        root: u64,
        apart: &[&str],
    ) -> Result<Self> {
        let (mut nodes, mut open) = (BTreeMap::new(), vec![(root, String::new())]);
        while let Some((address, path)) = open.pop() {
            if nodes.contains_key(&address) {
                continue;
            }
            let function = image.containing(address).with_context(|| {
                format!("a call leads to {address:#x}, where no function is ({path})")
            })?;
            let path = format!("{path} > {}", function.name);
            let mut node = node(function, listing, image).with_context(|| path.clone())?;
            node.calls.retain(|(_, callee)| {
                let name = image.containing(*callee).map_or("", |callee| &callee.name);
                !apart.iter().any(|part| name.contains(part))
            });
            open.extend(node.calls.iter().map(|(_, callee)| (*callee, path.clone())));
            nodes.insert(address, node);
        }
        Ok(Self { root, nodes })
    }

    /// The function that it begins with.
    pub fn root(&self) -> u64 {
        self.root
    }

    /// The function that starts at `address`.
    pub fn node(&self, address: u64) -> Option<&Node> {
        self.nodes.get(&address)
    }

    /// All functions, the root included.
    pub fn nodes(&self) -> impl Iterator<Item = &Node> {
        self.nodes.values()
    }

    /// Addresses of the instructions that call `callee`.
    pub fn callers(&self, callee: &Node) -> impl Iterator<Item = u64> {
        let start = callee.function.range.start;
        let calls = self.nodes().flat_map(|node| &node.calls);
        calls.filter(move |(_, callee)| *callee == start).map(|(caller, _)| *caller)
    }

    /// Bytes of code.
    pub fn code_size(&self) -> u64 {
        self.nodes().map(|node| node.function.range.end - node.function.range.start).sum()
    }

    /// Worst-case stack below the caller, frames as the compiler gave them or else as the code
    /// shows them; fails on recursion and on a frame without bound.
    pub fn stack(&self, image: &Image) -> Result<Stack<'_>> {
        self.stack_from(self.root, image, &mut Vec::new())
    }

    fn stack_from(&self, address: u64, image: &Image, path: &mut Vec<u64>) -> Result<Stack<'_>> {
        let node = &self.nodes[&address];
        let name = &node.function.name;
        ensure!(!path.contains(&address), "`{name}` is recursive: its stack has no bound");
        let own = node.frame(image)?;
        path.push(address);
        let mut deepest = Stack { bytes: 0, frames: Vec::new() };
        for (_, callee) in &node.calls {
            let callee = self.stack_from(*callee, image, path)?;
            if callee.bytes > deepest.bytes {
                deepest = callee;
            }
        }
        path.pop();
        deepest.bytes += own;
        deepest.frames.push((name, own));
        Ok(deepest)
    }
}

/// A worst-case stack and how it comes about.
pub struct Stack<'a> {
    /// All of it.
    pub bytes: u64,
    /// The functions on the way, innermost first, and the bytes of each.
    pub frames: Vec<(&'a str, u64)>,
}

fn node(function: &Function, listing: &Listing, image: &Image) -> Result<Node> {
    let instructions: Vec<_> = listing
        .range(function.range.clone())
        .map(|(address, instruction)| (*address, instruction.clone()))
        .collect();
    let mut calls = Vec::new();
    for (address, instruction) in &instructions {
        let flow =
            flow(instruction).with_context(|| format!("in `{}` at {address:#x}", function.name));
        let Some(target) = flow? else { continue };
        if !is_call(instruction.name()) && function.range.contains(&target) {
            continue;
        }
        // A jump into the middle of another function still reaches that function.
        let callee = image.containing(target).map_or(target, |callee| callee.range.start);
        calls.push((*address, callee));
    }
    Ok(Node { function: function.clone(), instructions, calls })
}

/// Successors of an instruction besides the next one; an error if they cannot be determined.
fn flow(instruction: &Instruction) -> Result<Option<u64>> {
    let (name, operands) = (instruction.name(), instruction.operands.as_str());
    let shown = format!("`{} {operands}`", instruction.mnemonic);
    if is_direct_branch(name) {
        return instruction
            .target()
            .map(Some)
            .with_context(|| format!("cannot tell where {shown} leads"));
    }
    // `bx lr` in all its conditional forms, and loads of pc from the stack, return.
    if name.starts_with("bx") && operands == "lr" {
        return Ok(None);
    }
    if name.starts_with("bx") || name.starts_with("blx") {
        bail!("indirect call {shown} cannot be followed");
    }
    // `tbb` and `tbh` jump inside the function by construction.
    let returns = name.starts_with("pop")
        || name.starts_with("ldm")
        || (name.starts_with("ldr") && operands.contains("[sp"));
    let table = name == "tbb" || name == "tbh";
    let writes_pc =
        operands.starts_with("pc,") || operands.contains(", pc}") || operands.ends_with("{pc}");
    if writes_pc && !returns && !table {
        bail!("indirect jump {shown} cannot be followed");
    }
    Ok(None)
}

/// `bl` with or without a condition; `ble` and its like are jumps.
fn is_call(name: &str) -> bool {
    name.strip_prefix("bl").is_some_and(is_condition)
}

/// A branch that has its target in its operands.
pub fn is_direct_branch(name: &str) -> bool {
    name == "cbz" || name == "cbnz" || is_call(name) || is_jump(name)
}

/// `b` with or without a condition.
fn is_jump(name: &str) -> bool {
    name.strip_prefix('b').is_some_and(is_condition)
}

fn is_condition(rest: &str) -> bool {
    const CONDITIONS: [&str; 14] =
        ["eq", "ne", "hs", "lo", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le"];
    rest.is_empty() || CONDITIONS.contains(&rest)
}

#[cfg(test)]
mod tests {
    use super::{CallGraph, flow};
    use crate::disassembly::{Instruction, Listing};
    use crate::elf::Image;

    fn flow_of(mnemonic: &str, operands: &str) -> anyhow::Result<Option<u64>> {
        flow(&instruction(mnemonic, operands))
    }

    #[test]
    fn direct_branches_lead_somewhere() {
        for (mnemonic, operands) in [
            ("bl", "0x10 <f>"),
            ("b.w", "0x10 <f>"),
            ("bls", "0x10 <g+0x2>"),
            ("cbz", "r1, 0x10 <g>"),
        ] {
            assert_eq!(flow_of(mnemonic, operands).unwrap(), Some(0x10), "{mnemonic}");
        }
    }

    #[test]
    fn returns_and_arithmetic_lead_nowhere() {
        for (mnemonic, operands) in [
            ("bx", "lr"),
            ("pop", "{r4, pc}"),
            ("pop.w", "{r4, r8, pc}"),
            ("ldr", "pc, [sp], #4"),
            ("bic", "r0, r1, #0x1"),
            ("ldr", "r0, [pc, #0x38]"),
            ("tbb", "[pc, r0]"),
        ] {
            assert_eq!(flow_of(mnemonic, operands).unwrap(), None, "{mnemonic}");
        }
    }

    #[test]
    fn indirect_calls_are_refused() {
        for (mnemonic, operands) in
            [("blx", "r3"), ("bx", "r0"), ("mov", "pc, r1"), ("ldr.w", "pc, [r0, r1, lsl #2]")]
        {
            assert!(flow_of(mnemonic, operands).is_err(), "{mnemonic} {operands}");
        }
    }

    fn instruction(mnemonic: &str, operands: &str) -> Instruction {
        Instruction { mnemonic: mnemonic.into(), operands: operands.into() }
    }

    /// `outer` calls `inner`, which ends with `last`.
    fn stack(inner_frame: Option<u64>, last: Instruction) -> anyhow::Result<u64> {
        let image =
            Image::of(&[("outer", 0x10..0x14, Some(24)), ("inner", 0x20..0x24, inner_frame)]);
        let listing = Listing::from([
            (0x10, instruction("bl", "0x20 <inner>")),
            (0x12, instruction("pop", "{r7, pc}")),
            (0x20, last),
        ]);
        Ok(CallGraph::walk(&image, &listing, "outer")?.stack(&image)?.bytes)
    }

    #[test]
    fn stack_adds_up_along_calls() {
        assert_eq!(stack(Some(100), instruction("bx", "lr")).unwrap(), 124);
    }

    #[test]
    fn what_has_no_bound_is_refused() {
        for (frame, last, reason) in [
            (None, instruction("sub", "sp, sp, r0"), "unknown amount"),
            (Some(8), instruction("bl", "0x20 <inner>"), "recursive"),
            (Some(8), instruction("b", "0x10 <outer>"), "recursive"),
            (Some(8), instruction("blx", "r3"), "indirect"),
            (Some(8), instruction("bl", "0x40"), "where no function is"),
        ] {
            let error = format!("{:#}", stack(frame, last).unwrap_err());
            assert!(error.contains(reason), "{error}");
        }
    }
}
