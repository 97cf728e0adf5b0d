//! Bounds on the probability of a violation from a count of violated runs: the exact (conservative)
//! bounds of Clopper and Pearson, Biometrika 26 (1934) 404-413, as quantiles of beta distributions.

use serde::Serialize;
use statrs::function::beta::beta_reg;

/// Probability with which the bounds hold.
pub const CONFIDENCE: f64 = 0.95;

/// Bounds of the probability that a run violates a guarantee, each in `[0, 1]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FailureProbability {
    /// Lower end of the two-sided interval.
    pub lower: f64,
    /// Upper end of the two-sided interval.
    pub upper: f64,
    /// The one-sided upper bound.
    pub below: f64,
}

impl FailureProbability {
    /// After `violated` of `runs` independent draws; none if there was no run, or fewer runs than
    /// violations.
    #[must_use]
    pub fn observed(violated: u64, runs: u64) -> Option<Self> {
        let held = runs.checked_sub(violated).filter(|_| runs > 0)?;
        let outside = 1.0 - CONFIDENCE;
        Some(Self {
            lower: lower_bound(violated, held, 0.5 * outside),
            upper: upper_bound(violated, held, 0.5 * outside),
            below: upper_bound(violated, held, outside),
        })
    }
}

/// The least probability of what happened `hits` times that gives as many or more with a
/// probability of `tail`.
#[must_use]
pub fn lower_bound(hits: u64, misses: u64, tail: f64) -> f64 {
    match (hits, misses) {
        (0, _) => 0.0,
        (_, 0) => tail.powf(1.0 / hits as f64),
        _ => quantile(hits as f64, misses as f64 + 1.0, tail),
    }
}

/// The largest probability of what happened `hits` times that gives as many or fewer with a probability of `tail`.
#[must_use]
pub fn upper_bound(hits: u64, misses: u64, tail: f64) -> f64 {
    1.0 - lower_bound(misses, hits, tail)
}

/// Quantile of beta(`a`, `b`) at `probability`, to the last bit by
/// bisection: the crate's own inverse is off by 1e-5 of the value after a million runs.
fn quantile(a: f64, b: f64, probability: f64) -> f64 {
    let (mut below, mut above) = (0.0, 1.0);
    loop {
        let middle = 0.5 * (below + above);
        if middle <= below || middle >= above {
            return middle;
        }
        if beta_reg(a, b, middle) < probability {
            below = middle;
        } else {
            above = middle;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Violated, runs, and the three bounds of `scipy.stats.beta.ppf` (1.17).
    const SCIPY: [(u64, u64, f64, f64, f64); 12] = [
        (0, 1, 0.0, 0.975, 0.95),
        (0, 10, 0.0, 0.3084971078187607, 0.2588655508930522),
        (0, 10_000, 0.0, 0.00036881991461876225, 0.00029952835977661195),
        (1, 10, 0.0025285785444617848, 0.4450161170281954, 0.39416330243650466),
        (3, 50, 0.01254858783533406, 0.16548194660377288, 0.14783717636418123),
        (10, 10, 0.6915028921812392, 1.0, 1.0),
        (50, 100, 0.39832112950330095, 0.601678870496699, 0.5863782853890882),
        (500, 10_000, 0.04580994219877059, 0.05445452702835887, 0.05373317819066032),
        (5_000, 10_000, 0.4901513805899805, 0.5098486194100196, 0.5082734955962607),
        (12, 1_000_000, 6.200589988389881e-6, 2.0961491123683136e-5, 1.9442496978462016e-5),
        (500_000, 1_000_000, 0.49901951919531184, 0.5009804808046882, 0.5008229260505229),
        (9_999, 10_000, 0.9994429630020529, 0.9999974682224065, 0.9999948706837163),
    ];

    #[test]
    fn bounds_are_those_of_scipy() {
        for (violated, runs, lower, upper, below) in SCIPY {
            let bounds = FailureProbability::observed(violated, runs).expect("there were runs");
            for (ours, scipy) in
                [(bounds.lower, lower), (bounds.upper, upper), (bounds.below, below)]
            {
                assert!(
                    (ours - scipy).abs() <= 1e-9 * scipy,
                    "{violated} of {runs}: {ours}, SciPy {scipy}"
                );
            }
        }
    }

    #[test]
    fn no_violation_gives_the_rule_of_three() {
        for runs in [100, 1_000, 10_000, 1_000_000] {
            let bounds = FailureProbability::observed(0, runs).expect("there were runs");
            let rule_of_three = 3.0 / runs as f64;
            assert!(bounds.below < rule_of_three && bounds.below > 0.98 * rule_of_three);
            assert_eq!(bounds.lower, 0.0);
        }
    }

    #[test]
    fn the_bounds_cover_with_the_stated_probability() {
        for (probability, runs) in [(0.01f64, 60u64), (0.2, 25), (0.5, 10), (0.97, 40)] {
            let mut covered = [0.0; 2];
            let mut weight = (1.0 - probability).powi(runs as i32);
            for violated in 0..=runs {
                let bounds = FailureProbability::observed(violated, runs).expect("runs");
                if (bounds.lower..=bounds.upper).contains(&probability) {
                    covered[0] += weight;
                }
                if probability <= bounds.below {
                    covered[1] += weight;
                }
                weight *= (runs - violated) as f64 / (violated + 1) as f64 * probability
                    / (1.0 - probability);
            }
            assert!(covered.iter().all(|share| *share >= CONFIDENCE), "{probability}: {covered:?}");
        }
    }

    #[test]
    fn no_runs_give_no_bounds() {
        assert_eq!(FailureProbability::observed(0, 0), None);
        assert_eq!(FailureProbability::observed(2, 1), None);
    }
}
