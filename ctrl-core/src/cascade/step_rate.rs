//! What a fixed step asks of a loop: its fastest linear rate (or, for a second-order loop, its natural
//! frequency) times `dt` at most one, half of what makes a held first-order loop unstable.

use crate::error::Bound::AtMost;
use crate::error::{ConfigError, Judge};

/// Largest product of a loop's rate and the step period.
const STEP_RATE_MAX: f32 = 1.0;

/// Refuses a loop rate (1/s) that a step of `step_period` (s) cannot integrate.
pub(crate) fn require_integrable(
    judge: &mut impl Judge,
    parameter: &'static str,
    step_period: f32,
    rate: f32,
) -> Result<(), ConfigError> {
    let source = "stability of the fixed step";
    judge.require(parameter, step_period * rate, AtMost(STEP_RATE_MAX), source)
}
