//! Full scale and resolution of a converter: saturation, then rounding to the nearest step.

use glam::DVec3;

/// An analogue-to-digital converter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Converter {
    range: f64,
    step: f64,
}

impl Converter {
    /// Of `range` to either side in steps of `step`; a step of zero does not round.
    #[must_use]
    pub fn new(range: f64, step: f64) -> Self {
        Self { range, step }
    }

    /// The number that it gives for `x`.
    #[must_use]
    pub fn convert(&self, x: f64) -> f64 {
        let kept = x.clamp(-self.range, self.range);
        if self.step > 0.0 { (kept / self.step).round() * self.step } else { kept }
    }

    /// [`convert`](Self::convert) of each component.
    #[must_use]
    pub fn convert_each(&self, x: DVec3) -> DVec3 {
        DVec3::new(self.convert(x.x), self.convert(x.y), self.convert(x.z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_saturates_and_rounds_with_an_error_uniform_over_a_step() {
        let converter = Converter::new(2.0, 0.1);
        assert_eq!(converter.convert(5.0), 2.0);
        assert_eq!(converter.convert(-5.0), -2.0);
        assert!((converter.convert(0.44) - 0.4).abs() < 1e-15);
        let (mut square, n) = (0.0, 100_000);
        for k in 0..n {
            let x = 3.9 * (f64::from(k) / f64::from(n) - 0.5);
            square += (converter.convert(x) - x).powi(2) / f64::from(n);
        }
        // step^2 / 12.
        assert!((square / (0.01 / 12.0) - 1.0).abs() < 0.02, "{square}");
        assert_eq!(Converter::new(2.0, 0.0).convert(0.123), 0.123);
    }
}
