//! The most expensive path through a graph without cycles.

use std::collections::BTreeMap;

use anyhow::{Result, bail};

/// A graph whose nodes and edges cost something; a node without edges ends the path.
#[derive(Default)]
pub struct Weighted {
    nodes: BTreeMap<u64, (u64, Vec<(u64, u64)>)>,
}

impl Weighted {
    /// Adds a node with its own cost, and its successors with the cost of the way there.
    pub fn add(&mut self, node: u64, cost: u64, edges: Vec<(u64, u64)>) {
        self.nodes.insert(node, (cost, edges));
    }

    /// Cost of the most expensive path from `entry`; fails on a loop, which has no bound.
    pub fn longest(&self, entry: u64) -> Result<u64> {
        let (mut done, mut path) = (BTreeMap::new(), vec![(entry, 0)]);
        let mut open = std::collections::BTreeSet::from([entry]);
        while let Some((node, next)) = path.last_mut() {
            let (node, (cost, edges)) = (*node, &self.nodes[node]);
            if let Some((to, _)) = edges.get(*next) {
                *next += 1;
                if open.contains(to) {
                    bail!("a loop from {node:#x} back to {to:#x} has no bound: unroll it");
                }
                if !done.contains_key(to) {
                    open.insert(*to);
                    path.push((*to, 0));
                }
                continue;
            }
            let rest = edges.iter().map(|(to, way)| way + done[to]).max().unwrap_or(0);
            done.insert(node, cost + rest);
            open.remove(&node);
            path.pop();
        }
        Ok(done[&entry])
    }
}

#[cfg(test)]
mod tests {
    use super::Weighted;

    #[test]
    fn the_dearer_branch_counts() {
        let mut graph = Weighted::default();
        graph.add(1, 1, vec![(2, 0), (3, 5)]);
        graph.add(2, 10, vec![(4, 0)]);
        graph.add(3, 4, vec![(4, 3)]);
        graph.add(4, 100, vec![]);
        assert_eq!(graph.longest(1).unwrap(), 113);
    }

    #[test]
    fn a_loop_is_refused_and_a_jump_back_is_not() {
        let mut graph = Weighted::default();
        graph.add(1, 1, vec![(5, 0)]);
        graph.add(5, 1, vec![(3, 0)]);
        graph.add(3, 1, vec![]);
        assert_eq!(graph.longest(1).unwrap(), 3);
        graph.add(3, 1, vec![(5, 0)]);
        assert!(graph.longest(1).unwrap_err().to_string().contains("loop"));
    }
}
