//! Bounds of a function and of everything that it calls.

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};

use super::flow::FlowGraph;
use super::path::{Weighted, no_loop};
use super::timing::Model;
use crate::disassembly::Listing;
use crate::elf::Image;

/// The three bounds of one function, with those of the functions below it.
pub struct Bounds {
    graphs: BTreeMap<u64, FlowGraph>,
    bounds: BTreeMap<(u64, Model), u64>,
    root: u64,
}

impl Bounds {
    /// Bounds the function `root`; fails on whatever has no bound, with its place.
    pub fn of(root: &str, image: &Image, listing: &Listing) -> Result<Self> {
        let root = image.named(root)?.range.start;
        let mut bounds = Self { graphs: BTreeMap::new(), bounds: BTreeMap::new(), root };
        bounds.add(root, image, listing, &mut Vec::new())?;
        Ok(bounds)
    }

    /// Bound of the function itself.
    pub fn get(&self, model: Model) -> u64 {
        self.bounds[&(self.root, model)]
    }

    /// Start and bound of every function, by address.
    pub fn functions(&self, model: Model) -> impl Iterator<Item = (u64, u64)> {
        self.graphs.keys().map(move |start| (*start, self.bounds[&(*start, model)]))
    }

    /// `true` if some path contains the instruction at `address`.
    pub fn contains(&self, address: u64) -> bool {
        self.graphs.values().any(|graph| graph.nodes.contains_key(&address))
    }

    fn add(
        &mut self,
        start: u64,
        image: &Image,
        listing: &Listing,
        path: &mut Vec<u64>,
    ) -> Result<()> {
        if self.graphs.contains_key(&start) {
            return Ok(());
        }
        let function = image.containing(start).context("no function")?;
        let name = &function.name;
        ensure!(!path.contains(&start), "`{name}` is recursive: it has no bound");
        path.push(start);
        let graph = FlowGraph::build(function, image, listing, None)?;
        for callee in graph.nodes.values().filter_map(|node| node.callee) {
            self.add(callee, image, listing, path).with_context(|| format!("below `{name}`"))?;
        }
        path.pop();
        for model in Model::ALL {
            let bound = self.bound(&graph, model).with_context(|| format!("in `{name}`"))?;
            self.bounds.insert((start, model), bound);
        }
        self.graphs.insert(start, graph);
        Ok(())
    }

    /// The most expensive path through one function, whose callees have their bounds.
    fn bound(&self, graph: &FlowGraph, model: Model) -> Result<u64> {
        let called = |callee: u64, _| self.bounds[&(callee, model)];
        let longest = weighted(graph, model, called).longest(graph.entry, 0, &no_loop)?;
        Ok(entry(graph, model) + longest.most)
    }
}

/// The graph of a function under a model; `called` is the cost of a function at a call in it.
pub fn weighted(graph: &FlowGraph, model: Model, called: impl Fn(u64, u64) -> u64) -> Weighted {
    let mut weighted = Weighted::default();
    for (address, node) in &graph.nodes {
        let next = graph.nodes.get(&(address + node.size));
        let called = node.callee.map_or(0, |callee| called(callee, *address));
        let edges = node
            .edges
            .iter()
            .map(|edge| (edge.to, model.edge(*address, node, *edge, &graph.nodes[&edge.to])));
        weighted.add(*address, model.node(node, next) + called, edges.collect());
    }
    weighted
}

/// Cost of entering a function.
pub fn entry(graph: &FlowGraph, model: Model) -> u64 {
    model.entry(graph.entry, graph.nodes[&graph.entry].size)
}

#[cfg(test)]
mod tests {
    use super::{Bounds, Model};
    use crate::disassembly::{Instruction, Listing};
    use crate::elf::Image;

    /// A listing of instructions of 2 B from `start` on.
    fn code(start: u64, lines: &[&str]) -> Listing {
        let places = (start..).step_by(2);
        let parsed = lines.iter().map(|line| {
            let (mnemonic, operands) = line.split_once(' ').unwrap_or((line, ""));
            Instruction { mnemonic: mnemonic.into(), operands: operands.into() }
        });
        places.zip(parsed).collect()
    }

    /// Bounds of `step`, which lies from 0x10 to `end`, beside `other` from 0x1000 to 0x1004.
    fn bounds(step: &[&str], other: &[&str]) -> anyhow::Result<Bounds> {
        let end = 0x10 + 2 * step.len() as u64;
        let image = Image::of(&[("step", 0x10..end, None), ("other", 0x1000..0x1004, None)]);
        let mut listing = code(0x10, step);
        listing.extend(code(0x1000, other));
        Bounds::of("step", &image, &listing)
    }

    fn instructions(step: &[&str]) -> u64 {
        bounds(step, &["nop", "bx lr"]).unwrap().get(Model::Instructions)
    }

    #[test]
    fn both_sides_of_a_branch_are_compared() {
        let step = ["cbz r0, 0x18", "nop", "nop", "nop", "bx lr"];
        assert_eq!(instructions(&step), 5);
        let bounds = bounds(&step, &["nop", "bx lr"]).unwrap();
        assert_eq!(bounds.get(Model::CyclesHit), 1 + 3 + 4);
        assert!(bounds.contains(0x16) && !bounds.contains(0x1000));
    }

    #[test]
    fn instructions_that_an_it_block_skips_count() {
        assert_eq!(instructions(&["itt ne", "movne r0, r1", "bxne lr", "nop", "bx lr"]), 5);
    }

    #[test]
    fn calls_and_jumps_into_functions_cost_what_those_cost() {
        assert_eq!(instructions(&["bl 0x1000", "bl 0x1000", "bx lr"]), 7);
        assert_eq!(instructions(&["nop", "b 0x1000"]), 4);
        let bounds = bounds(&["bl 0x1000", "bx lr"], &["nop", "bx lr"]).unwrap();
        assert_eq!(bounds.get(Model::CyclesHit), 4 + (1 + 4) + 4);
    }

    #[test]
    fn an_added_branch_of_500_instructions_adds_them() {
        let mut longer = vec!["cbz r0, 0x3fa"];
        longer.resize(501, "nop");
        longer.push("bx lr");
        assert_eq!(instructions(&longer), 502);
    }

    #[test]
    fn what_has_no_bound_is_refused() {
        let plain: &[&str] = &["nop", "bx lr"];
        for (step, other, reason) in [
            (&["subs r0, r0, #0x1", "bne 0x10", "bx lr"][..], plain, "loop"),
            (&["b 0x10"][..], plain, "loop"),
            (&["bl 0x10", "bx lr"][..], plain, "recursive"),
            (&["bl 0x1000", "bx lr"][..], &["bl 0x10", "bx lr"][..], "recursive"),
            (&["blx r3", "bx lr"][..], plain, "indirect"),
            (&["bl 0x1000", "bx lr"][..], &["bx r3", "bx lr"][..], "indirect"),
            (&["wfi", "bx lr"][..], plain, "unknown"),
            (&["bl 0x1002", "bx lr"][..], plain, "middle"),
            (&["bl 0x2000", "bx lr"][..], plain, "no function"),
            (&["nop"][..], plain, "past the function's end"),
        ] {
            let error = format!("{:#}", bounds(step, other).err().expect(reason));
            assert!(error.contains(reason), "{reason}: {error}");
        }
    }
}
