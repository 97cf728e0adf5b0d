//! Axes: ranges with room, ticks at round numbers, labels.

use serde::Serialize;

/// Mapping of values to positions along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// Proportional.
    Linear,
    /// By decades; only for positive values.
    Logarithmic,
}

/// One axis of a panel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// First value.
    pub lower: f64,
    /// Last value.
    pub upper: f64,
    /// Mapping of values to positions.
    pub scale: Scale,
}

impl Axis {
    /// Exactly from `lower` to `upper`.
    #[must_use]
    pub fn exact(label: &str, lower: f64, upper: f64) -> Self {
        Self { label: label.to_owned(), lower, upper, scale: Scale::Linear }
    }

    /// Around all `values` with 8 % room on both sides; never empty.
    #[must_use]
    pub fn around(label: &str, values: impl Iterator<Item = f64>) -> Self {
        let (lower, upper) = span(values);
        let room = if upper > lower { 0.08 * (upper - lower) } else { 0.5 * upper.abs().max(1e-6) };
        Self::exact(label, lower - room, upper + room)
    }

    /// Whole decades around all positive `values`, at most 12 of them.
    #[must_use]
    pub fn decades(label: &str, values: impl Iterator<Item = f64>) -> Self {
        let (lower, upper) = span(values.filter(|x| *x > 0.0).map(f64::log10));
        let upper = if upper > lower { upper.ceil() } else { lower.floor() + 1.0 };
        let lower = lower.floor().max(upper - 12.0);
        Self {
            scale: Scale::Logarithmic,
            ..Self::exact(label, 10f64.powf(lower), 10f64.powf(upper))
        }
    }

    /// Extends it on both sides to `length`.
    pub fn widen(&mut self, length: f64) {
        let missing = 0.5 * (length - (self.upper - self.lower));
        (self.lower, self.upper) = (self.lower - missing, self.upper + missing);
    }

    /// Position of `x`, 0 at `lower` and 1 at `upper`.
    #[must_use]
    pub fn position(&self, x: f64) -> f64 {
        match self.scale {
            Scale::Linear => (x - self.lower) / (self.upper - self.lower),
            Scale::Logarithmic => {
                let lower = self.lower.log10();
                (x.max(self.lower * 1e-3).log10() - lower) / (self.upper.log10() - lower)
            }
        }
    }

    /// `true` if `x` is within the axis.
    #[must_use]
    pub fn contains(&self, x: f64) -> bool {
        self.lower <= x && x <= self.upper
    }

    /// Round values with their labels, about `count` of them, and the power of ten that the labels
    /// are to be multiplied with.
    #[must_use]
    pub fn ticks(&self, count: f64) -> (Vec<(f64, String)>, i32) {
        if self.scale == Scale::Logarithmic {
            return (self.decade_ticks(count), 0);
        }
        let step = round_step((self.upper - self.lower) / count);
        let exponent = common_exponent(self.lower.abs().max(self.upper.abs()));
        let unit = 10f64.powi(exponent);
        let decimals = (-(step / unit).log10().floor()).clamp(0.0, 9.0) as usize;
        let first = (self.lower / step - 1e-9).ceil() as i64;
        let last = (self.upper / step + 1e-9).floor() as i64;
        let tick = |n: i64| {
            let value = n as f64 * step;
            let text = format!("{:.decimals$}", value / unit);
            (value, text.replace('-', "\u{2212}"))
        };
        ((first..=last).map(tick).collect(), exponent)
    }

    fn decade_ticks(&self, count: f64) -> Vec<(f64, String)> {
        let (first, last) = (self.lower.log10().round() as i32, self.upper.log10().round() as i32);
        let stride = (f64::from(last - first) / count).ceil().max(1.0) as usize;
        let tick = |power: i32| (10f64.powi(power), format!("10{}", superscript(power)));
        (first..=last).step_by(stride).map(tick).collect()
    }
}

/// Least and greatest finite value; zero to one if there is none.
fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let start = (f64::INFINITY, f64::NEG_INFINITY);
    let (lower, upper) =
        values.filter(|x| x.is_finite()).fold(start, |(l, u), x| (l.min(x), u.max(x)));
    if lower <= upper { (lower, upper) } else { (0.0, 1.0) }
}

/// 1, 2 or 5 times a power of ten, the nearest to `step`.
fn round_step(step: f64) -> f64 {
    let decade = 10f64.powf(step.log10().floor());
    let ratio = step / decade;
    let limits = [(1.0, 1.5), (2.0, 3.5), (5.0, 7.5)];
    decade * limits.iter().find(|(_, limit)| ratio < *limit).map_or(10.0, |(round, _)| *round)
}

/// A multiple of three that spares labels many zeros; zero for everyday magnitudes.
fn common_exponent(magnitude: f64) -> i32 {
    if (1e-2..1e4).contains(&magnitude) || magnitude == 0.0 {
        0
    } else {
        3 * ((magnitude.log10() + 1.0) / 3.0).floor() as i32
    }
}

/// `n` in raised digits.
#[must_use]
pub fn superscript(n: i32) -> String {
    let raised = |character| match character {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        other => char::from_u32('⁰' as u32 + (other as u32 - '0' as u32)).unwrap_or(other),
    };
    n.to_string().chars().map(raised).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> (Vec<String>, i32) {
        let (ticks, exponent) = axis.ticks(5.0);
        (ticks.into_iter().map(|(_, label)| label).collect(), exponent)
    }

    #[test]
    fn ticks_are_round_and_labelled_with_as_many_decimals_as_they_need() {
        let text = |axis: &Axis| labels(axis).0.join(" ");
        assert_eq!(text(&Axis::exact("", 0.0, 200.0)), "0 50 100 150 200");
        assert_eq!(text(&Axis::exact("", -0.055, 0.055)), "−0.04 −0.02 0.00 0.02 0.04");
        let small = Axis::exact("", -2.1e-4, 3e-4);
        assert_eq!((text(&small).as_str(), labels(&small).1), ("−0.2 −0.1 0.0 0.1 0.2 0.3", -3));
    }

    #[test]
    fn ranges_are_never_empty_and_ignore_what_is_not_finite() {
        let axis = Axis::around("", [2.0, f64::NAN, 2.0].into_iter());
        assert!(axis.lower < 2.0 && axis.upper > 2.0);
        assert!(Axis::around("", core::iter::empty()).upper > 0.0);
        let axis = Axis::decades("", [3e-5, 0.0, 0.2].into_iter());
        assert_eq!((axis.lower, axis.upper), (1e-5, 1.0));
        assert_eq!(labels(&axis).0, ["10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²", "10⁻¹", "10⁰"]);
        assert!((axis.position(1e-3) - 0.4).abs() < 1e-12);
    }
}
