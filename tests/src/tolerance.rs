//! One tolerance for every comparison: absolute plus relative, in the max-norm.

/// Permitted error of a quantity: `absolute + relative * |expected|`, with `|.|` the largest
/// component, so that a component near zero is judged on the scale of its vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// In the unit of the quantity.
    pub absolute: f64,
    /// As a fraction of the expected quantity's largest component.
    pub relative: f64,
}

impl Tolerance {
    /// Largest error in units of the allowed one: at most 1 inside the tolerance, and infinite
    /// when a side is not finite or the lengths differ.
    #[must_use]
    pub fn ratio(&self, actual: &[f64], expected: &[f64]) -> f64 {
        let allowed = self.absolute + self.relative * largest(expected);
        if actual.len() != expected.len() || !allowed.is_finite() {
            return f64::INFINITY;
        }
        let error = actual.iter().zip(expected).map(|(a, e)| a - e);
        let ratio = largest(&error.collect::<Vec<_>>()) / allowed;
        if ratio.is_nan() { f64::INFINITY } else { ratio }
    }

    /// Fails, and prints both sides, unless `actual` is `expected` within the tolerance.
    ///
    /// # Panics
    /// When it is not.
    #[track_caller]
    pub fn check(&self, name: &str, actual: &[f64], expected: &[f64]) {
        let ratio = self.ratio(actual, expected);
        assert!(
            ratio <= 1.0,
            "{name}: {ratio:.3} of the tolerance\n  actual   {actual:?}\n  expected {expected:?}\n  {self:?}"
        );
    }
}

/// Largest magnitude; NaN if one component is.
fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m: f64, x| if x.is_nan() || m.is_nan() { f64::NAN } else { m.max(x.abs()) })
}

#[cfg(test)]
mod tests {
    use super::Tolerance;

    #[test]
    fn judges_on_the_scale_of_the_vector() {
        let tolerance = Tolerance { absolute: 0.5, relative: 0.125 };
        assert_eq!(tolerance.ratio(&[4.0, 1.0], &[4.0, 0.0]), 1.0);
        assert_eq!(tolerance.ratio(&[-5.0], &[-4.0]), 1.0);
        assert!(tolerance.ratio(&[4.0, 1.1], &[4.0, 0.0]) > 1.0);
    }

    #[test]
    fn refuses_what_is_not_finite_or_of_another_length() {
        let tolerance = Tolerance { absolute: 1.0, relative: 1.0 };
        for (actual, expected) in
            [([f64::NAN], [0.0]), ([0.0], [f64::NAN]), ([f64::INFINITY], [f64::INFINITY])]
        {
            assert_eq!(tolerance.ratio(&actual, &expected), f64::INFINITY);
        }
        assert_eq!(tolerance.ratio(&[1.0, 1.0], &[1.0]), f64::INFINITY);
        assert_eq!(tolerance.ratio(&[1.0, f64::NAN], &[1.0, 1.0]), f64::INFINITY);
    }

    #[test]
    #[should_panic(expected = "actual   [2.0]\n  expected [1.0]")]
    fn prints_both_sides() {
        Tolerance { absolute: 0.0, relative: 0.1 }.check("x", &[2.0], &[1.0]);
    }
}
