//! The runs closest to a bound, or furthest beyond it.

/// A run and how far it was from a bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Close {
    /// Distance from the bound, positive on the good side; NaN is worse than any number.
    pub margin: f64,
    /// The value that came closest to the bound.
    pub observed: Option<f64>,
    /// Seed of the run.
    pub seed: u32,
}

/// Keeps the few runs with the least margins; of equal margins, that of the lower seed.
#[derive(Clone, Debug)]
pub struct Tightest {
    limit: usize,
    kept: Vec<Close>,
}

impl Tightest {
    /// Keeps at most `limit`.
    #[must_use]
    pub fn new(limit: usize) -> Self {
        Self { limit, kept: Vec::with_capacity(limit + 1) }
    }

    /// Takes in a run.
    pub fn push(&mut self, run: Close) {
        let rank =
            |close: &Close| if close.margin.is_nan() { f64::NEG_INFINITY } else { close.margin };
        let before =
            |kept: &Close| rank(kept).total_cmp(&rank(&run)).then(kept.seed.cmp(&run.seed)).is_lt();
        let place = self.kept.partition_point(before);
        if place < self.limit {
            self.kept.insert(place, run);
            self.kept.truncate(self.limit);
        }
    }

    /// `true` if the tightest run stands out from those after it: not where all reach the same value,
    /// as a saturated torque does.
    #[must_use]
    pub fn is_distinct(&self) -> bool {
        match (self.kept.first(), self.kept.last()) {
            (Some(first), Some(last)) => self.kept.len() == 1 || first.margin != last.margin,
            _ => false,
        }
    }

    /// Those kept, the tightest first.
    #[must_use]
    pub fn runs(&self) -> &[Close] {
        &self.kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_margins_are_kept_in_order_and_nan_comes_first() {
        let mut tightest = Tightest::new(3);
        for (seed, margin) in [(1, 4.0), (2, -1.0), (3, f64::NAN), (4, 9.0), (5, -1.0), (6, 0.5)] {
            tightest.push(Close { margin, observed: None, seed });
        }
        let seeds: Vec<_> = tightest.runs().iter().map(|run| run.seed).collect();
        assert_eq!(seeds, [3, 2, 5]);
        assert!(tightest.is_distinct());
    }

    #[test]
    fn equal_margins_do_not_stand_out() {
        let mut tightest = Tightest::new(2);
        assert!(!tightest.is_distinct());
        let run = |seed, margin| Close { margin, observed: None, seed };
        tightest.push(run(1, 0.0));
        assert!(tightest.is_distinct(), "a single run");
        tightest.push(run(2, 0.0));
        assert!(!tightest.is_distinct());
        tightest.push(run(3, -1.0));
        assert!(tightest.is_distinct());
    }
}
