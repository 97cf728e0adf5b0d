//! One section of second order, low-pass or notch, as a trapezoidal state-variable filter.
//!
//! With `g = tan(pi f dt)` and a damping `k` the section computes, for the input `x` and its two states,
//!
//! ```text
//! a1 = 1/(1 + g (g + k)),  a2 = g a1,  a3 = g a2
//! v3 = x - s2,  v1 = a1 s1 + a2 v3,  v2 = s2 + a2 s1 + a3 v3
//! s1 <- 2 v1 - s1,  s2 <- 2 v2 - s2
//! y  = v2 (low-pass),  y = x - k v1 (notch)
//! ```
//!
//! which is the biquad that the bilinear transform, prewarped at `f`, makes of the analogue prototype: with
//! `s = (1 - z^-1)/(g (1 + z^-1))`
//!
//! ```text
//! low-pass  H = 1/(s^2 + k s + 1)              k = 1/Q
//! notch     H = (s^2 + 1)/(s^2 + k s + 1)      k = tan(pi f dt/Q) (1 + g^2)/g
//! ```
//!
//! The low-pass has `|H| = Q` at `f`: -3 dB for `Q = 1/sqrt(2)` (Butterworth). The notch has a zero at `f`, and its -3 dB
//! points are exactly `f/Q` apart. Against the direct forms with coefficients `b`, `a` the states are better conditioned:
//! the gain at rest is one whatever the rounding, since there `v1 = v3 = 0`, and a cut-off of a thousandth of the sample rate
//! loses no digits in `f32` (A. Simper, "Linear Trapezoidal Integrated State Variable Filter", Cytomic, 2013;
//! V. Zavalishin, "The Art of VA Filter Design", 2012, chapter 4).

use core::f32::consts::PI;

use glam::Vec3;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

/// Low-pass of second order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(deny_unknown_fields))]
pub struct LowPassConfig {
    /// Corner frequency `f` (Hz), in `[0.001, 0.45]` of the sample rate.
    pub frequency: f32,
    /// `Q`, the gain at `frequency`, in `[0.3, 10]`; `1/sqrt(2)` is a Butterworth filter.
    pub quality: f32,
}

/// Notch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(deny_unknown_fields))]
pub struct NotchConfig {
    /// Frequency `f` of the zero (Hz), in `[0.001, 0.45]` of the sample rate.
    pub frequency: f32,
    /// `Q`, in `[1, 100]`: `frequency` over the distance between the -3 dB points.
    pub quality: f32,
}

/// Output of a section.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Output {
    /// `v2`.
    LowPass,
    /// `x - k v1`.
    Notch(f32),
}

/// A section with its coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Section {
    a1: f32,
    a2: f32,
    a3: f32,
    output: Output,
}

/// `s1`, `s2` of the three axes.
pub(super) type Memory = [Vec3; 2];

impl Section {
    pub fn low_pass(config: &LowPassConfig, step_period: f32) -> Self {
        let g = libm::tanf(PI * config.frequency * step_period);
        Self::new(g, 1.0 / config.quality, Output::LowPass)
    }

    pub fn notch(config: &NotchConfig, step_period: f32) -> Self {
        let half = PI * config.frequency * step_period;
        let g = libm::tanf(half);
        let k = libm::tanf(half / config.quality) * (1.0 + g * g) / g;
        Self::new(g, k, Output::Notch(k))
    }

    fn new(g: f32, k: f32, output: Output) -> Self {
        let a1 = 1.0 / (1.0 + g * (g + k));
        Self { a1, a2: g * a1, a3: g * g * a1, output }
    }

    /// The states at rest under a constant input.
    #[inline(always)]
    pub fn settled(x: Vec3) -> Memory {
        [Vec3::ZERO, x]
    }

    /// The output of this sample.
    #[inline(always)]
    pub fn step(&self, memory: &mut Memory, x: Vec3) -> Vec3 {
        let [s1, s2] = *memory;
        let v3 = x - s2;
        let v1 = self.a1 * s1 + self.a2 * v3;
        let v2 = s2 + self.a2 * s1 + self.a3 * v3;
        *memory = [v1 + v1 - s1, v2 + v2 - s2];
        match self.output {
            Output::LowPass => v2,
            Output::Notch(k) => x - k * v1,
        }
    }
}
