//! `[state_feedback]` of a scenario: what separates the state that the controller receives from the truth.

use serde::{Deserialize, Serialize};

use crate::number::number;

/// Noise and latency of the state that the controller receives, per quantity; what is absent is exact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StateFeedbackConfig {
    /// Of the position (m).
    pub position: Option<QuantityFeedback>,
    /// Of the velocity (m/s).
    pub velocity: Option<QuantityFeedback>,
    /// Of the attitude: a rotation about body axes (rad).
    pub attitude: Option<QuantityFeedback>,
    /// Of the body rate (rad/s).
    pub rate_body: Option<QuantityFeedback>,
}

/// Noise and latency of one quantity, in its unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct QuantityFeedback {
    /// Standard deviation of each component of white noise, drawn anew at every tick.
    pub white_noise: Option<f64>,
    /// Noise within a band.
    pub band_limited_noise: Option<BandLimitedNoise>,
    /// Age of the state, rounded to whole ticks; at most [`LATENCY_MAX`](Self::LATENCY_MAX) (s).
    pub latency: Option<f64>,
}

impl QuantityFeedback {
    /// Longest latency (s). It bounds the memory: a state is kept for each tick of it.
    pub const LATENCY_MAX: f64 = 0.5;
}

/// Noise within a band: stationary, normal, with the spectrum of [`super::noise`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BandLimitedNoise {
    /// Standard deviation of each component.
    pub deviation: f64,
    /// Centre of the band; zero for noise from zero to `bandwidth`, that of the rotors for vibration (Hz).
    #[serde(default)]
    pub center: f64,
    /// Distance from `center` at which the power density is half (Hz).
    pub bandwidth: f64,
}

/// A bound that a value does not keep: dotted path below the section, value, and bound.
pub(crate) type Fault = (&'static str, f64, String);

/// Keys of one quantity, so that errors name them.
struct Keys {
    white_noise: &'static str,
    deviation: &'static str,
    center: &'static str,
    bandwidth: &'static str,
    latency: &'static str,
}

macro_rules! keys {
    ($quantity:literal) => {
        Keys {
            white_noise: concat!("state_feedback.", $quantity, ".white_noise"),
            deviation: concat!("state_feedback.", $quantity, ".band_limited_noise.deviation"),
            center: concat!("state_feedback.", $quantity, ".band_limited_noise.center"),
            bandwidth: concat!("state_feedback.", $quantity, ".band_limited_noise.bandwidth"),
            latency: concat!("state_feedback.", $quantity, ".latency"),
        }
    };
}

const KEYS: [Keys; 4] =
    [keys!("position"), keys!("velocity"), keys!("attitude"), keys!("rate_body")];

impl StateFeedbackConfig {
    /// The quantities in the order position, velocity, attitude, body rate.
    #[must_use]
    pub fn quantities(&self) -> [QuantityFeedback; 4] {
        [self.position, self.velocity, self.attitude, self.rate_body].map(Option::unwrap_or_default)
    }

    /// `true` if the controller receives exactly the truth.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        self.quantities().iter().all(|it| {
            let zero = |value: Option<f64>| value.is_none_or(|value| value == 0.0);
            let band = it.band_limited_noise.is_none_or(|band| band.deviation == 0.0);
            zero(it.white_noise) && zero(it.latency) && band
        })
    }

    /// The first value out of its range, for ticks of `step_period` (s).
    pub(crate) fn first_fault(&self, step_period: f64) -> Option<Fault> {
        // The step period comes from `f32`: 500 Hz must not exceed half of 1 kHz by its rounding.
        let nyquist = 0.5 / step_period * (1.0 + f64::from(f32::EPSILON));
        let checks = self.quantities().into_iter().zip(&KEYS).flat_map(|(it, keys)| {
            let QuantityFeedback { white_noise, band_limited_noise: band, latency } = it;
            let frequency = |positive: bool| {
                let open = if positive { "(" } else { "[" };
                format!("in {open}0, {}] Hz, half the control rate", number(nyquist))
            };
            [
                white_noise.map(|x| (keys.white_noise, x, x >= 0.0, "zero or positive".to_owned())),
                band.map(|band| {
                    let x = band.deviation;
                    (keys.deviation, x, x >= 0.0, "zero or positive".to_owned())
                }),
                band.map(|band| {
                    let x = band.center;
                    (keys.center, x, (0.0..=nyquist).contains(&x), frequency(false))
                }),
                band.map(|band| {
                    let x = band.bandwidth;
                    (keys.bandwidth, x, x > 0.0 && x <= nyquist, frequency(true))
                }),
                latency.map(|x| {
                    let holds = (0.0..=QuantityFeedback::LATENCY_MAX).contains(&x);
                    (keys.latency, x, holds, format!("in [0, {}] s", QuantityFeedback::LATENCY_MAX))
                }),
            ]
        });
        let mut faults =
            checks.flatten().filter(|(_, value, holds, _)| !(value.is_finite() && *holds));
        faults.next().map(|(path, value, _, bound)| (path, value, bound))
    }
}
