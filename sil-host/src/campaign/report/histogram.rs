//! Counts of a quantity in bins of equal width, or of equal ratio where it spans decades.

use serde::Serialize;

/// A power of two, which a page can join into wider bins.
const BINS: usize = 256;
/// Ratio of the ends of a range from which on its logarithm is counted.
const DECADES: f64 = 1e3;

/// The finite values seen of a quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Least value.
    pub lower: f64,
    /// Largest value.
    pub upper: f64,
}

impl Extent {
    /// Before the first value.
    pub const EMPTY: Self = Self { lower: f64::INFINITY, upper: f64::NEG_INFINITY };

    /// Takes in a value.
    pub fn include(&mut self, value: f64) {
        self.lower = self.lower.min(value);
        self.upper = self.upper.max(value);
    }
}

/// Bins over the whole extent of a quantity, counted for each variant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Histogram {
    lower: f64,
    upper: f64,
    logarithmic: bool,
    /// For each variant, a count a bin; empty if there was no value.
    counts: Vec<Vec<u64>>,
    /// For each variant, rows without a value.
    missing: Vec<u64>,
}

impl Histogram {
    /// Empty bins over `extent`, which is widened if it is a single value.
    #[must_use]
    pub fn new(extent: Extent, variants: usize) -> Self {
        let seen = extent.lower <= extent.upper;
        let Extent { lower, upper } = if seen { widened(extent) } else { extent };
        let logarithmic = lower > 0.0 && upper / lower > DECADES;
        let counts = if seen { vec![vec![0; BINS]; variants] } else { Vec::new() };
        Self { lower, upper, logarithmic, counts, missing: vec![0; variants] }
    }

    /// Counts a value of a variant, or that there is none.
    pub fn push(&mut self, variant: usize, value: Option<f64>) {
        let bin = value.map(|value| self.bin(value));
        match (bin, self.counts.get_mut(variant)) {
            (Some(bin), Some(counts)) => counts[bin] += 1,
            _ => self.missing[variant] += 1,
        }
    }

    fn bin(&self, value: f64) -> usize {
        let share = if self.logarithmic {
            (value / self.lower).ln() / (self.upper / self.lower).ln()
        } else {
            (value - self.lower) / (self.upper - self.lower)
        };
        ((share * BINS as f64) as usize).min(BINS - 1)
    }
}

/// A range that is no point.
fn widened(Extent { lower, upper }: Extent) -> Extent {
    if lower < upper {
        return Extent { lower, upper };
    }
    let half = if lower == 0.0 { 0.5 } else { 0.05 * lower.abs() };
    Extent { lower: lower - half, upper: upper + half }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn histogram(values: &[f64]) -> Histogram {
        let mut extent = Extent::EMPTY;
        values.iter().for_each(|value| extent.include(*value));
        let mut histogram = Histogram::new(extent, 1);
        values.iter().for_each(|value| histogram.push(0, Some(*value)));
        histogram
    }

    #[test]
    fn every_value_is_in_the_bin_that_spans_it() {
        let histogram = histogram(&[0.0, 1.0, 1.99, 255.99, 256.0]);
        let counts = &histogram.counts[0];
        assert_eq!((counts[0], counts[1], counts[255]), (1, 2, 2));
        assert_eq!(counts.iter().sum::<u64>(), 5);
        assert!(!histogram.logarithmic);
    }

    #[test]
    fn decades_are_counted_by_ratio() {
        let histogram = histogram(&[1e-4, 1.0, 1e4]);
        assert!(histogram.logarithmic);
        assert_eq!(histogram.counts[0][128], 1, "the middle of eight decades");
    }

    #[test]
    fn a_single_value_lies_inside_a_range() {
        for value in [0.0, -2.0, 1e-9] {
            let histogram = histogram(&[value, value]);
            assert!(histogram.lower < value && value < histogram.upper);
            assert_eq!(histogram.counts[0].iter().max(), Some(&2));
        }
    }

    #[test]
    fn rows_without_a_value_are_counted_apart() {
        let mut histogram = Histogram::new(Extent { lower: 0.0, upper: 1.0 }, 2);
        histogram.push(1, None);
        assert_eq!(histogram.missing, [0, 1]);
        let mut nothing = Histogram::new(Extent::EMPTY, 1);
        nothing.push(0, None);
        assert!(nothing.counts.is_empty() && nothing.missing == [1]);
    }
}
