//! The control-flow graph of one function, one node per instruction.

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};

use super::instruction::{Decoded, Flow, covered_by_it, decode};
use crate::disassembly::{Instruction, Listing, immediate};
use crate::elf::{Function, Image};

/// One instruction on a path.
#[derive(Clone)]
pub struct Node {
    /// The instruction itself.
    pub instruction: Instruction,
    /// Length (B).
    pub size: u64,
    /// Kind and control flow.
    pub decoded: Decoded,
    /// Conditional by an IT instruction before it.
    pub conditional: bool,
    /// Function that is called, or jumped to for good.
    pub callee: Option<u64>,
    /// Successors in the same function.
    pub edges: Vec<Edge>,
}

/// A way from one instruction to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// Address of the successor.
    pub to: u64,
    /// `true` if the successor is fetched by a taken branch or by a return from a call.
    pub taken: bool,
}

/// `true` for the name of a function that ends the program: a path that calls it ends there, as it does in a
/// trap. A step has neither.
pub type Aborts = fn(&str) -> bool;

/// Everything reachable from a function's entry without leaving it, by address.
#[derive(Clone)]
pub struct FlowGraph {
    /// Address of the first instruction.
    pub entry: u64,
    /// Instructions by address.
    pub nodes: BTreeMap<u64, Node>,
}

impl FlowGraph {
    /// Follows `function` from its entry; fails on what cannot be followed.
    pub fn build(
        function: &Function,
        image: &Image,
        listing: &Listing,
        aborts: Option<Aborts>,
    ) -> Result<Self> {
        let conditional = conditional(function, listing);
        let (entry, mut nodes) = (function.range.start, BTreeMap::new());
        let mut open = vec![entry];
        while let Some(address) = open.pop() {
            if nodes.contains_key(&address) {
                continue;
            }
            let inside = conditional.get(&address).copied().unwrap_or(false);
            let node = node(address, inside, function, image, listing, aborts)
                .with_context(|| format!("in `{}` at {address:#x}", function.name))?;
            open.extend(node.edges.iter().map(|edge| edge.to));
            nodes.insert(address, node);
        }
        for (address, _) in nodes.iter().filter(|(_, node)| has_table_apart(node)) {
            let ways = nodes.values().flat_map(|node| &node.edges);
            let ways = ways.filter(|edge| edge.to == *address).count();
            ensure!(ways == 1, "the jump table at {address:#x} is reached in {ways} ways");
        }
        Ok(Self { entry, nodes })
    }
}

/// `true` for a jump by a table that a register names.
fn has_table_apart(node: &Node) -> bool {
    matches!(node.decoded.flow, Flow::Table { .. }) && !node.instruction.operands.starts_with("[pc")
}

/// Instructions that an IT instruction before them makes conditional.
fn conditional(function: &Function, listing: &Listing) -> BTreeMap<u64, bool> {
    let mut left: usize = 0;
    let mut covered = BTreeMap::new();
    for (address, instruction) in listing.range(function.range.clone()) {
        covered.insert(*address, left > 0);
        left = match covered_by_it(instruction) {
            0 => left.saturating_sub(1),
            more => more,
        };
    }
    covered
}

/// Where the table of the jump at `address` is: behind it, or where the instruction before puts the register that it
/// names.
fn table(address: u64, size: u64, jump: &Instruction, listing: &Listing) -> Result<u64> {
    let register = jump.operands.trim_start_matches('[').split(',').next().unwrap_or_default();
    if register == "pc" {
        return Ok(address + size);
    }
    let before = listing.range(..address).next_back();
    let place = before.and_then(|(at, it)| {
        let (named, offset) = it.operands.split_once(',')?;
        let loads = it.name() == "adr" && named.trim() == register;
        loads.then_some(((at + 4) & !3) + immediate(offset)?)
    });
    place.with_context(|| format!("cannot tell where the jump table at {address:#x} is"))
}

fn node(
    address: u64,
    conditional: bool,
    function: &Function,
    image: &Image,
    listing: &Listing,
    aborts: Option<Aborts>,
) -> Result<Node> {
    let instruction = listing.get(&address).context("no instruction")?.clone();
    let decoded = decode(&instruction, conditional)?;
    let next = listing.range(address + 1..).next().map(|(address, _)| *address);
    let size = next.map_or(function.range.end, |next| next.min(function.range.end)) - address;
    ensure!(size == 2 || size == 4, "an instruction of {size} B: the listing has a gap");
    let inside = |to: u64| function.range.contains(&to);
    let mut node =
        Node { instruction, size, decoded, conditional, callee: None, edges: Vec::new() };
    let mut goes_on = conditional;
    match decoded.flow {
        Flow::Next => goes_on = true,
        Flow::Return => {}
        Flow::Trap => ensure!(aborts.is_some(), "a trap, which has no place in a step"),
        Flow::Table { wide } => {
            let table = table(address, size, &node.instruction, listing)?;
            let own = |to: u64| inside(to) && listing.contains_key(&to);
            let places = (table, address + size);
            let targets = image.jump_table(places, wide, function.range.end, own)?;
            node.edges.extend(targets.into_iter().map(|to| Edge { to, taken: true }));
        }
        Flow::Jump(to) | Flow::Branch(to) => {
            goes_on |= matches!(decoded.flow, Flow::Branch(_));
            if inside(to) {
                node.edges.push(Edge { to, taken: true });
            } else {
                node.callee = Some(start(to, image)?);
            }
        }
        Flow::Call(to) => {
            node.callee = Some(start(to, image)?);
            goes_on = true;
        }
    }
    if let Some(callee) = node.callee
        && let Some(aborts) = aborts
        && image.containing(callee).is_some_and(|callee| aborts(&callee.name))
    {
        node.callee = None;
        goes_on = conditional;
    }
    if goes_on {
        let to = address + size;
        ensure!(inside(to), "the code runs past the function's end");
        // A conditional call may have been made.
        let taken = matches!(decoded.flow, Flow::Call(_));
        node.edges.push(Edge { to, taken });
    }
    Ok(node)
}

/// The function that starts at `address`; a jump into the middle of one is refused.
fn start(address: u64, image: &Image) -> Result<u64> {
    let function = image
        .containing(address)
        .with_context(|| format!("leads to {address:#x}, where no function is"))?;
    ensure!(
        function.range.start == address,
        "leads into the middle of `{}`, to {address:#x}",
        function.name
    );
    Ok(address)
}
