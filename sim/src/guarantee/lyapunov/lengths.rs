//! Lengths that the balance needs more than once, each computed once per tick.

use glam::{DQuat, DVec3};

use crate::evaluation::{Lengths, Translation};
use crate::norm::Norm;
use crate::tick::Tick;

impl Lengths {
    pub(super) fn new(
        tick: &Tick,
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
            rate: tick.truth.rate_body.norm(),
            virtual_rate: tick.intermediates.mu.as_dvec3().norm(),
            jerk: tick.reference.jerk_world.as_dvec3().norm(),
        }
    }
}
