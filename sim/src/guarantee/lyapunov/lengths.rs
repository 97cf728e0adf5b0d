//! Lengths that the balance needs more than once, each computed once per tick.

use super::translation::Translation;
use crate::guarantee::block::Block;
use crate::lanes::{Quaternions, Scalars, Vectors};

/// Lengths at each tick of a block.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Lengths {
    /// Of `G`.
    pub g: Scalars,
    /// Of `alpha`: the thrust `f` (21) (N).
    pub alpha: Scalars,
    /// Of `sig_1(L1)`.
    pub sigma_1: Scalars,
    /// Of `eps_e`.
    pub attitude_error: Scalars,
    /// Of `w_e` (rad/s).
    pub rate_error: Scalars,
    /// Of `w` (rad/s).
    pub rate: Scalars,
    /// Of `mu` (rad/s).
    pub virtual_rate: Scalars,
    /// Of the reference's jerk (m/s^3).
    pub jerk: Scalars,
}

impl Lengths {
    pub fn new(
        block: &Block,
        translation: &Translation,
        thrust: Scalars,
        attitude_error: Quaternions,
        rate_error: Vectors,
    ) -> Self {
        Self {
            g: translation.g.norm(),
            alpha: thrust,
            sigma_1: translation.sigma_1.norm(),
            attitude_error: attitude_error.xyz().norm(),
            rate_error: rate_error.norm(),
            rate: block.rate.norm(),
            virtual_rate: block.law.mu.norm(),
            jerk: block.reference.jerk.norm(),
        }
    }
}
