//! The most expensive path through a graph whose loops have bounds.
//!
//! Strongly connected components are loops. A loop is entered at one node, its header; `limit` says how
//! often that is executed at most for each entry. With all ways back to the header taken out, a component is
//! a smaller graph of the same kind:
//!
//! ```text
//! cost of leaving a loop at v = (limit - 1) * dearest way round + dearest way from the header to v
//! ```

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, ensure};

/// Node before the entry, so that the entry itself can be the header of a loop.
const START: u64 = u64::MAX;

/// A way to another node, and its cost.
pub type Way = (u64, u64);

/// A graph whose nodes and edges cost something; a node without edges ends the path.
#[derive(Clone, Default)]
pub struct Weighted {
    nodes: BTreeMap<u64, (u64, Vec<Way>)>,
}

/// A loop: its header, all of its nodes, and those from which a way leads back to the header.
pub struct Loop {
    /// Only node that is entered from outside.
    pub header: u64,
    /// All nodes.
    pub nodes: BTreeSet<u64>,
    /// Nodes with a way back to the header.
    pub latches: Vec<u64>,
}

/// Bound of a loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// Executions of the header for each entry.
    Each(u64),
    /// Executions of the header over a release or over a call of some function: `Weighted::longest` leaves out all but
    /// the first for each entry, and the caller adds them once.
    InAll(u64),
    /// Time spent for each entry (us), by hardware that the loop waits for.
    Time(u64),
}

/// Cost of the dearest path.
pub struct Longest {
    /// Without the rounds that are limited in all.
    pub most: u64,
    /// Those rounds, by the loop's header.
    pub in_all: BTreeMap<u64, u64>,
}

impl Weighted {
    /// Adds a node with its own cost, and its successors with the cost of the way there.
    pub fn add(&mut self, node: u64, cost: u64, edges: Vec<Way>) {
        self.nodes.insert(node, (cost, edges));
    }

    /// Costs of the dearest paths from `entry`; `limit` bounds each loop or says why it has no bound, and
    /// `per_us` is the cost of a microsecond of waiting.
    pub fn longest(
        &self,
        entry: u64,
        per_us: u64,
        limit: &dyn Fn(&Loop) -> Result<Limit>,
    ) -> Result<Longest> {
        let (rooted, mut in_all) = (self.rooted(entry), BTreeMap::new());
        let region = rooted.reachable(START);
        let costs = rooted.forward(&region, START, per_us, limit, &mut in_all)?;
        rooted.require_end(&region)?;
        let ends = costs.iter().filter(|(node, _)| rooted.nodes[node].1.is_empty());
        Ok(Longest { most: ends.map(|(_, cost)| *cost).max().unwrap_or(0), in_all })
    }

    /// The graph with a node before `entry`.
    fn rooted(&self, entry: u64) -> Self {
        let mut rooted = self.clone();
        rooted.add(START, 0, vec![(entry, 0)]);
        rooted
    }

    /// Refuses code from which no path leads to an end.
    fn require_end(&self, region: &BTreeSet<u64>) -> Result<()> {
        let mut ending = BTreeSet::new();
        loop {
            let more: Vec<_> = region
                .difference(&ending)
                .filter(|node| {
                    let edges = &self.nodes[node].1;
                    edges.is_empty() || edges.iter().any(|(to, _)| ending.contains(to))
                })
                .copied()
                .collect();
            if more.is_empty() {
                break;
            }
            ending.extend(more);
        }
        match region.difference(&ending).next() {
            None => Ok(()),
            Some(node) => anyhow::bail!("a loop around {node:#x} never ends"),
        }
    }

    /// Cost and edges of a node.
    pub fn node(&self, node: u64) -> Option<(u64, Vec<Way>)> {
        self.nodes.get(&node).cloned()
    }

    fn reachable(&self, entry: u64) -> BTreeSet<u64> {
        let (mut found, mut open) = (BTreeSet::new(), vec![entry]);
        while let Some(node) = open.pop() {
            if found.insert(node) {
                open.extend(self.nodes[&node].1.iter().map(|(to, _)| *to));
            }
        }
        found
    }

    /// All loops below `entry`, outer ones first.
    pub fn loops(&self, entry: u64) -> Result<Vec<Loop>> {
        let rooted = self.rooted(entry);
        let (mut found, mut open) = (Vec::new(), vec![(rooted.reachable(START), START)]);
        while let Some((region, entry)) = open.pop() {
            for component in rooted.components(&region, entry) {
                if let Some(inner) = rooted.as_loop(&component, &region, entry)? {
                    open.push((inner.nodes.clone(), inner.header));
                    found.push(inner);
                }
            }
        }
        Ok(found)
    }

