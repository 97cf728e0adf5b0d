//! Rows of the table of guarantees, and the extremes behind them.

use std::fmt;

use glam::DVec3;
use serde::Serialize;

use super::block::Block;
use crate::lanes::{LANES, Scalars, Vectors, all};
use crate::number::number;

/// Requirement on the observed extreme.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Requirement {
    /// Never below.
    AtLeast(f64),
    /// Never above.
    AtMost(f64),
    /// Always inside the closed interval.
    Inside(f64, f64),
    /// No bound; the number is information.
    Information,
}

impl Requirement {
    /// Distance of `observed` from the bound, positive on the good side; none without a bound.
    #[must_use]
    pub fn margin(self, observed: f64) -> Option<f64> {
        match self {
            Self::AtLeast(bound) => Some(observed - bound),
            Self::AtMost(bound) => Some(bound - observed),
            Self::Inside(lower, upper) => Some((observed - lower).min(upper - observed)),
            Self::Information => None,
        }
    }
}

impl Requirement {
    /// [`margin`](Self::margin) of each lane; zero without a bound.
    #[inline]
    fn margins(self, observed: Scalars) -> Scalars {
        match self {
            Self::AtLeast(bound) => observed - all(bound),
            Self::AtMost(bound) => all(bound) - observed,
            Self::Inside(lower, upper) => (observed - all(lower)).min(all(upper) - observed),
            Self::Information => all(0.0),
        }
    }
}

/// Verdict on one guarantee over a flight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// The guaranteed quantity.
    pub name: &'static str,
    /// Its equation in the paper, or the place of its derivation.
    pub equation: &'static str,
    /// The bound.
    pub requirement: Requirement,
    /// The value that came closest to the bound, or broke it furthest; none if never observed.
    pub observed: Option<f64>,
    /// Distance of `observed` from the bound, positive on the good side.
    pub margin: Option<f64>,
    /// Unit of `requirement`, `observed` and `margin`.
    pub unit: &'static str,
    /// Time of `observed` (s).
    pub time: Option<f64>,
    /// `true` if the guarantee holds; rows of information always pass.
    pub pass: bool,
}

impl Verdict {
    /// A row; passes when the margin is not negative. Nothing observed, or NaN, fails.
    #[must_use]
    pub fn new(
        (name, equation, unit): (&'static str, &'static str, &'static str),
        requirement: Requirement,
        extreme: Extreme,
    ) -> Self {
        let margin = extreme.value().and_then(|observed| requirement.margin(observed));
        Self {
            name,
            equation,
            requirement,
            observed: extreme.value(),
            margin,
            unit,
            time: extreme.time(),
            pass: requirement == Requirement::Information || margin.is_some_and(|m| m >= 0.0),
        }
    }
}

/// One line: result, guarantee, observed value and margin.
impl fmt::Display for Verdict {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, equation, unit, .. } = self;
        let result = match self.requirement {
            Requirement::Information => "info",
            _ if self.pass => "pass",
            _ => "FAIL",
        };
        write!(out, "{result} {name} {equation}: ")?;
        match self.observed {
            Some(observed) => write!(out, "{} {unit}", number(observed))?,
            None => out.write_str("not observed")?,
        }
        self.margin.map_or(Ok(()), |margin| write!(out, ", margin {}", number(margin)))
    }
}

/// The extremes of the three body axes, each against a requirement of its own; a row shows the tightest.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxisExtremes {
    requirements: [Requirement; 3],
    extremes: [Extreme; 3],
}

impl AxisExtremes {
    pub(super) fn new(requirements: [Requirement; 3]) -> Self {
        Self { requirements, extremes: [Extreme::default(); 3] }
    }

    /// Keeps what is tighter about its axis.
    #[inline]
    pub(super) fn observe(&mut self, x: DVec3, time: f64) {
        let axes = self.extremes.iter_mut().zip(self.requirements).zip(x.to_array());
        for ((extreme, requirement), x) in axes {
            extreme.tightest(x, time, requirement);
        }
    }

    /// [`observe`](Self::observe) of each tick of a block.
    #[inline]
    pub(super) fn observe_block(&mut self, x: Vectors, block: &Block) {
        let axes = self.extremes.iter_mut().zip(self.requirements).zip(x.to_array());
        for ((extreme, requirement), x) in axes {
            extreme.tightest_of(&[x], block, requirement);
        }
    }

    /// Requirement and extreme of the axis with the least margin; the earliest of several.
    pub(super) fn tightest(&self) -> (Requirement, Extreme) {
        let margin = |axis: &(Requirement, Extreme)| {
            let observed = axis.1.value().unwrap_or(f64::NAN);
            axis.0.margin(observed).filter(|it| !it.is_nan()).unwrap_or(f64::NEG_INFINITY)
        };
        let axes = self.requirements.into_iter().zip(self.extremes);
        let tighter = |a: (Requirement, Extreme), b: (Requirement, Extreme)| {
            let sooner = |it: &(Requirement, Extreme)| it.1.time().unwrap_or(f64::INFINITY);
            let before = margin(&b).total_cmp(&margin(&a)).then(sooner(&b).total_cmp(&sooner(&a)));
            if before.is_lt() { b } else { a }
        };
        axes.reduce(tighter).unwrap_or((Requirement::Information, Extreme::default()))
    }
}

