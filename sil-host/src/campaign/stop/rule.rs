//! `[stop]` of a campaign: the demand, and the runs after which it is looked at.

use serde::{Deserialize, Serialize};
use statrs::function::beta::beta_reg;

/// `[stop]` of a campaign.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct StopRule {
    /// `p0`: demanded bound of the probability that a run violates a guarantee.
    pub failure_probability: f64,
    /// Probability with which a decision is right, whatever the true probability.
    #[serde(default = "default_confidence")]
    pub confidence: f64,
    /// The guarantee, by the stem of its columns; any of them if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub guarantee: Option<String>,
}

fn default_confidence() -> f64 {
    0.95
}

impl StopRule {
    /// The fault of a rule, with its key; none if it is sound.
    #[must_use]
    pub fn fault(&self) -> Option<(&'static str, String)> {
        let Self { failure_probability: p, confidence, .. } = *self;
        if !(1e-9..=0.5).contains(&p) {
            return Some(("failure_probability", format!("{p} must be in [1e-9, 0.5]")));
        }
        if !(0.5..=0.999_999).contains(&confidence) {
            return Some(("confidence", format!("{confidence} must be in [0.5, 0.999999]")));
        }
        None
    }

    /// `a_c`.
    pub(super) fn spent(&self, look: u64) -> f64 {
        let look = look as f64;
        (1.0 - self.confidence) / ((look + 1.0) * (look + 2.0))
    }

    /// `n_c`.
    pub(super) fn look(&self, look: u64) -> u64 {
        let spent = self.spent(look);
        let shows = |runs: u64| {
            // P(Bin(n, p) <= c) = I_(1 - p)(n - c, c + 1).
            let (n, c) = (runs as f64, look as f64);
            beta_reg(n - c, c + 1.0, 1.0 - self.failure_probability) <= spent
        };
        let (mut short, mut enough) = (look, look + 1);
        while !shows(enough) {
            short = enough;
            enough *= 2;
        }
        while enough - short > 1 {
            let middle = short + (enough - short) / 2;
            *(if shows(middle) { &mut enough } else { &mut short }) = middle;
        }
        enough
    }
}
