//! Constants in core registers, for arguments of copy routines and levels of BASEPRI.
//!
//! A forward data-flow analysis over one function: a register has a value before an instruction if every
//! path there gives it the same one. Whatever is not recognised as a move, addition or subtraction of
//! constants makes its destination unknown.

use std::collections::BTreeMap;

use super::flow::{FlowGraph, Node};
use super::instruction::{Flow, Kind};
use crate::disassembly::immediate;

/// Known values of r0 to r12 and lr, by number.
pub type Registers = BTreeMap<u8, u64>;

/// Known values before each instruction.
pub struct Constants(BTreeMap<u64, Registers>);

impl Constants {
    /// Follows all paths of a function, of whose arguments only those in `known` are known.
    pub fn of(graph: &FlowGraph, known: Registers) -> Self {
        let mut before = BTreeMap::from([(graph.entry, known)]);
        let mut open = vec![graph.entry];
        while let Some(address) = open.pop() {
            let node = &graph.nodes[&address];
            let after = after(&before[&address], node);
            for edge in &node.edges {
                let joined = match before.get(&edge.to) {
                    None => after.clone(),
                    Some(known) => {
                        let mut joined = known.clone();
                        joined.retain(|register, value| after.get(register) == Some(value));
                        if joined == *known {
                            continue;
                        }
                        joined
                    }
                };
                before.insert(edge.to, joined);
                open.push(edge.to);
            }
        }
        Self(before)
    }

    /// The value of a register before the instruction at `address`, if it is known.
    pub fn get(&self, address: u64, register: u8) -> Option<u64> {
        self.0.get(&address)?.get(&register).copied()
    }
}

impl Constants {
    /// The graph without the branches that a comparison of a known register right before them excludes.
    pub fn pruned(&self, graph: &FlowGraph) -> FlowGraph {
        let mut pruned = graph.clone();
        for (address, node) in &graph.nodes {
            let Some((at, compare)) = graph.nodes.range(..address).next_back() else { continue };
            let adjacent = at + compare.size == *address && compare.edges.len() == 1;
            if let Some(taken) = self.outcome(*at, compare, node).filter(|_| adjacent)
                && let Some(node) = pruned.nodes.get_mut(address)
            {
                node.edges.retain(|edge| edge.taken == taken);
            }
        }
        pruned
    }

    /// `true` if the branch behind a comparison is always taken, `false` if never.
    fn outcome(&self, at: u64, compare: &Node, branch: &Node) -> Option<bool> {
        let condition = branch.instruction.name().strip_prefix('b')?;
        let two = matches!(branch.decoded.flow, Flow::Branch(_)) && branch.edges.len() == 2;
        let is_compare = compare.instruction.name() == "cmp" && !compare.conditional;
        let (register, limit) =
            compare.instruction.operands.split_once(',').filter(|_| two && is_compare)?;
        let (value, limit) = (self.get(at, number(register)?)?, immediate(limit)?);
        match condition {
            "eq" => Some(value == limit),
            "ne" => Some(value != limit),
            "lo" => Some(value < limit),
            "hs" => Some(value >= limit),
            "hi" => Some(value > limit),
            "ls" => Some(value <= limit),
            _ => None,
        }
    }

    /// The value of a register behind the instruction `node` at `address`, if it is known.
    pub fn behind(&self, address: u64, node: &Node, register: u8) -> Option<u64> {
        after(self.0.get(&address)?, node).get(&register).copied()
    }
}

/// Number of a core register; none for anything else.
pub fn number(name: &str) -> Option<u8> {
    match name.trim() {
        "sp" => Some(13),
        "lr" => Some(14),
        "pc" => Some(15),
        name => name.strip_prefix('r')?.parse().ok().filter(|number| *number < 13),
    }
}

fn after(before: &Registers, node: &Node) -> Registers {
    let mut registers = before.clone();
    if node.callee.is_some() || matches!(node.decoded.flow, Flow::Call(_)) {
        registers.retain(|register, _| (4..=11).contains(register));
        return registers;
    }
    let operands: Vec<_> = node.instruction.operands.split(',').map(str::trim).collect();
    let value = (!node.conditional).then(|| value(before, node, &operands)).flatten();
    for register in written(node) {
        registers.remove(&register);
    }
    if let (Some(value), Some(register)) = (value, operands.first().and_then(|name| number(name))) {
        registers.insert(register, value);
    }
    registers
}

