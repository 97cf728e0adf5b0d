//! Critical sections: the longest time that a task keeps tasks above it from running.
//!
//! RTIC's locks raise BASEPRI (`msr basepri_max`) and restore it (`msr basepri`); the log turns all interrupts
//! off (`cpsid i` to `msr primask` or `cpsie i`). A walk over each function keeps the stack of ceilings at
//! every instruction; a section is a part of the graph in which the highest of them is at least a priority.
//! A function that is called in a section is in it as a whole.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, bail};

use super::analysis::{Analysis, Functions, Known};
use super::bound::weighted;
use super::flow::Node;
use super::path::{Limit, Loop, Weighted};
use super::timing::Model;

/// Ceiling of a section with all interrupts off, and of one whose level is not known.
pub const ALL: u64 = 16;

/// Ceilings in force, and those of the caller that have been left.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct State {
    ceilings: Vec<u64>,
    left: u64,
}

/// Change of the state.
enum Change {
    /// None for a level that is not known.
    Raise(Option<u64>),
    RestoreLevel,
    RestoreAll,
}

/// Longest time in sections with a ceiling of at least `priority`, in the function at `start` and all that it
/// calls.
pub fn longest(analysis: &Analysis, start: u64, priority: u64, model: Model) -> Result<u64> {
    let (mut most, mut done, mut open) = (0, BTreeSet::new(), vec![start]);
    let mut effects = BTreeMap::new();
    while let Some(function) = open.pop() {
        if !done.insert(function) {
            continue;
        }
        let Some(known) = analysis.known(function) else { continue };
        let states = states(&analysis.functions, function, known, &mut effects)?;
        let sections = Sections { analysis, function, known, states, priority, model };
        most = most.max(sections.longest()?);
        let callees = known.graph.nodes.values();
        open.extend(callees.filter_map(|node| node.callee));
    }
    Ok(most)
}

/// Ceilings in a function that is entered without sections.
pub struct Ceilings {
    /// Highest one before each instruction; zero for none.
    pub before: BTreeMap<u64, u64>,
    /// A section of its caller ends in it.
    pub ends_callers: bool,
    /// It restores a level that it has not raised, as a handler does when it is done.
    pub lowers: bool,
}

/// Ceilings before the instructions of an analysed function; fails on a section whose level is not known.
pub fn ceilings(functions: &Functions, function: u64) -> Result<Ceilings> {
    let known = functions.get(&function).context("a function that is not known")?;
    for (address, node) in &known.graph.nodes {
        if let Some(Change::Raise(None)) = change(*address, node, known) {
            bail!("the level of the critical section at {address:#x} is not known");
        }
    }
    let states = states(functions, function, known, &mut BTreeMap::new())?;
    let restores =
        |address: &u64, all: bool| match change(*address, &known.graph.nodes[address], known) {
            Some(Change::RestoreAll) => all,
            Some(Change::RestoreLevel) => !all,
            _ => false,
        };
    // What is restored was not raised here.
    let callers = |all: bool| {
        let mut states = states.iter();
        states.any(|(address, state)| {
            restores(address, all) && !state.ceilings.iter().any(|level| (*level == ALL) == all)
        })
    };
    let highest = |state: &State| state.ceilings.iter().copied().max().unwrap_or(0);
    Ok(Ceilings {
        ends_callers: callers(true) || states.values().any(|state| state.left > 0),
        lowers: callers(false),
        before: states.iter().map(|(address, state)| (*address, highest(state))).collect(),
    })
}

/// State before each instruction of a function that is entered without sections.
fn states(
    functions: &Functions,
    function: u64,
    known: &Known,
    effects: &mut BTreeMap<u64, State>,
) -> Result<BTreeMap<u64, State>> {
    let entry = known.graph.entry;
    let mut before = BTreeMap::from([(entry, State::default())]);
    let mut open = vec![entry];
    while let Some(address) = open.pop() {
        let node = &known.graph.nodes[&address];
        let after = behind(functions, address, node, known, &before[&address], effects)?;
        for edge in &node.edges {
            match before.get(&edge.to) {
                None => {
                    before.insert(edge.to, after.clone());
                    open.push(edge.to);
                }
                Some(other) if *other == after => {}
                Some(other) => bail!(
                    "critical sections differ on two ways to {:#x} of the function at {function:#x}: \
                     {other:?}, {after:?}",
                    edge.to
                ),
            }
        }
    }
    Ok(before)
}

fn behind(
    functions: &Functions,
    address: u64,
    node: &Node,
    known: &Known,
    before: &State,
    effects: &mut BTreeMap<u64, State>,
) -> Result<State> {
    let mut state = before.clone();
    match change(address, node, known) {
        Some(Change::Raise(ceiling)) => state.ceilings.push(ceiling.unwrap_or(ALL)),
        Some(Change::RestoreAll) => restore(&mut state, |ceiling| ceiling == ALL),
        Some(Change::RestoreLevel) => restore(&mut state, |ceiling| ceiling < ALL),
        None => {}
    }
    if let Some(callee) = node.callee {
        let effect = effect(functions, callee, effects)?;
        for _ in 0..effect.left {
            restore(&mut state, |ceiling| ceiling == ALL);
        }
        state.ceilings.extend(effect.ceilings);
    }
    Ok(state)
}

