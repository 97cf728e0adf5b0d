//! Detection of a rotor that has failed, from the body rate and the thrusts that were commanded.
//!
//! With the thrusts `t_i` that the rotors have by a model of their lag, and the torque `b_i` of each for a newton, the torque that the motion
//! misses is smoothed over `T`:
//!
//! ```text
//! miss  = J (w - w_before)/dt - (J w) × w - sum_i b_i t_i,        r' = (miss - r)/T,   a_i' = (t_i - a_i)/T
//! ```
//!
//! A rotor that gives nothing leaves `r = -b_i a_i`. It is taken to have failed when, for a time without a break, it alone among the rotors
//! explains `r`:
//!
//! ```text
//! s_i = -b_i a_i,   |s_i| >= S,   share_i = r . s_i/|s_i|^2 >= share,   |r - share_i s_i| <= 0.35 |s_i|
//! ```
//!
//! A disturbance torque within `D` about each axis gives `share_i <= sqrt(3) D/S`, whatever its course, so that it never counts while
//! `D < share S/sqrt(3)`; the constructor takes `S` from `D`. What else adds to `r`: noise of the rate of the deviation `n` gives about
//! `J n/T`, an inertia off by a part `e` gives `e` of the torque that acts, a lag off by `dT` of it for about `dT`. Two rotors at one place
//! that turn in opposite directions explain the same and are not told apart: then none is reported.
//!
//! On the ground the feet carry torque that looks like a failure: call it in the air only, and [`reset`](RotorWatchState::reset) it before.

use glam::Vec3;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use super::geometry::effect;
use super::{MAX_ROTORS, RotorGeometry, RotorSet};
use crate::error::{Bound, ConfigError, require};

/// Largest part of a signature that another direction may have.
const ASIDE: f32 = 0.35;
/// Largest share of a rotor's thrust that can be missing.
const SHARE_MOST: f32 = 1.5;
/// `sqrt(3)`.
const ROOT_OF_THREE: f32 = 1.732_050_8;

/// Knowledge that the detection needs; there is no default, a vehicle without it does not watch.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct RotorWatchConfig {
    /// Principal moments of inertia (kg m^2), to a tenth or two.
    pub inertia: Vec3,
    /// `D`: largest disturbance torque about each axis (N m).
    pub disturbance_torque: f32,
    /// Time constant with which thrust follows its command (s); zero: at once.
    pub rotor_lag: f32,
    /// `T`: time constant of the smoothing (s).
    pub smoothing_time: f32,
    /// Part of its thrust that a rotor must miss, above a half.
    pub share: f32,
    /// Time without a break that counts (s).
    pub time: f32,
}

/// The detection, validated for a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotorWatch {
    /// `b_i`; zero from the number of rotors on.
    torques: [Vec3; MAX_ROTORS],
    inertia: Vec3,
    /// `S^2`.
    least_squared: f32,
    share: f32,
    /// Parts of the way that lag and smoothing go in a step.
    follow: f32,
    smooth: f32,
    rate: f32,
    periods: u32,
}

/// Memory of the detection.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RotorWatchState {
    /// `t_i`, `a_i` (N).
    thrusts: [f32; MAX_ROTORS],
    smoothed: [f32; MAX_ROTORS],
    /// `r` (N m).
    residual: Vec3,
    before: Option<Vec3>,
    suspect: u8,
    /// Periods in a row of the suspect.
    periods: u32,
    failed: RotorSet,
}

impl RotorWatchState {
    /// Rotors that were found to have failed.
    #[must_use]
    pub fn failed(&self) -> RotorSet {
        self.failed
    }

    /// Forgets the motion, for a vehicle that does not fly; what has failed stays so.
    pub fn reset(&mut self) {
        *self = Self { failed: self.failed, ..Self::default() };
    }
}

