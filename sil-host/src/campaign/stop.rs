//! Sequential stopping: a campaign that ends as soon as it has shown, or refuted, that runs violate a
//! guarantee with at most a demanded probability `p0`.
//!
//! Looking again and again at a bound that holds with 95 % each time gives an error sooner or later. So the looks
//! share the error `a = 1 - confidence`: look `c = 0, 1, 2, ...` spends `a_c = a/((c + 1)(c + 2))`, all together `a`,
//! and is taken at the least number of runs `n_c` after which `c` violations still show the demand,
//!
//! ```text
//! P(Bin(n_c, p0) <= c) <= a_c, that is: the upper bound of Clopper and Pearson at 1 - a_c is at most p0
//! ```
//!
//! The campaign ends at the first look with at most `c` violations. If `p > p0`, it does so with a probability of
//! at most `sum_c P(Bin(n_c, p) <= c) <= sum_c a_c = a`, whatever the dependence between the looks (Bonferroni). The
//! same looks refute the demand by lower bounds at `1 - a_c`, with an error of at most `a` if `p <= p0`.
//! That is alpha spending (Lan and DeMets, Biometrika 70, 1983) with exact bounds in place of normal ones, and
//! looks only where they can decide. Runs must be independent draws.

mod rule;

use serde::Serialize;

use super::plan::Campaign;
use super::report::failure_probability::{lower_bound, upper_bound};
use super::row::{Row, RunOutcome};
pub use rule::StopRule;

/// Result of the looks at one variant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Decision {
    /// The probability is at most the demanded one.
    Demonstrated,
    /// It is larger.
    Refuted,
    /// Neither could be shown in the runs that the definition allows.
    Undecided,
}

/// Evidence of one variant about the demanded probability.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evidence {
    /// The decision.
    pub decision: Decision,
    /// `p0`.
    pub demanded: f64,
    /// Probability with which the decision is right.
    pub confidence: f64,
    /// The guarantee, by the stem of its columns; any of them if absent.
    pub guarantee: Option<String>,
    /// Runs that were judged, and those of them that violated it.
    pub runs: u64,
    /// Violations among them.
    pub violated: u64,
    /// Looks taken.
    pub looks: u64,
    /// Bounds of the probability at the latest look; all bounds of all looks hold together, each side with the
    /// confidence.
    pub bounds: Option<(f64, f64)>,
}

/// Looks of a campaign in progress.
#[derive(Clone, Debug)]
pub struct Sequential {
    rule: StopRule,
    /// Number of the guarantee among the columns.
    guarantee: Option<usize>,
    variants: Vec<Evidence>,
    /// Runs before the next look, which all variants share.
    looks: Vec<u64>,
}

impl Sequential {
    /// Before the first run of `campaign`; none if it has no rule.
    #[must_use]
    pub fn new(campaign: &Campaign) -> Option<Self> {
        let rule = campaign.definition().stop.clone()?;
        let key = rule.guarantee.as_ref();
        let guarantee =
            key.and_then(|key| campaign.guarantees().iter().position(|it| it.key == *key));
        let evidence = Evidence {
            decision: Decision::Undecided,
            demanded: rule.failure_probability,
            confidence: rule.confidence,
            guarantee: rule.guarantee.clone(),
            runs: 0,
            violated: 0,
            looks: 0,
            bounds: None,
        };
        let variants = vec![evidence; campaign.variants().len()];
        let looks = vec![rule.look(0)];
        Some(Self { rule, guarantee, variants, looks })
    }

    /// Takes in the rows of the next run; `true` once every variant is decided.
    pub fn push(&mut self, rows: &[Row]) -> bool {
        for row in rows.iter().filter(|row| row.outcome != RunOutcome::Refused) {
            let violated = match self.guarantee {
                None => row.outcome == RunOutcome::Violated,
                Some(number) => row.guarantees[number].is_violated(),
            };
            self.judge(row.variant, violated);
        }
        self.is_decided()
    }

    /// `true` once every variant is decided.
    #[must_use]
    pub fn is_decided(&self) -> bool {
        self.variants.iter().all(|it| it.decision != Decision::Undecided)
    }

    /// Evidence of each variant.
    #[must_use]
    pub fn evidence(self) -> Vec<Evidence> {
        self.variants
    }

    fn judge(&mut self, variant: usize, violated: bool) {
        let evidence = &mut self.variants[variant];
        if evidence.decision != Decision::Undecided {
            return; // the other variants are not
        }
        evidence.runs += 1;
        evidence.violated += u64::from(violated);
        let look = evidence.looks;
        if evidence.runs < self.looks[look as usize] {
            return;
        }
        evidence.look(self.rule.spent(look));
        if self.looks.len() as u64 <= look + 1 {
            self.looks.push(self.rule.look(look + 1));
        }
    }
}

impl Evidence {
    /// Looks at the runs so far, at the error `spent`.
    fn look(&mut self, spent: f64) {
        let held = self.runs - self.violated;
        let lower = lower_bound(self.violated, held, spent);
        let upper = upper_bound(self.violated, held, spent);
        self.bounds = Some((lower, upper));
        if self.violated <= self.looks {
            self.decision = Decision::Demonstrated;
        } else if lower > self.demanded {
            self.decision = Decision::Refuted;
        }
        self.looks += 1;
    }

