//! Model of rotors that lag behind the commanded torque, for the laws that take the torque that acts in place
//! of the command; off by default. `docs/theory.md` says what that proves.
//!
//! With the time constants `T` of the rotors and `T_f` that the lead leaves, `m` the torque that acts at the
//! start of a step and `u` the law's demand:
//!
//! ```text
//! command = clip( m + r (u - m), -M_tau, M_tau )         r = (1 - e^(-dt/T_f))/(1 - e^(-dt/T))
//! acting  = command + (m - command) (1 - e^(-dt/T)) T/dt              mean over the step
//! m      += (1 - e^(-dt/T)) (command - m)
//! ```
//! While nothing clips, `m` follows `u` with `T_f` exactly: a lead filter `(1 + T s)/(1 + T_f s)` whose memory is
//! the rotors' own, so that it does not wind up where the clip acts.

use glam::Vec3;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::Bound::Inside;
use crate::error::{ConfigError, Judge};
use crate::saturation::clip;

/// Rotors between command and wrench as a law takes them to be.
///
/// Off by default, which leaves the paper's laws: the command acts at once.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct RotorModel {
    /// `T`: time constant with which the torque follows the command (s); zero switches the model off.
    pub lag: f32,
    /// `T_f`: time constant that the lead leaves of it (s); zero for no lead, `T_f = T`.
    pub residual_lag: f32,
}

impl RotorModel {
    /// A command that acts at once.
    pub const OFF: Self = Self { lag: 0.0, residual_lag: 0.0 };
}

/// Largest time constant (s).
const LAG_MAX: f32 = 1.0;

/// A [`RotorModel`] prepared for a fixed step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RotorLag {
    /// `1 - e^(-dt/T)`.
    gained: f32,
    /// `r`.
    lead: f32,
    /// `(1 - e^(-dt/T)) T/dt`.
    kept_in_the_mean: f32,
}

/// Command and effect of one step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Commanded {
    /// Torque to be commanded (N m).
    pub torque: Vec3,
    /// Torque that the rotors settle to under it: `torque`, unless their limits make less of it (N m).
    pub made: Vec3,
    /// Mean of the torque that acts over the step (N m).
    pub acting: Vec3,
    /// `true` if the clip acted, or the limits of the rotors.
    pub saturated: bool,
}

impl RotorLag {
    /// Checks `model` and prepares its steps of `step_period` (s); none if it is off.
    pub fn new(
        model: &RotorModel,
        step_period: f32,
        judge: &mut impl Judge,
    ) -> Result<Option<Self>, ConfigError> {
        let RotorModel { lag, residual_lag } = *model;
        judge.require("rotors.lag", lag, Inside(0.0, LAG_MAX), "time constant of the rotors")?;
        let least = if lag < step_period { lag } else { step_period };
        let led = residual_lag != 0.0; // NaN is judged
        let set = if led { Inside(least, lag) } else { Inside(0.0, LAG_MAX) };
        let source = "from step_period to rotors.lag, or zero for no lead";
        judge.require("rotors.residual_lag", residual_lag, set, source)?;
        let residual_lag = if led { residual_lag } else { lag };
        let gained = |constant: f32| -libm::expm1f(-step_period / constant);
        Ok((lag > 0.0).then(|| Self {
            gained: gained(lag),
            lead: gained(residual_lag) / gained(lag),
            kept_in_the_mean: gained(lag) * lag / step_period,
        }))
    }

    /// Command for the demand `demand` (N m) within `limit` (N m), while `now` acts.
    #[inline(always)]
    pub fn command(&self, demand: Vec3, limit: Vec3, now: Vec3) -> Commanded {
        let wanted = now + self.lead * (demand - now);
        let torque = clip(wanted, limit);
        let acting = self.mean(now, torque);
        Commanded { torque, made: torque, acting, saturated: torque != wanted }
    }

    /// Mean over a step of the torque that acts, from `now` on towards `command` (N m).
    #[inline(always)]
    pub fn mean(&self, now: Vec3, command: Vec3) -> Vec3 {
        command + self.kept_in_the_mean * (now - command)
    }

    /// Torque that acts one step after `now` (N m), while `command` is held.
    #[inline(always)]
    pub fn after(&self, now: Vec3, command: Vec3) -> Vec3 {
        now + self.gained * (command - now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Strict;
    use std::{assert, assert_eq};

    const NO_LIMIT: Vec3 = Vec3::MAX;

    fn rotors(lag: f32, residual_lag: f32) -> RotorLag {
        RotorLag::new(&RotorModel { lag, residual_lag }, 1e-3, &mut Strict).unwrap().unwrap()
    }

    #[test]
    fn the_torque_follows_a_step_of_the_demand_with_the_lag_that_is_left() {
        for (lag, residual_lag) in [(0.05, 0.05), (0.05, 0.0), (0.05, 0.0125), (0.02, 0.001)] {
            let rotors = rotors(lag, residual_lag);
            let residual = if residual_lag > 0.0 { residual_lag } else { lag };
            let mut now = Vec3::ZERO;
            for tick in 0..100 {
                let expected = 1.0 - libm::expf(-1e-3 * tick as f32 / residual);
                assert!((now.x - expected).abs() < 2e-6, "{lag} {residual}: {now} {expected}");
                let commanded = rotors.command(Vec3::ONE, NO_LIMIT, now);
                assert!(!commanded.saturated);
                // The mean over the step of an exponential: T (m[k+1] - m[k]) = dt (command - acting).
                let next = rotors.after(now, commanded.torque);
                let mean = commanded.torque - (lag / 1e-3) * (next - now);
                assert!((mean - commanded.acting).length() < 1e-4, "{mean} {}", commanded.acting);
                now = next;
            }
        }
    }

    #[test]
    fn a_clipped_command_does_not_wind_up() {
        let rotors = rotors(0.05, 0.0125);
        let limit = Vec3::new(0.5, 2.0, 10.0);
        let mut now = Vec3::ZERO;
        for _ in 0..1000 {
            let commanded = rotors.command(Vec3::ONE, limit, now);
            assert!(commanded.torque.abs().cmple(limit).all());
            now = rotors.after(now, commanded.torque);
        }
        assert!((now - Vec3::new(0.5, 1.0, 1.0)).length() < 1e-5, "{now}");
        // Back at once when the demand turns: the lead starts from what acts.
        assert!(rotors.command(Vec3::ZERO, limit, now).torque.x < 0.0);
    }

    #[test]
    fn a_model_that_is_off_or_out_of_range_is_told() {
        let new =
            |lag, residual_lag| RotorLag::new(&RotorModel { lag, residual_lag }, 1e-3, &mut Strict);
        assert_eq!(new(0.0, 0.0), Ok(None));
        assert_eq!(new(-0.1, 0.0).unwrap_err().parameter, "rotors.lag");
        for residual in [-0.01, 0.0005, 0.06, f32::NAN] {
            assert_eq!(new(0.05, residual).unwrap_err().parameter, "rotors.residual_lag");
        }
    }
}