/// The most extreme value so far and its time; NaN is more extreme than any number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extreme(Option<(f64, f64)>);

impl Extreme {
    /// A single observation.
    #[must_use]
    pub fn at(value: f64, time: f64) -> Self {
        Self(Some((value, time)))
    }

    /// Keeps `value` at `time` if `worse(value, kept)`; `true` if it did.
    #[inline]
    fn keep(&mut self, value: f64, time: f64, worse: impl FnOnce(f64, f64) -> bool) -> bool {
        let replace = match self.0 {
            None => true,
            Some((kept, _)) => !kept.is_nan() && (value.is_nan() || worse(value, kept)),
        };
        if replace {
            self.0 = Some((value, time));
        }
        replace
    }

    /// Keeps the highest; `true` if `value` is it.
    #[inline]
    pub fn highest(&mut self, value: f64, time: f64) -> bool {
        self.keep(value, time, |new, kept| new > kept)
    }

    /// Keeps the highest of the lanes `due`, each at its `time`; the first if several are.
    #[inline]
    pub(super) fn highest_of(&mut self, values: Scalars, due: u32, time: &[f64; LANES]) {
        let open = match self.0 {
            None => due,
            Some((kept, _)) => due & !values.simd_le(all(kept)).to_bitmask(), // NaN is open
        };
        if open == 0 {
            return;
        }
        let values = values.to_array();
        for lane in (0..LANES).filter(|lane| open >> lane & 1 == 1) {
            self.highest(values[lane], time[lane]);
        }
    }

    /// Keeps the value with the least margin to `requirement`, tick by tick and component by component.
    #[inline]
    pub(super) fn tightest_of<const N: usize>(
        &mut self,
        components: &[Scalars; N],
        block: &Block,
        requirement: Requirement,
    ) {
        let every = block.lanes();
        let open = match self.0 {
            None => every,
            Some((kept, _)) => {
                let kept = requirement.margins(all(kept));
                let looser = |&x: &Scalars| requirement.margins(x).simd_ge(kept).to_bitmask();
                every & !components.iter().map(looser).fold(every, |a, b| a & b) // NaN is open
            }
        };
        for lane in (0..LANES).filter(|lane| open >> lane & 1 == 1) {
            for component in components {
                self.tightest(component.as_array()[lane], block.time[lane], requirement);
            }
        }
    }

    /// The same in a unit `factor` times smaller.
    pub(super) fn scaled(self, factor: f64) -> Self {
        Self(self.0.map(|(value, time)| (factor * value, time)))
    }

    /// Keeps the lowest.
    #[inline]
    pub fn lowest(&mut self, value: f64, time: f64) {
        self.keep(value, time, |new, kept| new < kept);
    }

    /// Keeps the value with the least margin to `requirement`; `true` if it is `value`.
    #[inline]
    pub fn tightest(&mut self, value: f64, time: f64, requirement: Requirement) -> bool {
        self.keep(value, time, |new, kept| requirement.margin(new) < requirement.margin(kept))
    }

    /// The value, if any was observed.
    #[must_use]
    pub fn value(self) -> Option<f64> {
        self.0.map(|(value, _)| value)
    }

    /// Its time (s).
    #[must_use]
    pub fn time(self) -> Option<f64> {
        self.0.map(|(_, time)| time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn extreme(value: f64) -> Extreme {
        let mut extreme = Extreme::default();
        extreme.highest(value, 1.0);
        extreme
    }

    #[test]
    fn a_bound_passes_with_no_margin_and_fails_just_beyond() {
        let row = |x| Verdict::new(("a", "(1)", "m"), Requirement::AtMost(2.0), extreme(x));
        assert!(row(2.0).pass);
        assert!(!row(2.0 + f64::EPSILON * 2.0).pass);
        let row = |x| Verdict::new(("a", "(1)", "m"), Requirement::Inside(-1.0, 2.0), extreme(x));
        assert!(row(-1.0).pass);
        assert!(!row(-1.1).pass);
        assert_eq!(row(1.5).margin, Some(0.5));
    }

    #[test]
    fn a_row_is_one_line_of_text() {
        let row = |x| Verdict::new(("error", "(5)", "m"), Requirement::AtMost(2.0), x);
        assert_eq!(row(extreme(2.5)).to_string(), "FAIL error (5): 2.5 m, margin -0.5");
        assert_eq!(row(extreme(1.5)).to_string(), "pass error (5): 1.5 m, margin 0.5");
        assert_eq!(row(Extreme::default()).to_string(), "FAIL error (5): not observed");
    }

    #[test]
    fn nothing_observed_and_nan_fail() {
        let bound = Requirement::AtMost(2.0);
        assert!(!Verdict::new(("a", "(1)", "m"), bound, Extreme::default()).pass);
        let mut seen = extreme(f64::NAN);
        seen.highest(1.0, 2.0);
        assert!(!Verdict::new(("a", "(1)", "m"), bound, seen).pass);
    }

    #[test]
    fn the_tightest_value_is_the_one_closest_to_an_end() {
        let bound = Requirement::Inside(0.0, 10.0);
        let mut seen = Extreme::default();
        for (time, value) in [5.0, 9.0, 2.0, 3.0].into_iter().enumerate() {
            seen.tightest(value, time as f64, bound);
        }
        assert_eq!((seen.value(), seen.time()), (Some(9.0), Some(1.0)));
    }
}