    /// In a sentence.
    #[must_use]
    pub fn sentence(&self) -> String {
        let Self { demanded, confidence, runs, violated, .. } = self;
        let what = self.guarantee.as_deref().unwrap_or("any guarantee");
        let result = match self.decision {
            Decision::Demonstrated => "is shown to be at most",
            Decision::Refuted => "is shown to be above",
            Decision::Undecided => "is neither shown to be at most nor above",
        };
        let bounds = self.bounds.map_or_else(
            || "before the first look".to_owned(),
            |(lower, upper)| format!("bounds {lower:.2e} and {upper:.2e} at look {}", self.looks),
        );
        format!(
            "probability of violating {what} {result} {demanded:e}, confidence {confidence}: {violated} of {runs} \
             runs, {bounds}"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rule(failure_probability: f64) -> StopRule {
        StopRule { failure_probability, confidence: 0.95, guarantee: None }
    }

    fn sequential(rule: &StopRule) -> Sequential {
        let evidence = Evidence {
            decision: Decision::Undecided,
            demanded: rule.failure_probability,
            confidence: rule.confidence,
            guarantee: None,
            runs: 0,
            violated: 0,
            looks: 0,
            bounds: None,
        };
        let looks = vec![rule.look(0)];
        Sequential { rule: rule.clone(), guarantee: None, variants: vec![evidence], looks }
    }

    #[test]
    fn looks_are_where_the_bound_of_clopper_and_pearson_first_meets_the_demand() {
        for p in [0.3, 0.01, 1e-4] {
            let rule = rule(p);
            for look in [0, 1, 2, 5, 20, 100] {
                let (runs, spent) = (rule.look(look), rule.spent(look));
                assert!(upper_bound(look, runs - look, spent) <= p * (1.0 + 1e-9));
                if runs > look + 1 {
                    assert!(upper_bound(look, runs - 1 - look, spent) > p);
                }
            }
            // Without a violation: (1 - p0)^n <= a/2.
            let first = (0.025f64.ln() / (1.0 - p).ln()).ceil();
            assert_eq!(rule.look(0), first as u64);
        }
        let spent: f64 = (0..10_000_000).map(|look| rule(0.1).spent(look)).sum();
        assert!(spent < 0.05 && spent > 0.049_999, "{spent}");
    }

    /// Probabilities of each decision within `runs` runs that fail with probability `p`, by the exact
    /// distribution of the number of violations of campaigns that go on.
    fn decided(rule: &StopRule, p: f64, runs: u64) -> (f64, f64) {
        let (mut going, mut demonstrated, mut refuted) = (vec![1.0], 0.0, 0.0);
        let mut look = 0;
        let mut next = rule.look(0);
        for run in 1..=runs {
            going.push(0.0);
            for violated in (0..going.len()).rev() {
                let one_less = if violated > 0 { going[violated - 1] } else { 0.0 };
                going[violated] = going[violated] * (1.0 - p) + one_less * p;
            }
            if run < next {
                continue;
            }
            for violated in 0..going.len() as u64 {
                let weight = &mut going[violated as usize];
                if violated <= look {
                    demonstrated += core::mem::take(weight);
                } else if *weight > 1e-12
                    && lower_bound(violated, run - violated, rule.spent(look))
                        > rule.failure_probability
                {
                    refuted += core::mem::take(weight);
                }
            }
            look += 1;
            next = rule.look(look);
        }
        (demonstrated, refuted)
    }

    #[test]
    fn wrong_decisions_are_as_rare_as_promised() {
        let rule = rule(0.02);
        for p in [0.0200001, 0.022, 0.03] {
            let (demonstrated, _) = decided(&rule, p, 3_000);
            assert!(demonstrated <= 0.05, "{p}: {demonstrated}");
        }
        for p in [0.02, 0.019, 0.01] {
            let (_, refuted) = decided(&rule, p, 3_000);
            assert!(refuted <= 0.05, "{p}: {refuted}");
        }
        // The error is used, not given away: a naive 95 % bound at every look errs far more often.
        let (demonstrated, _) = decided(&rule, 0.020_000_1, 3_000);
        assert!(demonstrated > 0.02, "{demonstrated}");
        let (demonstrated, _) = decided(&rule, 0.002, 3_000);
        let (_, refuted) = decided(&rule, 0.06, 3_000);
        assert!(demonstrated > 0.99 && refuted > 0.99, "{demonstrated} {refuted}");
    }

    #[test]
    fn the_looks_decide_as_the_rows_come() {
        let rule = rule(0.01);
        let mut none = sequential(&rule);
        let mut runs = 0;
        while !none.is_decided() {
            none.judge(0, false);
            runs += 1;
        }
        let evidence = &none.variants[0];
        assert_eq!((runs, evidence.decision), (rule.look(0), Decision::Demonstrated));
        assert!(evidence.bounds.is_some_and(|(lower, upper)| lower == 0.0 && upper <= 0.01));

        let mut one = sequential(&rule);
        one.judge(0, true);
        (0..rule.look(1) - 2).for_each(|_| one.judge(0, false));
        assert!(!one.is_decided());
        one.judge(0, false);
        assert_eq!(one.variants[0].decision, Decision::Demonstrated);
        assert_eq!(one.variants[0].looks, 2);

        let mut all = sequential(&rule);
        while !all.is_decided() {
            all.judge(0, true);
        }
        assert_eq!(all.variants[0].decision, Decision::Refuted);
        assert!(all.variants[0].sentence().contains("above 1e-2"));
    }

    #[test]
    fn rules_without_sense_are_refused() {
        assert_eq!(rule(0.01).fault(), None);
        for p in [0.0, -1.0, 0.6, f64::NAN] {
            assert_eq!(rule(p).fault().unwrap().0, "failure_probability");
        }
        for confidence in [0.3, 1.0, f64::NAN] {
            assert_eq!(StopRule { confidence, ..rule(0.01) }.fault().unwrap().0, "confidence");
        }
    }
}
