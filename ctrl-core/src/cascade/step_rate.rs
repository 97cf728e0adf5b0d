//! What a fixed step asks of a loop: its fastest linear rate (or, for a second-order loop, its natural
//! frequency) times `dt` at most one, half of what makes a held first-order loop unstable.

use glam::Vec3;

use crate::error::Bound::AtMost;
use crate::error::{AxisNames, ConfigError, Judge};

/// Largest product of a loop's rate and the step period.
const STEP_RATE_MAX: f32 = 1.0;

/// Origin of the bound.
const SOURCE: &str = "stability of the fixed step";

/// Refuses a loop rate (1/s) that a step of `step_period` (s) cannot integrate.
pub(crate) fn require_integrable(
    judge: &mut impl Judge,
    parameter: &'static str,
    step_period: f32,
    rate: f32,
) -> Result<(), ConfigError> {
    judge.require(parameter, step_period * rate, AtMost(STEP_RATE_MAX), SOURCE)
}

/// [`require_integrable`] about each axis.
pub(crate) fn require_integrable_axes(
    judge: &mut impl Judge,
    names: &'static AxisNames,
    step_period: f32,
    rate: Vec3,
) -> Result<(), ConfigError> {
    judge.require_axes(names, step_period * rate, [AtMost(STEP_RATE_MAX); 3], SOURCE)
}
