//! Anti-alias filter of a sensor: Butterworth low-pass of second order, by the bilinear transform.

use core::f64::consts::{PI, SQRT_2};

use glam::DVec3;

/// A filter in progress, for three axes.
#[derive(Clone, Debug)]
pub struct LowPass {
    /// Coefficients; none for a filter that passes everything.
    coefficients: Option<Coefficients>,
    /// States of the transposed direct form.
    states: Option<(DVec3, DVec3)>,
}

#[derive(Clone, Copy, Debug)]
struct Coefficients {
    /// `b0 = b2 = b1/2`.
    b: f64,
    a1: f64,
    a2: f64,
}

/// `true` if there is a filter.
fn filters(cutoff: f64, period: f64) -> bool {
    cutoff > 0.0 && cutoff * period < 0.5
}

impl LowPass {
    /// With `cutoff` (Hz), -3 dB there, for samples each `period` (s). A cutoff of zero, or at half the sample rate or
    /// above, is none: everything passes.
    #[must_use]
    pub fn new(cutoff: f64, period: f64) -> Self {
        let coefficients = filters(cutoff, period).then(|| {
            let k = libm::tan(PI * cutoff * period);
            let norm = 1.0 + SQRT_2 * k + k * k;
            Coefficients {
                b: k * k / norm,
                a1: 2.0 * (k * k - 1.0) / norm,
                a2: (1.0 - SQRT_2 * k + k * k) / norm,
            }
        });
        Self { coefficients, states: None }
    }

    /// Delay of slow signals (s): `sqrt(2)/(2 pi f)`, nothing without filter.
    #[must_use]
    pub fn delay(cutoff: f64, period: f64) -> f64 {
        if filters(cutoff, period) { SQRT_2 / (2.0 * PI * cutoff) } else { 0.0 }
    }

    /// The next output; the first input is taken to have lasted for ever.
    pub fn advance(&mut self, x: DVec3) -> DVec3 {
        let Some(Coefficients { b, a1, a2 }) = self.coefficients else { return x };
        let rest = (x * (1.0 - b), x * (b - a2));
        let (s1, s2) = self.states.unwrap_or(rest);
        let y = b * x + s1;
        self.states = Some((2.0 * b * x - a1 * y + s2, b * x - a2 * y));
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    /// Gain at `frequency`, and the phase (rad).
    fn response(cutoff: f64, frequency: f64) -> (f64, f64) {
        let (mut filter, period) = (LowPass::new(cutoff, 1e-4), 1e-4);
        let (mut re, mut im, n) = (0.0, 0.0, 20_000);
        for k in 0..2 * n {
            let angle = TAU * frequency * period * f64::from(k);
            let y = filter.advance(DVec3::X * libm::sin(angle)).x;
            if k >= n {
                re += y * libm::sin(angle) * 2.0 / f64::from(n);
                im += y * libm::cos(angle) * 2.0 / f64::from(n);
            }
        }
        (re.hypot(im), libm::atan2(im, re))
    }

    #[test]
    fn the_gain_is_butterworths_and_the_delay_as_stated() {
        for frequency in [10.0, 50.0, 100.0, 200.0, 400.0] {
            // Warped by the transform.
            let ratio = libm::tan(PI * frequency * 1e-4) / libm::tan(PI * 100.0 * 1e-4);
            let expected = 1.0 / (1.0 + ratio.powi(4)).sqrt();
            let (gain, _) = response(100.0, frequency);
            assert!((gain - expected).abs() < 1e-3, "{frequency}: {gain} {expected}");
        }
        let (_, phase) = response(100.0, 5.0);
        assert!((-phase / (TAU * 5.0) / LowPass::delay(100.0, 1e-4) - 1.0).abs() < 0.01);
    }

    #[test]
    fn a_constant_passes_from_the_first_sample_and_no_filter_passes_everything() {
        let mut filter = LowPass::new(100.0, 1e-3);
        (0..50).for_each(|_| assert!((filter.advance(DVec3::Z) - DVec3::Z).length() < 1e-12));
        let mut none = LowPass::new(0.0, 1e-3);
        assert_eq!(none.advance(DVec3::ONE), DVec3::ONE);
        assert_eq!(LowPass::delay(0.0, 1e-3), 0.0);
    }
}
