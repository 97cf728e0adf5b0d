//! Costs of instructions and of the ways between them, under one of three models.
//!
//! Cycles are the largest of each range in the instruction timing tables of the Cortex-M4
//! technical reference manual (ARM 100166, tables 3-1 and 7-1).

use super::flow::{Edge, Node};
use super::instruction::{Flow, Kind};
use crate::cycles::{REFILL, registers};

/// Wait states of the STM32F405's flash at 168 MHz and 2.7 V to 3.6 V.
const WAIT_STATES: u64 = 5;
/// Bytes that one access to the flash delivers.
const LINE: u64 = 16;

/// Assumptions of the cycle models, printed with every report.
pub const ASSUMPTIONS: [&str; 10] = [
    "instructions: every executed one counts, those that an IT block skips included",
    "division in core registers takes 12 cycles; vdiv and vsqrt take 14",
    "no load or store overlaps another; each takes 1 cycle and 1 per word",
    "a taken branch, a call and a return refill the pipeline in 3 cycles",
    "a barrier costs as much as refilling the pipeline, as does an access to a special register",
    "a floating-point result costs 1 cycle more if the next instruction may use it",
    "RAM has no wait states, no DMA uses its bus, and all accesses are aligned",
    "no interrupt: the exceptions' entry, exit and lazy stacking are not included",
    "hit: the accelerator of the flash has every line and every constant",
    "miss: it has none. 5 wait states for each line of 16 B that is entered and for a discarded \
     prefetch at each branch; each loaded word is a constant in flash and evicts the line",
];

/// Quantity that a bound limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Model {
    /// Executed instructions.
    Instructions,
    /// Cycles without wait states: all accesses to the flash hit the accelerator.
    CyclesHit,
    /// Cycles with the accelerator off.
    CyclesMiss,
}

impl Model {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Instructions, Self::CyclesHit, Self::CyclesMiss];

    /// Cost of entering a function at the instruction `at` of `size` bytes.
    pub fn entry(self, at: u64, size: u64) -> u64 {
        if self == Self::CyclesMiss { refetch(at, size) } else { 0 }
    }

    /// Cost of one instruction, `next` being the one behind it.
    pub fn node(self, node: &Node, next: Option<&Node>) -> u64 {
        match self {
            Self::Instructions => 1,
            Self::CyclesHit => cycles(node, next),
            Self::CyclesMiss => cycles(node, next) + 2 * WAIT_STATES * loaded(node),
        }
    }

    /// Cost of the way from the instruction `node` at `from` along `edge` to `successor`.
    pub fn edge(self, from: u64, node: &Node, edge: Edge, successor: &Node) -> u64 {
        let jumps = edge.taken && !matches!(node.decoded.flow, Flow::Call(_));
        let refill = if jumps { REFILL } else { 0 };
        match self {
            Self::Instructions => 0,
            Self::CyclesHit => refill,
            Self::CyclesMiss if edge.taken => refill + refetch(edge.to, successor.size),
            Self::CyclesMiss => {
                let ends = [from + node.size, edge.to + successor.size];
                let [line, last] = ends.map(|end| (end - 1) / LINE);
                // The target of a branch that is not taken may have been fetched, and then the
                // line of the next instruction again.
                let branch = matches!(node.decoded.flow, Flow::Branch(_));
                WAIT_STATES * (last - line + if branch { 2 } else { 0 })
            }
        }
    }
}

/// Wait states of a fetch after a branch: of the instruction's lines, and of a prefetch behind
/// the branch that has to end first.
fn refetch(at: u64, size: u64) -> u64 {
    WAIT_STATES * ((at + size - 1) / LINE - at / LINE + 2)
}

/// Cycles of an instruction without the flash's wait states. Refilling the pipeline is in it if it
/// leaves the function, otherwise on the edge.
fn cycles(node: &Node, next: Option<&Node>) -> u64 {
    let own = match node.decoded.kind {
        Kind::Plain | Kind::Branch => 1,
        Kind::System => 1 + REFILL,
        Kind::Double => 2,
        Kind::Divide => 12,
        Kind::Load | Kind::Store => 1 + words(node),
        Kind::Float => 1 + stall(node, next),
        Kind::FloatAccumulate => 3 + stall(node, next),
        Kind::FloatDivide => 14 + stall(node, next),
        // Between two core and two single registers it takes 2.
        Kind::FloatMove => 1 + u64::from(node.instruction.operands.matches(',').count() > 1),
    };
    let leaves = node.callee.is_some() || matches!(node.decoded.flow, Flow::Return | Flow::Trap);
    own + if leaves { REFILL } else { 0 }
}

