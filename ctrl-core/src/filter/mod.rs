//! Filters of the measured body rate: a low-pass and notches, each a section of second order.
//!
//! Gyros pass on the noise of their electronics and the vibration of the rotors, and the laws answer rate noise with torque at once
//! (`-k4 w_e`). A low-pass takes off what is above the loop's bandwidth, a notch the line of the rotors. Both delay the rate within the
//! bandwidth, which costs phase: the theorems assume the true rate, and the margins of `tune` count the filters.
//!
//! ```
//! use ctrl_core::filter::{LowPassConfig, RateFilter, RateFilterConfig};
//! use glam::Vec3;
//!
//! let low_pass = LowPassConfig { frequency: 80.0, quality: core::f32::consts::FRAC_1_SQRT_2 };
//! let config = RateFilterConfig { low_pass: Some(low_pass), ..RateFilterConfig::default() };
//! let filter = RateFilter::new(&config, 1e-3)?;
//! let mut state = filter.initial_state();
//!
//! // The first sample sets the state to rest there; noise of the Nyquist frequency is then taken off.
//! let rate = Vec3::new(0.5, 0.0, -0.2);
//! assert_eq!(filter.step(&mut state, rate), rate);
//! for tick in 1..200 {
//!     let noise = if tick % 2 == 0 { 0.1 } else { -0.1 };
//!     let filtered = filter.step(&mut state, rate + Vec3::splat(noise));
//!     assert!(tick < 100 || (filtered - rate).abs().max_element() < 1e-5);
//! }
//! # Ok::<(), ctrl_core::error::ConfigError>(())
//! ```

mod biquad;
#[cfg(test)]
mod tests;

pub use biquad::{LowPassConfig, NotchConfig};

use biquad::{Memory, Section};
use glam::Vec3;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Bound, ConfigError};
use crate::list::List;

/// Most notches of a [`RateFilter`].
pub const NOTCHES_MAX: usize = 3;

/// Rates beyond this are nothing that a gyro measures; as finite as the states stay (rad/s).
const RATE_MAX: f32 = 1e6;

/// Filters of the body rate, in series. The default has none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(deny_unknown_fields, default))]
pub struct RateFilterConfig {
    /// Low-pass, if there is one.
    pub low_pass: Option<LowPassConfig>,
    /// Notches.
    pub notches: List<NotchConfig, NOTCHES_MAX>,
}

impl RateFilterConfig {
    /// `true` if there is no filter.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.low_pass.is_none() && self.notches.is_empty()
    }
}

/// A validated filter of the body rate; immutable, its memory is a [`RateFilterState`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateFilter {
    sections: List<Option<Section>, { NOTCHES_MAX + 1 }>,
}

/// Memory of a [`RateFilter`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RateFilterState {
    started: bool,
    memory: [Memory; NOTCHES_MAX + 1],
}

impl RateFilter {
    /// The filter for samples each `step_period` (s). Without sections it passes the rate on, bit for bit.
    ///
    /// # Errors
    /// A frequency outside `[0.001, 0.45]` of the sample rate, a quality outside `[0.3, 10]` (low-pass) or `[1, 100]` (notch).
    pub fn new(config: &RateFilterConfig, step_period: f32) -> Result<Self, ConfigError> {
        let mut sections = List::new();
        if let Some(low_pass) = &config.low_pass {
            let names = ["rate_filter.low_pass.frequency", "rate_filter.low_pass.quality"];
            require(names, [low_pass.frequency, low_pass.quality], step_period, (0.3, 10.0))?;
            // One place for the low-pass and one for each notch: never full.
            let _ = sections.push(Some(Section::low_pass(low_pass, step_period)));
        }
        for notch in &config.notches {
            let names = ["rate_filter.notches.frequency", "rate_filter.notches.quality"];
            require(names, [notch.frequency, notch.quality], step_period, (1.0, 100.0))?;
            let _ = sections.push(Some(Section::notch(notch, step_period)));
        }
        Ok(Self { sections })
    }

    /// Memory before the first sample.
    #[must_use]
    pub fn initial_state(&self) -> RateFilterState {
        RateFilterState::default()
    }

    /// The filtered rate of this sample (rad/s). The first sample is taken as the rate of a vehicle at rest there.
    ///
    /// Total: a rate that is not finite, or beyond 1e6 rad/s, is returned as it is, for the law to judge, and the memory
    /// stays.
    #[inline]
    pub fn step(&self, state: &mut RateFilterState, rate_body: Vec3) -> Vec3 {
        let size = rate_body.abs();
        if !(size.x <= RATE_MAX && size.y <= RATE_MAX && size.z <= RATE_MAX) {
            return rate_body;
        }
        if !state.started {
            *state = RateFilterState {
                started: true,
                memory: [Section::settled(rate_body); NOTCHES_MAX + 1],
            };
        }
        let mut filtered = rate_body;
        // wcet: at most 4 iterations
        for (section, memory) in self.sections.iter().flatten().zip(&mut state.memory) {
            filtered = section.step(memory, filtered);
        }
        filtered
    }
}

/// Checks frequency and quality of a section.
fn require(
    [frequency, quality]: [&'static str; 2],
    [f, q]: [f32; 2],
    step_period: f32,
    (q_least, q_most): (f32, f32),
) -> Result<(), ConfigError> {
    // Rounded to 1 mHz, so that 0.45 of 500 Hz is 225 Hz though 0.002 s is no number of `f32`.
    let rate = libm::roundf(1000.0 / step_period) / 1000.0;
    let frequencies = Bound::Inside(rate / 1000.0, rate * 9.0 / 20.0);
    if !frequencies.holds(f) {
        let source = "0.001 to 0.45 of the sample rate (Hz)";
        return Err(ConfigError::new(frequency, f, frequencies, source));
    }
    let qualities = Bound::Inside(q_least, q_most);
    if !qualities.holds(q) {
        return Err(ConfigError::new(quality, q, qualities, "quality of the filter"));
    }
    Ok(())
}