impl RotorWatch {
    /// Detection for the rotors of `geometry`, called every `step_period` (s).
    ///
    /// # Errors
    /// Names a number that is out of its range, or the number of rotors: no vehicle of four flies on three.
    pub fn new(
        config: &RotorWatchConfig,
        geometry: &RotorGeometry,
        step_period: f32,
    ) -> Result<Self, ConfigError> {
        let RotorWatchConfig {
            inertia,
            disturbance_torque,
            rotor_lag,
            smoothing_time,
            share,
            time,
        } = *config;
        let spare = Bound::Inside(5.0, MAX_ROTORS as f32);
        require("rotors (count)", geometry.rotors.len() as f32, spare, "four, and one to spare")?;
        let moments = Bound::Inside(1e-6, 1e3);
        // wcet: at most 3 iterations
        for moment in inertia.to_array() {
            require("rotor_watch.inertia", moment, moments, "each principal moment, kg m^2")?;
        }
        let torques = Bound::Inside(1e-6, 1e3);
        require("rotor_watch.disturbance_torque", disturbance_torque, torques, "each axis, N m")?;
        require("rotor_watch.rotor_lag", rotor_lag, Bound::Inside(0.0, 1.0), "time constant, s")?;
        let times = Bound::Inside(5.0 * step_period, 1.0);
        require("rotor_watch.smoothing_time", smoothing_time, times, "at least five steps, s")?;
        // Half of a signature 60 degrees aside is that of a neighbour among six.
        require("rotor_watch.share", share, Bound::Inside(0.55, 0.95), "missing part of a thrust")?;
        require("rotor_watch.time", time, Bound::Inside(step_period, 10.0), "time in a row, s")?;
        let mut columns = [Vec3::ZERO; MAX_ROTORS];
        // wcet: at most 8 iterations
        for (column, rotor) in columns.iter_mut().zip(&geometry.rotors) {
            let [_, x, y, z] = effect(rotor).to_array();
            *column = Vec3::new(x, y, z);
        }
        let least = ROOT_OF_THREE * disturbance_torque / share;
        let follow = if rotor_lag > 0.0 { 1.0 - libm::expf(-step_period / rotor_lag) } else { 1.0 };
        Ok(Self {
            torques: columns,
            inertia,
            least_squared: least * least,
            share,
            follow,
            smooth: step_period / smoothing_time,
            rate: 1.0 / step_period,
            periods: (time / step_period + 0.5) as u32,
        })
    }

    /// Takes the body rate (rad/s) at the end of a period, if it was measured, and the thrusts (N) that were commanded over it. Returns the
    /// place of a rotor that is now found to have failed, once.
    ///
    /// Total; what is not finite is a rate that was not measured, and what is too large for `f32` begins anew.
    pub fn step(
        &self,
        state: &mut RotorWatchState,
        rate_body: Option<Vec3>,
        thrusts: &[f32],
    ) -> Option<usize> {
        let torque = self.follow(state, thrusts);
        let rate = rate_body.filter(|rate| rate.is_finite());
        let before = core::mem::replace(&mut state.before, rate);
        let (rate, before) = (rate?, before?);
        let turning = self.inertia * (rate - before) * self.rate;
        let miss = turning - (self.inertia * rate).cross(rate) - torque;
        state.residual += self.smooth * (miss - state.residual);
        if !state.residual.is_finite() {
            state.reset();
            return None;
        }
        let suspect = self.suspect(state);
        let again = suspect.is_some_and(|suspect| suspect == usize::from(state.suspect));
        state.periods =
            if again { state.periods.saturating_add(1) } else { u32::from(suspect.is_some()) };
        state.suspect = suspect.unwrap_or(MAX_ROTORS) as u8;
        if suspect.is_none() || state.periods < self.periods {
            return None;
        }
        state.failed |= RotorSet::rotor(usize::from(state.suspect));
        (state.residual, state.periods) = (Vec3::ZERO, 0);
        suspect
    }

    /// Torque of the thrusts that act (N m); what has failed gives none.
    fn follow(&self, state: &mut RotorWatchState, thrusts: &[f32]) -> Vec3 {
        let mut torque = Vec3::ZERO;
        // wcet: at most 8 iterations
        for i in 0..MAX_ROTORS {
            let works = !state.failed.contains(RotorSet::rotor(i));
            let commanded = thrusts.get(i).filter(|thrust| works && thrust.is_finite());
            state.thrusts[i] +=
                self.follow * (commanded.copied().unwrap_or(0.0) - state.thrusts[i]);
            let acts = if works { state.thrusts[i] } else { 0.0 };
            state.smoothed[i] += self.smooth * (acts - state.smoothed[i]);
            torque += acts * self.torques[i];
        }
        torque
    }

    /// The one rotor whose failure explains the residual; none if no one's does, or that of several.
    fn suspect(&self, state: &RotorWatchState) -> Option<usize> {
        let residual = state.residual;
        let mut found = None;
        // wcet: at most 8 iterations
        for i in 0..MAX_ROTORS {
            let signature = -state.smoothed[i] * self.torques[i];
            let squared = signature.length_squared();
            let share = residual.dot(signature) / squared;
            let aside = residual - share * signature;
            if squared >= self.least_squared
                && (self.share..SHARE_MOST).contains(&share)
                && aside.length_squared() <= ASIDE * ASIDE * squared
            {
                if found.is_some() {
                    return None;
                }
                found = Some(i);
            }
        }
        found
    }
}

#[cfg(test)]
mod tests;
