//! Worst-case stack of tasks that interrupt each other, from their priorities and critical sections.
//!
//! A task is interrupted by those above its own priority and above the ceilings that are in force: what it uses in a
//! section which keeps another task out and what that task uses never lie on the stack together.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, ensure};

use crate::call_graph::CallGraph;
use crate::disassembly::Listing;
use crate::elf::Image;
use crate::wcet::{ALL, Ceilings, Functions, Known, aborts, ceilings};

/// Bytes that the processor pushes before a handler: 26 words with the floating-point registers, aligned
/// to 8 bytes.
pub const EXCEPTION_FRAME: u64 = 112;

/// Deepest stack by the ceiling in force.
type Depths = BTreeMap<u64, u64>;

/// Stack of one task.
pub struct TaskStack {
    /// The symbol of its handler.
    pub handler: String,
    /// The highest number runs first.
    pub priority: u64,
    /// Deepest stack under each ceiling (B), with what the processor pushes; zero for none.
    pub depths: Depths,
}

impl TaskStack {
    /// Stack of the task whose handler begins a call graph.
    pub fn of(
        handler: &str,
        priority: u64,
        graph: &CallGraph,
        image: &Image,
        listing: &Listing,
    ) -> Result<Self> {
        let functions = functions(graph, image, listing)?;
        let mut sections = BTreeMap::new();
        for start in functions.keys() {
            let name = &graph.node(*start).context("a function of the call graph")?.function.name;
            let found = ceilings(&functions, *start)
                .with_context(|| format!("critical sections of `{name}`"))?;
            // A handler restores what it has found when it is done.
            let fair = !found.lowers || *start == graph.root();
            ensure!(fair, "`{name}` ends a critical section of its caller");
            sections.insert(*start, found);
        }
        let walk = Walk { image, graph, sections: &sections };
        let mut depths = walk.below(graph.root(), 0, &mut BTreeMap::new())?;
        depths.values_mut().for_each(|bytes| *bytes += EXCEPTION_FRAME);
        Ok(Self { handler: handler.to_owned(), priority, depths })
    }
}

/// The functions of a call graph, but for those that only a panic reaches, which ends the program in the section that it
/// happens in, and those that cannot be followed and reach no section either.
fn functions(graph: &CallGraph, image: &Image, listing: &Listing) -> Result<Functions> {
    let (mut functions, mut seen) = (Functions::new(), BTreeSet::new());
    let mut open = vec![graph.root()];
    while let Some(start) = open.pop() {
        if !seen.insert(start) {
            continue;
        }
        let node = graph.node(start).context("a function of the call graph")?;
        match Known::read(&node.function, image, listing) {
            Ok(known) => {
                open.extend(known.graph.nodes.values().filter_map(|node| node.callee));
                functions.insert(start, known);
            }
            Err(_) if !reaches_section(graph, start) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(functions)
}

/// `true` if the function at `start`, or one that it calls, changes what may interrupt it.
fn reaches_section(graph: &CallGraph, start: u64) -> bool {
    let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
    while let Some(start) = open.pop() {
        let Some(node) = graph.node(start).filter(|node| !aborts(&node.function.name)) else {
            continue;
        };
        let mut names = node.instructions.iter().map(|(_, instruction)| instruction.name());
        if names.any(|name| ["msr", "cpsid", "cpsie"].contains(&name)) {
            return true;
        }
        let calls = node.calls.iter().map(|(_, callee)| *callee);
        open.extend(calls.filter(|callee| seen.insert(*callee)));
    }
    false
}

struct Walk<'a> {
    image: &'a Image,
    graph: &'a CallGraph,
    sections: &'a BTreeMap<u64, Ceilings>,
}

impl Walk<'_> {
    /// Stack of the function at `start`, called under `ceiling`, by the ceiling in force.
    fn below(
        &self,
        start: u64,
        ceiling: u64,
        known: &mut BTreeMap<(u64, u64), Depths>,
    ) -> Result<Depths> {
        if let Some(depths) = known.get(&(start, ceiling)) {
            return Ok(depths.clone());
        }
        let node = self.graph.node(start).context("a function of the call graph")?;
        let (own, sections) = (node.frame(self.image)?, self.sections.get(&start));
        // Interrupts may be let in amid it.
        let ends = sections.is_some_and(|sections| sections.ends_callers);
        let outside = if ends { 0 } else { ceiling };
        let mut depths = Depths::from([(outside, own)]);
        for (address, callee) in &node.calls {
            let raised = sections.and_then(|sections| sections.before.get(address));
            let raised = raised.copied().unwrap_or(0);
            for (ceiling, bytes) in self.below(*callee, outside.max(raised), known)? {
                let deepest = depths.entry(ceiling).or_default();
                *deepest = (*deepest).max(own + bytes);
            }
        }
        known.insert((start, ceiling), depths.clone());
        Ok(depths)
    }
}

/// One task of the deepest nesting.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layer {
    /// The symbol of its handler.
    pub handler: String,
    /// Ceiling at which it is interrupted.
    pub ceiling: u64,
    /// Its stack there (B).
    pub bytes: u64,
}

/// The deepest nesting of tasks above `level`, the lowest first.
pub fn deepest(tasks: &[TaskStack], level: u64) -> Vec<Layer> {
    let mut most = Vec::new();
    for task in tasks.iter().filter(|task| task.priority > level) {
        for (ceiling, bytes) in &task.depths {
            let handler = task.handler.clone();
            let mut nesting = vec![Layer { handler, ceiling: *ceiling, bytes: *bytes }];
            if *ceiling < ALL {
                nesting.extend(deepest(tasks, task.priority.max(*ceiling)));
            }
            if sum(&nesting) > sum(&most) {
                most = nesting;
            }
        }
    }
    most
}

/// Bytes of a nesting.
pub fn sum(nesting: &[Layer]) -> u64 {
    nesting.iter().map(|layer| layer.bytes).sum()
}

#[cfg(test)]
#[path = "preemption_tests.rs"]
mod tests;
