//! Multilevel splitting: the probability of a rare violation, down to one in a billion, from some ten thousand
//! flights.
//!
//! Particles, each the varied values of a run and its seed, climb from level to level of a score, minus the margin of
//! a guarantee. At each step the particle with the lowest score is replaced by a copy of another one, which then
//! walks at random among the runs above that score ([`walk`]). With `N` particles in all, a step multiplies the
//! probability of the runs above the level by `1 - 1/N` on average; when every score is positive, `p = (1 - 1/N)^J`
//! after `J` steps is an unbiased estimate of the probability of a violation, and `J` is Poisson distributed with mean
//! `-N ln p`, which gives an interval ([`estimate`]). This is the last-particle algorithm of Guyader, Hengartner and
//! Matzner-Lober, Applied Mathematics and Optimization 64 (2011) 171-196, over the input space as in subset
//! simulation (Au and Beck, Probabilistic Engineering Mechanics 16 (2001) 263-277). Its statements are exact for walks
//! that forget where they began; real ones come close with many steps, and replicas that know nothing of each other
//! show by their scatter if they do not.
//!
//! Scores that are equal are ordered by a number drawn with each run and anew at each step, so that levels are strict and
//! a copy that could not move is not counted as the one it was copied from.

mod estimate;
mod fly;
mod page;
mod replica;
mod table;
mod walk;

#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

pub use estimate::RareProbability;
pub(super) use fly::fly;

/// `[splitting]` of a campaign.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Splitting {
    /// The guarantee, by the stem of its columns.
    pub guarantee: String,
    /// Demanded bound of the probability; without it the campaign only estimates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure_probability: Option<f64>,
    /// Probability with which the interval holds.
    #[serde(default = "Splitting::default_confidence")]
    pub confidence: f64,
    /// Particles of each replica.
    #[serde(default = "Splitting::default_particles")]
    pub particles: u32,
    /// Replicas, which know nothing of each other and are flown side by side.
    #[serde(default = "Splitting::default_replicas")]
    pub replicas: u32,
    /// Steps of a walk.
    #[serde(default = "Splitting::default_steps")]
    pub steps: u32,
}

impl Splitting {
    fn default_confidence() -> f64 {
        0.95
    }

    fn default_particles() -> u32 {
        50
    }

    fn default_replicas() -> u32 {
        16
    }

    fn default_steps() -> u32 {
        10
    }

    /// The fault of a definition, with its key; none if it is sound.
    #[must_use]
    pub fn fault(&self) -> Option<(&'static str, String)> {
        let count = |key, value: u32, least: u32, most: u32| {
            let message = format!("{value} must be in [{least}, {most}]");
            (!(least..=most).contains(&value)).then_some((key, message))
        };
        let probability = |key, value: f64, least: f64, most: f64| {
            let message = format!("{value} must be in [{least}, {most}]");
            (!(least..=most).contains(&value)).then_some((key, message))
        };
        let demanded = self.failure_probability;
        demanded
            .and_then(|p| probability("failure_probability", p, 1e-12, 0.5))
            .or_else(|| probability("confidence", self.confidence, 0.5, 0.999_999))
            .or_else(|| count("particles", self.particles, 2, 100_000))
            .or_else(|| count("replicas", self.replicas, 2, 10_000))
            .or_else(|| count("steps", self.steps, 1, 10_000))
    }
}