fn restore(state: &mut State, which: impl Fn(u64) -> bool) {
    match state.ceilings.iter().rposition(|ceiling| which(*ceiling)) {
        Some(place) => {
            state.ceilings.remove(place);
        }
        None => state.left += u64::from(which(ALL)),
    }
}

/// What a function leaves changed: sections that it begins, and sections of its caller that it ends.
fn effect(
    functions: &Functions,
    function: u64,
    effects: &mut BTreeMap<u64, State>,
) -> Result<State> {
    if let Some(known) = effects.get(&function) {
        return Ok(known.clone());
    }
    let Some(known) = functions.get(&function) else { return Ok(State::default()) };
    let states = states(functions, function, known, effects)?;
    let ends = known.graph.nodes.iter().filter(|(_, node)| node.edges.is_empty());
    let mut found: Option<State> = None;
    for (address, node) in ends {
        let Some(before) = states.get(address) else { continue };
        if node.decoded.flow == super::instruction::Flow::Trap {
            continue;
        }
        let after = behind(functions, *address, node, known, before, effects)?;
        if let Some(found) = &found
            && *found != after
        {
            bail!("the function at {function:#x} ends in different critical sections");
        }
        found = Some(after);
    }
    let found = found.unwrap_or_default();
    effects.insert(function, found.clone());
    Ok(found)
}

fn change(address: u64, node: &Node, known: &Known) -> Option<Change> {
    let (name, operands) = (node.instruction.name(), node.instruction.operands.as_str());
    match (name, operands.split_once(',')) {
        ("msr", Some(("basepri_max", register))) => {
            let level = super::constants::number(register)
                .and_then(|register| known.constants.get(address, register));
            // Priority 1 of 16 is level 0xf0.
            Some(Change::Raise(level.map(|level| (ALL - (level >> 4)).min(ALL - 1))))
        }
        ("msr", Some(("basepri", _))) => Some(Change::RestoreLevel),
        ("msr", Some(("primask", _))) => Some(Change::RestoreAll),
        ("cpsid", _) => Some(Change::Raise(Some(ALL))),
        ("cpsie", _) => Some(Change::RestoreAll),
        _ => None,
    }
}

struct Sections<'a> {
    analysis: &'a Analysis<'a>,
    function: u64,
    known: &'a Known,
    states: BTreeMap<u64, State>,
    priority: u64,
    model: Model,
}

impl Sections<'_> {
    fn longest(&self) -> Result<u64> {
        let mut most = 0;
        let starts = self.known.graph.nodes.iter().filter(|(address, node)| {
            let begins = node.edges.iter().any(|edge| self.is_inside(edge.to));
            begins && !self.is_inside(**address)
        });
        for (start, _) in starts {
            most = most.max(self.from(*start)?);
        }
        Ok(most)
    }

    fn is_inside(&self, address: u64) -> bool {
        let state = self.states.get(&address);
        state.is_some_and(|state| state.ceilings.iter().any(|ceiling| *ceiling >= self.priority))
    }

    /// Cost of the section that begins with the instruction at `start`, which belongs to it, as does the one
    /// that ends it.
    fn from(&self, start: u64) -> Result<u64> {
        let graph = &self.known.graph;
        let mut in_all = BTreeMap::new();
        let mut calls = BTreeMap::new();
        for (address, node) in &graph.nodes {
            if let Some(callee) = node.callee {
                if !self.is_inside(*address) && *address != start {
                    calls.insert(*address, 0);
                    continue;
                }
                let cost = self.analysis.called(self.function, *address, callee)?;
                calls.insert(*address, cost.each[&self.model]);
                in_all.extend(cost.in_all.clone());
            }
        }
        let all = weighted(graph, self.model, |_, at| calls[&at]);
        let mut section = Weighted::default();
        let mut open = vec![start];
        let mut seen = BTreeSet::new();
        while let Some(address) = open.pop() {
            if !seen.insert(address) {
                continue;
            }
            let goes_on = address == start || self.is_inside(address);
            let (cost, mut edges) = all.node(address).context("a node of the graph")?;
            edges.retain(|(to, _)| {
                goes_on && *to != start && (address != start || self.is_inside(*to))
            });
            open.extend(edges.iter().map(|(to, _)| *to));
            section.add(address, cost, if goes_on { edges } else { Vec::new() });
        }
        let limit = |found: &Loop| -> Result<Limit> {
            self.analysis
                .limit_in(self.function, found.header)
                .with_context(|| format!("a loop in a critical section at {:#x}", found.header))
        };
        let longest = section.longest(start, self.analysis.per_us(), &limit)?;
        let rounds: u64 = longest.in_all.values().sum();
        let below: u64 = in_all.values().map(|costs| costs[&self.model]).sum();
        Ok(longest.most + rounds + below)
    }
}
