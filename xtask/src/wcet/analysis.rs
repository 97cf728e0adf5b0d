//! Bounds of the functions of a whole image: loops with bounds, jump tables, copy routines.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, ensure};

use super::bound::{entry, weighted};
use super::constants::Constants;
use super::flow::FlowGraph;
use super::instruction::Flow;
use super::library::{aborts, routine};
use super::limit::{Found, Limits};
use super::path::{Limit, Loop};
use super::timing::Model;
use crate::cycles::CLOCK;
use crate::disassembly::Listing;
use crate::elf::{Function, Image};

/// Costs under every model.
pub type Costs = BTreeMap<Model, u64>;

/// Cost of one call.
#[derive(Clone, Debug, Default)]
pub struct Cost {
    /// Without the loops that are limited in all.
    pub each: Costs,
    /// Of these, by the header's address: once for each release of a task, or for each call of the function that they
    /// name, which is above.
    pub in_all: BTreeMap<u64, Costs>,
}

impl Cost {
    /// All of it.
    pub fn total(&self, model: Model) -> u64 {
        self.each[&model] + self.in_all.values().map(|costs| costs[&model]).sum::<u64>()
    }
}

/// A bounded loop, for reports and for the comparison with the emulator.
pub struct BoundedLoop {
    /// Function that it is in.
    pub function: String,
    /// Its header, and the instructions outside from which it is entered.
    pub header: u64,
    pub entered_from: Vec<u64>,
    /// Its bound.
    pub found: Found,
}

/// A function's graph with what is known about it.
pub struct Known {
    pub graph: FlowGraph,
    pub constants: Constants,
}

impl Known {
    /// Reads the code of a function.
    pub fn read(function: &Function, image: &Image, listing: &Listing) -> Result<Self> {
        let graph = FlowGraph::build(function, image, listing, Some(aborts))?;
        let constants = Constants::of(&graph, BTreeMap::new());
        Ok(Self { graph, constants })
    }
}

/// What is known about functions, by their starts.
pub type Functions = BTreeMap<u64, Known>;

/// An image under analysis.
pub struct Analysis<'a> {
    image: &'a Image,
    listing: &'a Listing,
    limits: &'a Limits,
    /// Functions that are not executed, by a part of their name, as the caller vouches.
    excluded: &'a [&'a str],
    /// Cycles that a microsecond of waiting for hardware costs: none, if the time is to be told apart.
    per_us: u64,
    pub(super) functions: Functions,
    costs: BTreeMap<(u64, Option<u64>), Cost>,
    /// Functions over whose calls loops are limited, by the loops' headers.
    scopes: BTreeMap<u64, String>,
    /// Loops by header; those of copy routines are in it once for each length.
    pub loops: Vec<BoundedLoop>,
    /// Names of the excluded functions that were met.
    met: BTreeSet<String>,
    /// What has no bound, all of it, so that a user can annotate it at once.
    problems: Vec<String>,
    /// Functions without a bound, with all that call them, and the headers of their loops without one.
    unbounded: BTreeSet<u64>,
    unbounded_loops: BTreeSet<u64>,
}