/// One cycle if the next instruction may use the result.
fn stall(node: &Node, next: Option<&Node>) -> u64 {
    let Some(next) = next.map(|next| &next.instruction) else { return 1 };
    let result = node.instruction.operands.split(',').next().unwrap_or_default().trim();
    let mut named = next.operands.split(|c: char| !c.is_ascii_alphanumeric());
    let flags = node.instruction.mnemonic.starts_with("vcmp");
    // A double register overlaps two single ones; an IT instruction may be folded into the next.
    let uses = named.any(|name| name == result || name.starts_with('d'));
    u64::from(flags || uses || next.mnemonic.starts_with("it"))
}

/// Words that a load or store transfers.
fn words(node: &Node) -> u64 {
    let (operands, mnemonic) = (&node.instruction.operands, &node.instruction.mnemonic);
    if operands.contains('{') {
        registers(operands)
    } else if mnemonic.starts_with("ldrd") || mnemonic.starts_with("strd") {
        2
    } else {
        1 + u64::from(operands.starts_with('d'))
    }
}

/// Words that are loaded, if any.
fn loaded(node: &Node) -> u64 {
    if node.decoded.kind == Kind::Load { words(node) } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::Model;
    use crate::disassembly::Instruction;
    use crate::wcet::flow::{Edge, Node};
    use crate::wcet::instruction::decode;

    fn node(text: &str) -> Node {
        let (mnemonic, operands) = text.split_once(' ').unwrap_or((text, ""));
        let instruction = Instruction { mnemonic: mnemonic.into(), operands: operands.into() };
        let decoded = decode(&instruction, false).unwrap();
        Node { instruction, size: 4, decoded, conditional: false, callee: None, edges: Vec::new() }
    }

    #[test]
    fn cycles_are_the_largest_of_the_manual() {
        let other = node("mov r0, r1");
        for (text, hit, miss) in [
            ("add.w r0, r0, #0x1", 1, 1),
            ("vadd.f32 s0, s1, s2", 1, 1),
            ("vmla.f32 s0, s1, s2", 3, 3),
            ("vsqrt.f32 s0, s1", 14, 14),
            ("udiv r0, r0, r1", 12, 12),
            ("vldr s0, [r0, #0x8]", 2, 12),
            ("vldr d0, [r0, #0x8]", 3, 23),
            ("ldrd r0, r1, [r2]", 3, 23),
            ("vpush {d8, d9, d10}", 7, 7),
            ("pop {r4, pc}", 6, 26),
            ("bx lr", 4, 4),
            ("vmov r0, r1, s0, s1", 2, 2),
        ] {
            let node = node(text);
            assert_eq!(Model::Instructions.node(&node, Some(&other)), 1);
            assert_eq!(Model::CyclesHit.node(&node, Some(&other)), hit, "{text}");
            assert_eq!(Model::CyclesMiss.node(&node, Some(&other)), miss, "{text}");
        }
    }

    #[test]
    fn a_result_used_at_once_stalls() {
        let add = node("vadd.f32 s0, s1, s2");
        for (next, cycles) in [
            (Some("vmul.f32 s3, s0, s0"), 2),
            (Some("vstr s0, [r0]"), 2),
            (Some("vpush {d8}"), 2),
            (Some("it ne"), 2),
            (Some("vmul.f32 s3, s4, s4"), 1),
            (None, 2),
        ] {
            let next = next.map(node);
            assert_eq!(Model::CyclesHit.node(&add, next.as_ref()), cycles);
        }
    }

    #[test]
    fn fetches_wait_per_line_and_after_branches() {
        let (plain, branch) = (node("mov r0, r1"), node("beq 0x40"));
        let way = |to, taken| (Edge { to, taken }, node("mov r0, r1"));
        let cost = |model: Model, node, (edge, successor)| model.edge(0x18, node, edge, &successor);
        assert_eq!(cost(Model::CyclesMiss, &plain, way(0x1C, false)), 0);
        assert_eq!(Model::CyclesMiss.edge(0x1C, &plain, way(0x20, false).0, &plain), 5);
        assert_eq!(cost(Model::CyclesHit, &branch, way(0x1C, false)), 0);
        assert_eq!(cost(Model::CyclesMiss, &branch, way(0x1C, false)), 10);
        assert_eq!(cost(Model::CyclesHit, &branch, way(0x40, true)), 3);
        assert_eq!(cost(Model::CyclesMiss, &branch, way(0x40, true)), 3 + 10);
        assert_eq!(cost(Model::CyclesMiss, &branch, way(0x4E, true)), 3 + 15);
        assert_eq!(cost(Model::Instructions, &branch, way(0x40, true)), 0);
    }
}
