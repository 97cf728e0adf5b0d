//! One row of the results: a run in one variant.

/// Result of one run in one variant.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Seed of the run.
    pub seed: u32,
    /// Number of the variant.
    pub variant: usize,
    /// Varied values, in the order of [`Campaign::parameters`](super::Campaign::parameters).
    pub parameters: Vec<f64>,
    /// Outcome of the guarantees.
    pub outcome: RunOutcome,
    /// Names of the guarantees that were violated, or why the flight was refused; empty if all held.
    pub reason: String,
    /// `true` if vehicle and disturbance lie in the sets that the controller was told of; if not, the
    /// theorems promise nothing. Also false where nothing was flown.
    pub assumptions_kept: bool,
    /// In the order of [`MEASURES`](super::MEASURES); none where it does not apply.
    pub measures: Vec<Option<f64>>,
    /// In the order of [`Campaign::guarantees`](super::Campaign::guarantees).
    pub guarantees: Vec<Observed>,
}

impl Row {
    /// As it is written in the results.
    #[must_use]
    pub fn assumptions(&self) -> &'static str {
        if self.assumptions_kept { KEPT } else { BROKEN }
    }
}

/// Cells of the column `assumptions`.
pub(super) const KEPT: &str = "kept";
pub(super) const BROKEN: &str = "broken";

/// Outcome of a flight's guarantees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RunOutcome {
    /// All.
    Held,
    /// At least one did not.
    Violated,
    /// Scenario or controller refuse the values: nothing was flown.
    Refused,
}

impl RunOutcome {
    /// Every one of them.
    pub const ALL: [Self; 3] = [Self::Held, Self::Violated, Self::Refused];

    /// As it is written in the results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Held => "held",
            Self::Violated => "violated",
            Self::Refused => "refused",
        }
    }

    /// The one of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|outcome| outcome.name() == name)
    }
}

impl Observed {
    /// `true` if it was judged and did not hold; what was never observed counts as such.
    #[must_use]
    pub fn is_violated(&self) -> bool {
        match (self.observed, self.margin) {
            (Some(_), None) => false, // information
            (_, margin) => !margin.is_some_and(|margin| margin >= 0.0),
        }
    }
}

/// Observation of one guarantee; empty where it does not apply.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Observed {
    /// The value that came closest to the bound, or broke it furthest.
    pub observed: Option<f64>,
    /// Its distance from the bound, positive on the good side; none without a bound.
    pub margin: Option<f64>,
}