impl<'a> Analysis<'a> {
    /// Nothing is analysed yet.
    pub fn new(
        image: &'a Image,
        listing: &'a Listing,
        limits: &'a Limits,
        excluded: &'a [&'a str],
    ) -> Self {
        Self {
            image,
            listing,
            limits,
            excluded,
            per_us: (CLOCK / 1e6) as u64,
            functions: BTreeMap::new(),
            costs: BTreeMap::new(),
            scopes: BTreeMap::new(),
            loops: Vec::new(),
            met: BTreeSet::new(),
            problems: Vec::new(),
            unbounded: BTreeSet::new(),
            unbounded_loops: BTreeSet::new(),
        }
    }

    /// Without the time that loops wait for hardware.
    pub fn without_waiting(self) -> Self {
        Self { per_us: 0, ..self }
    }

    /// Cycles that a microsecond of waiting costs.
    pub fn per_us(&self) -> u64 {
        self.per_us
    }

    /// Bound of the loop in a function that has been bounded.
    pub fn limit_in(&self, function: u64, header: u64) -> Option<Limit> {
        if self.unbounded_loops.contains(&header) {
            return None;
        }
        let name = &self.image.containing(function)?.name;
        let found = self.loops.iter().filter(|found| found.header == header);
        found.filter(|found| found.function == *name).map(|found| found.found.limit).next()
    }

    /// Bound of the function that starts at `start`.
    pub fn cost(&mut self, start: u64) -> Result<Cost> {
        let cost = self.cost_below(start, None, &mut Vec::new())?;
        let problems = std::mem::take(&mut self.problems);
        ensure!(problems.is_empty(), "no bound:\n  {}", problems.join("\n  "));
        ensure!(!self.unbounded.contains(&start), "it calls what has no bound");
        self.require_scopes(start, &cost)?;
        Ok(cost)
    }

    /// Refuses a limit over the calls of a function that is not between the root and the loop.
    fn require_scopes(&self, root: u64, cost: &Cost) -> Result<()> {
        let open = cost.in_all.keys().find_map(|header| Some((*header, self.scopes.get(header)?)));
        match open {
            None => Ok(()),
            Some((header, scope)) => anyhow::bail!(
                "the loop at {header:#x} is limited over a call of `{scope}`, which is not above it and below {root:#x}: {}",
                self.limits.place(header)
            ),
        }
    }

    /// Starts of the functions over whose calls the loop at `header` is limited; none: over a release.
    pub fn scope(&self, header: u64) -> Vec<u64> {
        let Some(scope) = self.scopes.get(&header) else { return Vec::new() };
        let named = |start: &u64| {
            self.image.containing(*start).is_some_and(|function| function.name.contains(scope))
        };
        self.functions.keys().copied().filter(named).collect()
    }

    /// Analyses the function that starts at `start`, which may do without a bound; what is without one below it.
    pub fn examine(&mut self, start: u64) -> Result<Vec<String>> {
        let cost = self.cost_below(start, None, &mut Vec::new())?;
        self.require_scopes(start, &cost)?;
        Ok(std::mem::take(&mut self.problems))
    }

    /// The graph of a function that has been bounded.
    pub fn known(&self, start: u64) -> Option<&Known> {
        self.functions.get(&start)
    }

    /// Starts of all functions whose code counts.
    pub fn analysed(&self) -> impl Iterator<Item = u64> {
        self.functions.keys().copied()
    }

    /// Instructions from which a loop is entered: those before its header, and the calls of a function that begins
    /// with it.
    pub fn entries(&self, found: &BoundedLoop) -> Vec<u64> {
        let nodes = self.functions.values().flat_map(|known| &known.graph.nodes);
        let calls = nodes.filter(|(_, node)| node.callee == Some(found.header));
        calls.map(|(at, _)| *at).chain(found.entered_from.iter().copied()).collect()
    }

    /// Calls of excluded functions, with the addresses that they return to.
    pub fn excluded_calls(&self) -> Result<Vec<(u64, u64)>> {
        let nodes = self.functions.values().flat_map(|known| &known.graph.nodes);
        let calls = nodes.filter(|(_, node)| {
            let callee = node.callee.and_then(|callee| self.image.containing(callee));
            callee.is_some_and(|callee| self.is_excluded(&callee.name))
        });
        let calls = calls.map(|(at, node)| {
            let is_call = matches!(node.decoded.flow, Flow::Call(_));
            ensure!(is_call, "excluded code is jumped to at {at:#x}; its return is not known");
            Ok((*at, at + node.size))
        });
        calls.collect()
    }

    /// All functions that have been bounded, with their cost for each call.
    pub fn functions(&self) -> impl Iterator<Item = (u64, Option<u64>, &Cost)> {
        self.costs.iter().map(|((start, bytes), cost)| (*start, *bytes, cost))
    }

    /// Costs of the function called at `address` of a known function, as [`cost`](Self::cost).
    pub fn called(&self, caller: u64, address: u64, callee: u64) -> Result<Cost> {
        let bytes = self.bytes(caller, address, callee, None)?;
        ensure!(
            !self.unbounded.contains(&callee),
            "a function without a bound is called at {address:#x}: {}",
            self.limits.place(address)
        );
        Ok(self.costs.get(&(callee, bytes)).cloned().unwrap_or_else(no_cost))
    }

    /// Exclusions that met no function: what they name is called otherwise now, and is taken to be executed.
    pub fn idle_exclusions(&self) -> impl Iterator<Item = &str> {
        let met = |part: &str| self.met.iter().any(|name| name.contains(part));
        self.excluded.iter().copied().filter(move |part| !met(part))
    }

    fn is_excluded(&self, name: &str) -> bool {
        self.excluded.iter().any(|part| name.contains(part))
    }

    /// Bytes that a call at `address` copies, if it calls a routine for that.
    fn bytes(
        &self,
        caller: u64,
        address: u64,
        callee: u64,
        inherited: Option<u64>,
    ) -> Result<Option<u64>> {
        let name = |at| self.image.containing(at).map_or("", |function| &*function.name);
        let Some(register) = routine(name(callee)) else { return Ok(None) };
        if let Some(bytes) = inherited {
            // One routine jumps into another; those for aligned memory leave less than a word to it.
            let aligned = name(caller).ends_with(['4', '8']);
            return Ok(Some(if aligned { bytes % 4 } else { bytes }));
        }
        let known = self.functions.get(&caller);
        if let Some(bytes) = known.and_then(|known| known.constants.get(address, register)) {
            return Ok(Some(bytes));
        }
        let found = self.limits.bytes(address)?;
        let found = found.with_context(|| {
            format!(
                "`{}` calls `{}` at {address:#x} with a length that is not known; annotate it: {}",
                name(caller),
                name(callee),
                self.limits.place(address)
            )
        })?;
        Ok(Some(found))
    }

    fn cost_below(&mut self, start: u64, bytes: Option<u64>, path: &mut Vec<u64>) -> Result<Cost> {
        if let Some(known) = self.costs.get(&(start, bytes)) {
            return Ok(known.clone());
        }
        let function = self.image.containing(start).context("no function")?;
        let name = function.name.clone();
        if self.is_excluded(&name) {
            self.met.insert(name);
            self.costs.insert((start, bytes), no_cost());
            return Ok(no_cost());
        }
        ensure!(!path.contains(&start), "`{name}` is recursive: it has no bound");
        if !self.functions.contains_key(&start) {
            self.functions.insert(start, Known::read(function, self.image, self.listing)?);
        }
        path.push(start);
        let mut called = BTreeMap::new();
        let nodes = self.functions[&start].graph.nodes.iter();
        let calls: Vec<_> = nodes.filter_map(|(at, node)| Some((*at, node.callee?))).collect();
        for (at, callee) in calls {
            let bytes = self.bytes(start, at, callee, bytes).unwrap_or_else(|problem| {
                self.problem(start, &problem);
                Some(1)
            });
            let cost = self.cost_below(callee, bytes, path);
            called.insert(at, cost.with_context(|| format!("below `{name}`"))?);
            if self.unbounded.contains(&callee) {
                self.unbounded.insert(start);
            }
        }
        path.pop();
        let cost = self.own(start, &name, bytes, &called).unwrap_or_else(|problem| {
            self.problem(start, &problem);
            no_cost()
        });
        self.costs.insert((start, bytes), cost.clone());
        Ok(cost)
    }

    fn problem(&mut self, function: u64, problem: &anyhow::Error) {
        self.problems.push(format!("{problem:#}"));
        self.unbounded.insert(function);
    }

    /// Bound of one function whose callees have theirs.
    fn own(
        &mut self,
        start: u64,
        name: &str,
        bytes: Option<u64>,
        called: &BTreeMap<u64, Cost>,
    ) -> Result<Cost> {
        let known = &self.functions[&start];
        let pruned = routine(name).zip(bytes).map(|(register, bytes)| {
            let constants = Constants::of(&known.graph, [(register, bytes)].into());
            constants.pruned(&known.graph)
        });
        let graph = pruned.as_ref().unwrap_or(&known.graph);
        let mut cost = Cost::default();
        for below in called.values() {
            cost.in_all.extend(below.in_all.clone());
        }
        let mut limits = BTreeMap::new();
        let shape = weighted(graph, Model::Instructions, |_, _| 0);
        for found in shape.loops(graph.entry).with_context(|| format!("in `{name}`"))? {
            let limit = self.limits.of(&found, graph, &known.constants, name, bytes);
            let limit = limit.unwrap_or_else(|problem| {
                self.problems.push(problem.to_string());
                self.unbounded.insert(start);
                self.unbounded_loops.insert(found.header);
                Found { limit: Limit::Each(1), scope: None, origin: String::new() }
            });
            let entered_from = entries(graph, &found);
            let (function, header) = (name.to_owned(), found.header);
            limits.insert(header, limit.limit);
            if let Some(scope) = &limit.scope {
                self.scopes.insert(header, scope.clone());
            }
            self.loops.push(BoundedLoop { function, header, entered_from, found: limit });
        }
        for model in Model::ALL {
            let weighted = weighted(graph, model, |_, at| called[&at].each[&model]);
            let limit = |found: &Loop| Ok(limits[&found.header]);
            let longest = weighted
                .longest(graph.entry, self.per_us, &limit)
                .with_context(|| format!("in `{name}`"))?;
            cost.each.insert(model, entry(graph, model) + longest.most);
            for (header, rounds) in longest.in_all {
                cost.in_all.entry(header).or_default().insert(model, rounds);
            }
        }
        self.close_scopes(name, &mut cost);
        Ok(cost)
    }

    /// Adds what is limited over a call of the function `name` to the cost of that call.
    fn close_scopes(&self, name: &str, cost: &mut Cost) {
        let Cost { each, in_all } = cost;
        in_all.retain(|header, rounds| {
            let closes = self.scopes.get(header).is_some_and(|scope| name.contains(&**scope));
            for (model, rounds) in rounds.iter().filter(|_| closes) {
                *each.entry(*model).or_default() += rounds;
            }
            !closes
        });
    }
}

fn no_cost() -> Cost {
    Cost { each: Model::ALL.map(|model| (model, 0)).into(), in_all: BTreeMap::new() }
}

fn entries(graph: &FlowGraph, found: &Loop) -> Vec<u64> {
    let outside = graph.nodes.iter().filter(|(at, node)| {
        !found.nodes.contains(at) && node.edges.iter().any(|edge| edge.to == found.header)
    });
    outside.map(|(at, _)| *at).collect()
}
