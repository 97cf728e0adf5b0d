//! Rows that are shown one by one: a bounded draw that does not depend on their order.

use std::collections::BTreeMap;

use crate::campaign::Row;

/// Keeps the rows whose seeds come first when seeds are shuffled, so that all variants of a run stay
/// together, and a longer campaign keeps some of the same runs.
#[derive(Clone, Debug)]
pub struct Points {
    limit: usize,
    drawn: BTreeMap<(u64, u32, usize), Row>,
}

impl Points {
    /// Keeps at most `limit` rows.
    #[must_use]
    pub fn new(limit: usize) -> Self {
        Self { limit, drawn: BTreeMap::new() }
    }

    /// Takes in a row.
    pub fn push(&mut self, row: &Row) {
        let place = (shuffled(row.seed), row.seed, row.variant);
        let last = self.drawn.last_key_value().map(|(place, _)| *place);
        if self.drawn.len() < self.limit || last.is_some_and(|last| place < last) {
            self.drawn.insert(place, row.clone());
            if self.drawn.len() > self.limit {
                self.drawn.pop_last();
            }
        }
    }

    /// The rows.
    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        self.drawn.values()
    }
}

/// The mixing function of SplitMix64 (Steele, Lea, Flood 2014), one to one.
fn shuffled(seed: u32) -> u64 {
    let mut x = u64::from(seed).wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::RunOutcome;

    fn row(seed: u32) -> Row {
        Row {
            seed,
            variant: 0,
            parameters: Vec::new(),
            outcome: RunOutcome::Held,
            reason: String::new(),
            assumptions_kept: true,
            measures: Vec::new(),
            guarantees: Vec::new(),
        }
    }

    fn drawn(seeds: impl Iterator<Item = u32>) -> Vec<u32> {
        let mut points = Points::new(100);
        seeds.for_each(|seed| points.push(&row(seed)));
        let mut seeds: Vec<_> = points.rows().map(|row| row.seed).collect();
        seeds.sort_unstable();
        seeds
    }

    #[test]
    fn the_draw_is_bounded_spread_and_independent_of_order() {
        let forwards = drawn(0..10_000);
        assert_eq!(forwards.len(), 100);
        assert_eq!(forwards, drawn((0..10_000).rev()));
        let early = forwards.iter().filter(|seed| **seed < 5_000).count();
        assert!((30..=70).contains(&early), "{early} of 100 in the first half");
    }

    #[test]
    fn few_rows_are_all_kept() {
        assert_eq!(drawn(5..25), (5..25).collect::<Vec<_>>());
    }
}
