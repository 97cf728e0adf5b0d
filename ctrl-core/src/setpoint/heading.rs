//! The heading: a bounded rate behind two lags.
//!
//! ```text
//! y' = r,  r1' = (r - r1)/T,  r2' = (r1 - r2)/T
//! psi = y - T (r1 + r2),  psi' = r2,  psi'' = (r1 - r2)/T
//! ```

use core::f32::consts::PI;

use glam::Vec3;

use crate::jet::Jet;
use crate::trigonometry::sin_cos;

/// Time constant of the approach to a heading (s).
const APPROACH_TIME: f32 = 0.5;

/// Memory of the heading's shaping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HeadingShaper {
    /// `y` (rad), within half a turn.
    ahead: f32,
    /// `r1`, `r2` (rad/s).
    lags: [f32; 2],
}

impl HeadingShaper {
    /// At rest at `yaw` (rad).
    pub(super) fn at_rest(yaw: f32) -> Self {
        Self { ahead: within_half_a_turn(yaw), lags: [0.0; 2] }
    }

    /// Moves on by one tick of `dt` (s) towards the heading `yaw` (rad), the short way round, and on at
    /// `yaw_rate` (rad/s).
    pub(super) fn step(
        &mut self,
        yaw: Option<f32>,
        yaw_rate: Option<f32>,
        rate_max: f32,
        lag: f32,
        decay: f32,
        dt: f32,
    ) {
        let finite = |value: Option<f32>| value.filter(|x| x.is_finite());
        let towards = finite(yaw)
            .map_or(0.0, |yaw| within_half_a_turn(yaw - self.ahead) * (1.0 / APPROACH_TIME));
        let wanted = towards + finite(yaw_rate).unwrap_or(0.0);
        let rate = wanted.max(-rate_max).min(rate_max);
        self.ahead = within_half_a_turn(self.ahead + dt * rate);
        let [x1, x2] = self.lags.map(|lag| lag - rate);
        self.lags = [rate + decay * x1, rate + decay * (x2 + dt / lag * x1)];
    }

    /// `psi` (rad).
    pub(super) fn yaw(&self, lag: f32) -> f32 {
        let [r1, r2] = self.lags;
        within_half_a_turn(self.ahead - lag * (r1 + r2))
    }

    /// Direction of body x in the horizontal plane.
    pub(super) fn forward(&self, lag: f32) -> Jet<Vec3> {
        let [r1, r2] = self.lags;
        let (sin, cos) = sin_cos(self.yaw(lag));
        let (along, across) = (Vec3::new(cos, sin, 0.0), Vec3::new(-sin, cos, 0.0));
        let (rate, acceleration) = (r2, (r1 - r2) / lag);
        Jet::new(along, rate * across, acceleration * across - (rate * rate) * along)
    }
}

/// The same angle in [-pi, pi] (rad); zero for what is not finite.
fn within_half_a_turn(angle: f32) -> f32 {
    let turned = angle - 2.0 * PI * libm::roundf(angle * (0.5 / PI));
    if turned.is_finite() { turned } else { 0.0 }
}