/// Value of the first operand behind the instruction.
fn value(before: &Registers, node: &Node, operands: &[&str]) -> Option<u64> {
    let known = |name: &str| before.get(&number(name)?).copied();
    let operand = |text: &str| immediate(text).or_else(|| known(text));
    let stem = node.instruction.mnemonic.split('.').next()?;
    let word = |value: u64| value & 0xFFFF_FFFF;
    match (stem, operands) {
        ("mov" | "movs" | "movw", [_, source]) => operand(source),
        ("movt", [register, high]) => Some(known(register)? & 0xFFFF | immediate(high)? << 16),
        ("add" | "adds" | "addw", [register, more]) => {
            Some(word(known(register)? + operand(more)?))
        }
        ("add" | "adds" | "addw", [_, first, second]) => {
            Some(word(operand(first)? + operand(second)?))
        }
        ("sub" | "subs" | "subw", [register, less]) => {
            Some(word(known(register)?.wrapping_sub(operand(less)?)))
        }
        ("sub" | "subs" | "subw", [_, first, second]) => {
            Some(word(operand(first)?.wrapping_sub(operand(second)?)))
        }
        _ => None,
    }
}

/// Core registers that an instruction may write.
pub fn written(node: &Node) -> Vec<u8> {
    let instruction = &node.instruction;
    let operands = instruction.operands.as_str();
    let name = instruction.mnemonic.split('.').next().unwrap_or_default();
    let mut registers = Vec::new();
    let list = operands.split(['{', '}']).nth(1);
    let before_memory = operands.split('[').next().unwrap_or_default();
    match node.decoded.kind {
        Kind::Store => {}
        _ if ["cmp", "cmn", "tst", "teq"].iter().any(|compare| name.starts_with(compare)) => {}
        _ => match list {
            Some(list) => registers.extend(list.split(',').filter_map(number)),
            None => {
                let two = ["umull", "smull", "umlal", "smlal", "ldrd", "vmov"];
                let results = if two.iter().any(|two| name.starts_with(two)) { 2 } else { 1 };
                registers.extend(before_memory.split(',').take(results).filter_map(number));
            }
        },
    }
    // A base register that is written back.
    if operands.contains('!') || operands.contains("],") {
        let base = operands.split('[').nth(1).unwrap_or(operands);
        registers.extend(base.split([',', ']', '!']).next().and_then(number));
    }
    // A store exclusive writes its status.
    if name.starts_with("strex") {
        registers.extend(operands.split(',').next().and_then(number));
    }
    registers
}

/// How far an instruction moves a register that it reads, if it does nothing else to it.
pub fn advance(node: &Node) -> Option<(u8, u64)> {
    let operands = node.instruction.operands.as_str();
    let name = node.instruction.mnemonic.split('.').next()?;
    let bare = if node.conditional { name.get(..name.len() - 2)? } else { name };
    if let Some((address, step)) = operands.split_once("],") {
        return Some((number(address.split('[').nth(1)?)?, immediate(step)?));
    }
    if let Some(address) = operands.strip_suffix("]!") {
        let (base, step) = address.split('[').nth(1)?.split_once(',')?;
        return Some((number(base)?, immediate(step)?));
    }
    let parts: Vec<_> = operands.split(',').collect();
    match (bare, &parts[..]) {
        ("add" | "adds" | "addw", [register, step]) => Some((number(register)?, immediate(step)?)),
        ("add" | "adds" | "addw", [to, from, step]) if to.trim() == from.trim() => {
            Some((number(to)?, immediate(step)?))
        }
        ("ldm" | "stm" | "ldmia" | "stmia", _) if operands.contains('!') => {
            let words = operands.split(['{', '}']).nth(1)?.split(',').count() as u64;
            Some((number(operands.split('!').next()?)?, 4 * words))
        }
        _ => None,
    }
}
