//! One guarantee over all runs of one variant.

use super::failure_probability::FailureProbability;
use super::tightest::{Close, Tightest};
use crate::campaign::Observed;
use sim::guarantee::Requirement;

/// Runs closest to its bound that are kept of a guarantee.
const KEPT: usize = 5;

/// Counts of one guarantee in one variant.
#[derive(Clone, Debug)]
pub struct Tally {
    /// The bound in the run that the report looked it up in.
    pub requirement: Requirement,
    /// `true` if other runs have other bounds.
    pub varies: bool,
    /// Runs that were flown.
    pub runs: u64,
    /// Runs that violated it, those that observed nothing among them.
    pub violated: u64,
    /// Runs that observed nothing, as when a flight ends before it settles.
    pub unobserved: u64,
    /// The runs closest to the bound.
    pub tightest: Tightest,
}

impl Tally {
    /// Before the first run.
    #[must_use]
    pub fn new(requirement: Requirement) -> Self {
        let tightest = Tightest::new(KEPT);
        Self { requirement, varies: false, runs: 0, violated: 0, unobserved: 0, tightest }
    }

    /// `true` if it promises a bound; if not, its value is information.
    #[must_use]
    pub fn is_bound(&self) -> bool {
        self.requirement != Requirement::Information
    }

    /// Takes in a run that was flown.
    pub fn push(&mut self, seed: u32, seen: Observed) {
        self.runs += 1;
        if !self.is_bound() {
            return;
        }
        let margin = seen.margin.unwrap_or(f64::NAN);
        let expected = seen.observed.and_then(|observed| self.requirement.margin(observed));
        self.varies |=
            seen.margin.is_some_and(|margin| !margin.is_nan()) && expected != seen.margin;
        self.unobserved += u64::from(seen.observed.is_none());
        self.violated += u64::from(margin.is_nan() || margin < 0.0);
        self.tightest.push(Close { margin, observed: seen.observed, seed });
    }

    /// Bounds on the probability of a violation; none without runs.
    #[must_use]
    pub fn probability(&self) -> Option<FailureProbability> {
        FailureProbability::observed(self.violated, self.runs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(observed: f64, margin: f64) -> Observed {
        Observed { observed: Some(observed), margin: Some(margin) }
    }

    #[test]
    fn a_run_violates_beyond_its_bound_without_observation_and_with_nan() {
        let mut tally = Tally::new(Requirement::AtMost(2.0));
        tally.push(1, seen(2.0, 0.0));
        tally.push(2, seen(2.5, -0.5));
        tally.push(3, Observed::default());
        tally.push(4, seen(f64::NAN, f64::NAN));
        assert_eq!((tally.runs, tally.violated, tally.unobserved), (4, 3, 1));
        assert!(!tally.varies);
        assert_eq!(tally.tightest.runs()[0].seed, 3);
    }

    #[test]
    fn a_bound_that_changes_with_the_run_is_noticed() {
        let mut tally = Tally::new(Requirement::AtMost(2.0));
        tally.push(1, seen(1.5, 0.5));
        assert!(!tally.varies);
        tally.push(2, seen(1.5, 1.5));
        assert!(tally.varies);
    }

    #[test]
    fn information_is_never_violated() {
        let mut tally = Tally::new(Requirement::Information);
        tally.push(1, Observed { observed: Some(3.0), margin: None });
        assert_eq!((tally.runs, tally.violated), (1, 0));
        assert!(tally.tightest.runs().is_empty());
    }
}