    /// The edges of a node inside `region` that do not lead back to its entry.
    fn ways<'a>(
        &'a self,
        node: u64,
        region: &'a BTreeSet<u64>,
        entry: u64,
    ) -> impl Iterator<Item = Way> + 'a {
        let edges = self.nodes[&node].1.iter().copied();
        edges.filter(move |(to, _)| *to != entry && region.contains(to))
    }

    fn as_loop(
        &self,
        component: &BTreeSet<u64>,
        region: &BTreeSet<u64>,
        entry: u64,
    ) -> Result<Option<Loop>> {
        let inside =
            |node: u64| self.ways(node, region, entry).filter(|(to, _)| component.contains(to));
        if component.iter().all(|node| inside(*node).next().is_none()) {
            return Ok(None);
        }
        let outside = region.difference(component);
        let entered: BTreeSet<u64> = outside
            .flat_map(|node| self.ways(*node, region, entry))
            .map(|(to, _)| to)
            .filter(|to| component.contains(to))
            .collect();
        let mut headers = entered.into_iter();
        let header = headers.next().context("a loop that nothing enters")?;
        ensure!(
            headers.next().is_none(),
            "the loop around {header:#x} has several entries and cannot be bounded"
        );
        let latches = component.iter().copied();
        let latches = latches.filter(|node| inside(*node).any(|(to, _)| to == header)).collect();
        Ok(Some(Loop { header, nodes: component.clone(), latches }))
    }

    fn forward(
        &self,
        region: &BTreeSet<u64>,
        entry: u64,
        per_us: u64,
        limit: &dyn Fn(&Loop) -> Result<Limit>,
        in_all: &mut BTreeMap<u64, u64>,
    ) -> Result<BTreeMap<u64, u64>> {
        let (mut before, mut to) = (BTreeMap::from([(entry, 0)]), BTreeMap::new());
        for component in self.components(region, entry) {
            let found = self.as_loop(&component, region, entry)?;
            let costs: BTreeMap<u64, u64> = if let Some(inner) = found {
                let start = before[&inner.header];
                let rest = self.forward(&inner.nodes, inner.header, per_us, limit, in_all)?;
                let back = inner.latches.iter().flat_map(|latch| {
                    let edges = self.nodes[latch].1.iter();
                    let back = edges.filter(|(to, _)| *to == inner.header);
                    back.map(|(_, way)| rest[latch] + way)
                });
                let round = back.max().unwrap_or(0);
                let rounds = match limit(&inner)? {
                    Limit::Each(most) => most.saturating_sub(1) * round,
                    Limit::Time(us) => us * per_us + round,
                    Limit::InAll(most) => {
                        in_all.insert(inner.header, most * round);
                        0
                    }
                };
                rest.into_iter().map(|(node, cost)| (node, start + rounds + cost)).collect()
            } else {
                let reached = component
                    .into_iter()
                    .filter_map(|node| Some((node, *before.get(&node)? + self.nodes[&node].0)));
                reached.collect()
            };
            for (node, cost) in &costs {
                for (next, way) in self.ways(*node, region, entry) {
                    if !costs.contains_key(&next) {
                        let reached = before.entry(next).or_insert(0);
                        *reached = (*reached).max(cost + way);
                    }
                }
            }
            to.extend(costs);
        }
        Ok(to)
    }

    /// Strongly connected components of `region` without the ways back to its entry, each behind all that
    /// lead to it (Tarjan's algorithm, without recursion).
    fn components(&self, region: &BTreeSet<u64>, entry: u64) -> Vec<BTreeSet<u64>> {
        let mut order = BTreeMap::new();
        let mut low = BTreeMap::new();
        let (mut stack, mut on_stack) = (Vec::new(), BTreeSet::new());
        let (mut components, mut path) = (Vec::new(), vec![(entry, 0)]);
        while let Some((node, next)) = path.last_mut() {
            let node = *node;
            if *next == 0 {
                order.insert(node, order.len());
                low.insert(node, order[&node]);
                stack.push(node);
                on_stack.insert(node);
            }
            let way = self.ways(node, region, entry).nth(*next);
            *next += 1;
            if let Some((to, _)) = way {
                if !order.contains_key(&to) {
                    path.push((to, 0));
                } else if on_stack.contains(&to) {
                    low.insert(node, low[&node].min(order[&to]));
                }
                continue;
            }
            path.pop();
            if let Some((parent, _)) = path.last() {
                low.insert(*parent, low[parent].min(low[&node]));
            }
            if low[&node] == order[&node] {
                let start = stack.iter().rposition(|on| *on == node).unwrap_or(0);
                let component: BTreeSet<u64> = stack.split_off(start).into_iter().collect();
                on_stack.retain(|node| !component.contains(node));
                components.push(component);
            }
        }
        components.reverse();
        components
    }
}

