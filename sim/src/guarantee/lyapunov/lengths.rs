//! Lengths that the balance needs more than once, each taken once a tick.

use glam::{DQuat, DVec3};

use super::translation::Translation;
use crate::norm::Norm;
use crate::sample::Sample;

/// Lengths at one tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lengths {
    /// Of `G`.
    pub g: f64,
    /// Of `alpha`: the thrust `f` (21) (N).
    pub alpha: f64,
    /// Of `sig_1(L1)`.
    pub sigma_1: f64,
    /// Of `eps_e`.
    pub attitude_error: f64,
    /// Of `w_e` (rad/s).
    pub rate_error: f64,
    /// Of `w` (rad/s).
    pub rate: f64,
    /// Of `mu` (rad/s).
    pub virtual_rate: f64,
    /// Of the reference's jerk (m/s^3).
    pub jerk: f64,
}

impl Lengths {
    pub fn new(
        sample: &Sample,
        translation: &Translation,
        attitude_error: DQuat,
        rate_error: DVec3,
    ) -> Self {
        Self {
            g: translation.g.norm(),
            alpha: translation.alpha.norm(),
            sigma_1: translation.sigma_1.norm(),
            attitude_error: attitude_error.xyz().norm(),
            rate_error: rate_error.norm(),
            rate: sample.truth.rate_body.norm(),
            virtual_rate: sample.intermediates.mu.as_dvec3().norm(),
            jerk: sample.reference.jerk_world.as_dvec3().norm(),
        }
    }
}