/// The judge of code that must have no loop.
pub fn no_loop(found: &Loop) -> Result<Limit> {
    let from = found.latches.first().copied().unwrap_or(found.header);
    anyhow::bail!("a loop from {from:#x} back to {:#x} has no bound: unroll it", found.header)
}

#[cfg(test)]
mod tests {
    use super::{Limit, Loop, Weighted, no_loop};
    use anyhow::Result;

    fn longest(graph: &Weighted, limit: &dyn Fn(&Loop) -> Result<Limit>) -> u64 {
        graph.longest(1, 168, limit).unwrap().most
    }

    #[test]
    fn the_dearer_branch_counts() {
        let mut graph = Weighted::default();
        graph.add(1, 1, vec![(2, 0), (3, 5)]);
        graph.add(2, 10, vec![(4, 0)]);
        graph.add(3, 4, vec![(4, 3)]);
        graph.add(4, 100, vec![]);
        assert_eq!(longest(&graph, &no_loop), 113);
    }

    #[test]
    fn a_loop_is_refused_and_a_jump_back_is_not() {
        let mut graph = Weighted::default();
        graph.add(1, 1, vec![(5, 0)]);
        graph.add(5, 1, vec![(3, 0)]);
        graph.add(3, 1, vec![]);
        assert_eq!(longest(&graph, &no_loop), 3);
        graph.add(3, 1, vec![(5, 0)]);
        let refused = |graph: &Weighted| graph.longest(1, 168, &no_loop).err().unwrap();
        assert!(refused(&graph).to_string().contains("loop"));
    }

    /// `1 -> 2 -> 3 -> {2, 4}`, and in node 3's place a loop of its own.
    fn nested() -> Weighted {
        let mut graph = Weighted::default();
        graph.add(1, 1, vec![(2, 0)]);
        graph.add(2, 10, vec![(3, 1), (5, 0)]);
        graph.add(3, 100, vec![(3, 2), (4, 0)]);
        graph.add(4, 1000, vec![(2, 3)]);
        graph.add(5, 7, vec![]);
        graph
    }

    #[test]
    fn loops_cost_their_rounds_and_nest() {
        let graph = nested();
        let limit = |found: &Loop| Ok(Limit::Each(if found.header == 2 { 4 } else { 5 }));
        // Five times node 3 and four ways back to it, in each of three rounds.
        let round = 10 + 1 + (5 * 100 + 4 * 2) + 1000 + 3;
        assert_eq!(longest(&graph, &limit), 1 + 3 * round + 10 + 7);
        let loops = graph.loops(1).unwrap();
        assert_eq!(loops.iter().map(|found| found.header).collect::<Vec<_>>(), [2, 3]);
    }

    #[test]
    fn a_limit_in_all_counts_once_and_a_time_as_such() {
        let graph = nested();
        let limit =
            |found: &Loop| Ok(if found.header == 2 { Limit::Each(4) } else { Limit::InAll(5) });
        let found = graph.longest(1, 168, &limit).unwrap();
        assert_eq!(found.in_all.get(&3), Some(&(5 * 102)));
        assert_eq!(found.most, 1 + 3 * (10 + 1 + 100 + 1000 + 3) + 10 + 7);
        let limit =
            |found: &Loop| Ok(if found.header == 2 { Limit::Each(2) } else { Limit::Time(2) });
        let found = graph.longest(1, 168, &limit).unwrap();
        assert_eq!(found.most, 1 + 10 + 1 + 2 * 168 + 102 + 100 + 1000 + 3 + 10 + 7);
    }

    #[test]
    fn the_entry_may_be_a_loops_header() {
        let mut graph = Weighted::default();
        graph.add(1, 10, vec![(1, 1), (2, 0)]);
        graph.add(2, 100, vec![]);
        assert!(graph.longest(1, 168, &no_loop).is_err());
        assert_eq!(longest(&graph, &|_| Ok(Limit::Each(3))), 2 * 11 + 10 + 100);
    }

    #[test]
    fn a_loop_with_two_entries_is_refused() {
        let mut graph = Weighted::default();
        graph.add(1, 1, vec![(2, 0), (3, 0)]);
        graph.add(2, 1, vec![(3, 0)]);
        graph.add(3, 1, vec![(2, 0)]);
        let error = graph.longest(1, 168, &|_| Ok(Limit::Each(2))).err().unwrap();
        assert!(error.to_string().contains("several entries"), "{error}");
    }
}
