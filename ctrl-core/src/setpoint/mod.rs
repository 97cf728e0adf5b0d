//! Set-points of an operator, shaped into references inside `M_p` with exact derivatives up to snap.
//!
//! A [`Setpoint`] may jump; a reference must not. [`Shaper`] drives a double integrator `q'' = u` by a
//! bounded acceleration `|u| <= A <= M_p`, held over each tick, and takes as reference what three equal
//! first-order lags of time constant `T` make of `q`:
//!
//! ```text
//! w' = u,  q' = w
//! a1' = (u - a1)/T,  a2' = (a1 - a2)/T,  a3' = (a2 - a3)/T
//! p_d     = q - 3 T p_d' - 2 T^2 a3 - T^2 a2
//! p_d'    = w - T (a1 + a2 + a3)
//! p_d''   = a3
//! p_d'''  = (a2 - a3)/T
//! p_d'''' = (a1 - 2 a2 + a3)/T^2
//! ```
//!
//! The impulse response of the lags is positive with unit area, so `a3` lies in the hull of the past `u`:
//! the bound `A` holds for all time (Assumption 4), whatever the set-points are. Lags and integrators
//! are advanced by their exact solutions for a held `u`, and the reference is continuous to the snap.
//!
//! The heading is shaped alike: a bounded rate, two lags, and thereby two exact derivatives.

mod heading;
#[cfg(test)]
mod tests;

use glam::Vec3;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Bound, ConfigError, require};
use crate::reference::Reference;
use crate::sqrt::sqrt;
use crate::trajectory::REACH;
use heading::HeadingShaper;

/// Time constant of the velocity loop of the double integrator (s).
const VELOCITY_TIME: f32 = 0.25;
/// Time constant of its position loop near the target (s): four times the former, no overshoot.
const POSITION_TIME: f32 = 1.0;
/// Share of the acceleration bound that braking is planned with; the rest is for following the plan.
const BRAKING_SHARE: f32 = 0.6;
/// Largest share of `M_p` that is commanded: what rounding adds stays inside.
const BOUND_SHARE: f32 = 0.999;
/// The part of the position that is rounded like a small number (m).
const CELL: f32 = 4.0;

/// Limits of the shaped motion.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct ShaperConfig {
    /// `dt`: time between two ticks (s).
    pub step_period: f32,
    /// Bound of the length of the acceleration (m/s^2), at most the controller's `M_p`.
    pub acceleration_max: f32,
    /// Bound of the horizontal speed (m/s).
    pub speed_max: f32,
    /// Bound of the upward speed (m/s).
    pub climb_max: f32,
    /// Bound of the downward speed (m/s).
    pub descent_max: f32,
    /// Bound of the rate of the heading (rad/s).
    pub yaw_rate_max: f32,
    /// `T`: time constant of each lag (s).
    pub smoothing_time: f32,
}

/// Desired motion, in the world frame; what is absent is free, and every axis has its own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Setpoint {
    /// Position (m).
    pub position_world: [Option<f32>; 3],
    /// Velocity (m/s); beside a position it is added to what leads there.
    pub velocity_world: [Option<f32>; 3],
    /// Acceleration (m/s^2); alone it is followed up to the speed limit.
    pub acceleration_world: [Option<f32>; 3],
    /// Angle of body x from world x about world z (rad).
    pub yaw: Option<f32>,
    /// Its rate (rad/s).
    pub yaw_rate: Option<f32>,
}

impl Setpoint {
    /// At rest in `position_world` (m), the heading kept.
    #[must_use]
    pub fn at(position_world: Vec3) -> Self {
        Self { position_world: position_world.to_array().map(Some), ..Self::default() }
    }

    /// The same with the heading `yaw` (rad).
    #[must_use]
    pub fn facing(self, yaw: f32) -> Self {
        Self { yaw: Some(yaw), ..self }
    }
}

/// The shaping filter, validated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaper {
    config: ShaperConfig,
    /// `exp(-dt/T)`.
    decay: f32,
}

/// Memory of the shaping: the reference in motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShaperState {
    /// Whole cells of `q`, exact in `f32` (m).
    cell_world: Vec3,
    /// `q` less its cells (m).
    offset: Vec3,
    /// `w` (m/s).
    velocity: Vec3,
    /// `a1`, `a2`, `a3` (m/s^2).
    lags: [Vec3; 3],
    heading: HeadingShaper,
}

impl ShaperState {
    /// At rest in `position_world` (m) with the heading `yaw` (rad); what is not finite counts as zero.
    #[must_use]
    pub fn at_rest(position_world: Vec3, yaw: f32) -> Self {
        let finite = |x: f32| if x.abs() <= REACH { x } else { 0.0 };
        let position = Vec3::from_array(position_world.to_array().map(finite));
        Self {
            cell_world: Vec3::ZERO,
            offset: position,
            velocity: Vec3::ZERO,
            lags: [Vec3::ZERO; 3],
            heading: HeadingShaper::at_rest(finite(yaw)),
        }
        .in_cells()
    }

    /// Moves whole cells of the offset into the exact part.
    fn in_cells(mut self) -> Self {
        if self.offset.abs().max_element() > CELL {
            let cells = Vec3::from_array(self.offset.to_array().map(libm::roundf));
            self.cell_world += cells;
            self.offset -= cells;
        }
        self
    }

    /// `q`, where the reference comes to rest if the speed is taken away now (m).
    fn ahead_world(&self) -> Vec3 {
        self.cell_world + self.offset
    }
}

impl Shaper {
    /// Checks the limits.
    ///
    /// # Errors
    /// Names a limit that is out of its range.
    pub fn new(config: &ShaperConfig) -> Result<Self, ConfigError> {
        let rates = Bound::Inside(1e-4, 0.1);
        require("shaper.step_period", config.step_period, rates, "10 Hz to 10 kHz")?;
        let pull = Bound::Inside(1e-3, 9.0);
        require("shaper.acceleration_max", config.acceleration_max, pull, "below g, m/s^2")?;
        let speeds = [
            ("shaper.speed_max", config.speed_max),
            ("shaper.climb_max", config.climb_max),
            ("shaper.descent_max", config.descent_max),
        ];
        for (name, speed) in speeds {
            require(name, speed, Bound::Inside(0.01, 100.0), "speed, m/s")?;
        }
        let turn = Bound::Inside(0.01, 6.3);
        require("shaper.yaw_rate_max", config.yaw_rate_max, turn, "rate of the heading, rad/s")?;
        let lag = Bound::Inside(4.0 * config.step_period, 2.0);
        require("shaper.smoothing_time", config.smoothing_time, lag, "4 steps to 2 s")?;
        let decay = libm::expf(-config.step_period / config.smoothing_time);
        Ok(Self { config: *config, decay })
    }

    /// The limits.
    #[must_use]
    pub fn config(&self) -> &ShaperConfig {
        &self.config
    }

    /// A bound of each component of the reference's acceleration, over all time (m/s^2).
    #[must_use]
    pub fn acceleration_bound(&self) -> f32 {
        self.config.acceleration_max
    }

    /// Checks that a set-point is finite, and within the limits where it states them.
    ///
    /// # Errors
    /// Names the field, its value and the bound.
    pub fn check(&self, setpoint: &Setpoint) -> Result<(), ConfigError> {
        let ShaperConfig { acceleration_max, speed_max, climb_max, yaw_rate_max, .. } = self.config;
        let within = |name, value: Option<f32>, bound: f32, source| {
            let value = value.unwrap_or(0.0);
            require(name, value, Bound::Inside(-bound, bound), source)
        };
        let fastest = speed_max.max(climb_max).max(self.config.descent_max);
        for axis in 0..3 {
            let [position, velocity, acceleration] =
                [setpoint.position_world, setpoint.velocity_world, setpoint.acceleration_world]
                    .map(|vector| vector.get(axis).copied().flatten());
            within("setpoint.position", position, REACH, "reach of f32, m")?;
            within("setpoint.velocity", velocity, fastest, "speed limit, m/s")?;
            within("setpoint.acceleration", acceleration, acceleration_max, "M_p, m/s^2")?;
        }
        within("setpoint.yaw", setpoint.yaw, 4.0 * core::f32::consts::PI, "two turns, rad")?;
        within("setpoint.yaw_rate", setpoint.yaw_rate, yaw_rate_max, "limit, rad/s")
    }

    /// Moves on by one tick towards `setpoint`; returns the reference of the new tick.
    ///
    /// Total: what is not finite in the set-point counts as absent.
    pub fn step(&self, state: &mut ShaperState, setpoint: &Setpoint) -> Reference {
        let command = self.acceleration(state, setpoint);
        self.advance(state, command);
        let ShaperConfig { step_period, yaw_rate_max, smoothing_time, .. } = self.config;
        let Setpoint { yaw, yaw_rate, .. } = *setpoint;
        let (lag, decay) = (smoothing_time, self.decay);
        state.heading.step(yaw, yaw_rate, yaw_rate_max, lag, decay, step_period);
        self.reference(state)
    }

    /// The reference now.
    #[must_use]
    pub fn reference(&self, state: &ShaperState) -> Reference {
        let lag = self.config.smoothing_time;
        let ([a1, a2, a3], rate) = (state.lags, 1.0 / lag);
        let velocity = state.velocity - lag * (a1 + a2 + a3);
        let behind = 3.0 * lag * velocity + lag * lag * (a2 + a3 + a3);
        let moving = Reference {
            velocity_world: velocity,
            acceleration_world: a3,
            jerk_world: rate * (a2 - a3),
            snap_world: rate * rate * (a1 - a2 - a2 + a3),
            ..Reference::hover(state.cell_world + (state.offset - behind))
        };
        moving.facing(state.heading.forward(lag))
    }

    /// The heading of the reference (rad).
    #[must_use]
    pub fn yaw(&self, state: &ShaperState) -> f32 {
        state.heading.yaw(self.config.smoothing_time)
    }

    /// `u`: the acceleration that leads `q` to the set-point, within the bound.
    fn acceleration(&self, state: &ShaperState, setpoint: &Setpoint) -> Vec3 {
        let finite = |value: Option<f32>| value.filter(|x| x.is_finite());
        let position = setpoint.position_world.map(finite);
        let velocity = setpoint.velocity_world.map(finite);
        let pull = setpoint.acceleration_world.map(finite);
        let q = (state.cell_world.to_array(), state.offset.to_array());
        let error = [0, 1, 2].map(|i: usize| match position[i] {
            Some(target) => (target - q.0[i]) - q.1[i],
            None => 0.0,
        });
        let along = self.approach(Vec3::from_array(error));
        let wanted = [0, 1, 2].map(|i: usize| along[i] + velocity[i].unwrap_or(0.0));
        let wanted = self.limited(Vec3::from_array(wanted));
        let follow = (wanted - state.velocity) * (1.0 / VELOCITY_TIME);
        let within = (self.limited(state.velocity) - state.velocity) * (1.0 / VELOCITY_TIME);
        let command = [0, 1, 2].map(|i: usize| {
            match (position[i].or(velocity[i]), pull[i]) {
                (None, Some(pull)) => pull + within[i], // free until too fast
                (_, pull) => follow[i] + pull.unwrap_or(0.0),
            }
        });
        self.bounded(Vec3::from_array(command), wanted)
    }

    /// Velocity that leads over the distance `error` (m) to rest.
    fn approach(&self, error: Vec3) -> Vec3 {
        let distance = sqrt(error.length_squared());
        let braking = BRAKING_SHARE * self.config.acceleration_max;
        let near = braking * POSITION_TIME * POSITION_TIME;
        if distance <= near {
            return error * (1.0 / POSITION_TIME);
        }
        let speed = sqrt(2.0 * braking * (distance - 0.5 * near));
        self.limited(error * (speed / distance))
    }

    /// The velocity in its own direction, shortened until no limit of speed is exceeded.
    fn limited(&self, velocity: Vec3) -> Vec3 {
        let ShaperConfig { speed_max, climb_max, descent_max, .. } = self.config;
        let horizontal = sqrt(velocity.x * velocity.x + velocity.y * velocity.y);
        let vertical_max = if velocity.z > 0.0 { climb_max } else { descent_max };
        let excess = (horizontal / speed_max).max(velocity.z.abs() / vertical_max);
        if excess > 1.0 { velocity * (1.0 / excess) } else { velocity }
    }

    /// The acceleration, no longer than the bound: what is across `way`, the wanted velocity, comes first, so
    /// that a change of course ends the old motion before it begins the new one. Zero if not finite.
    fn bounded(&self, acceleration: Vec3, way: Vec3) -> Vec3 {
        let bound = BOUND_SHARE * self.config.acceleration_max;
        let length = sqrt(acceleration.length_squared());
        if length <= bound {
            return acceleration;
        } else if length.is_nan() || length >= f32::MAX {
            return Vec3::ZERO;
        }
        let speed = sqrt(way.length_squared());
        let direction = if speed > 1e-6 { way * (1.0 / speed) } else { Vec3::ZERO };
        let along = acceleration.dot(direction);
        let across = acceleration - along * direction;
        let width = sqrt(across.length_squared());
        if width >= bound {
            return across * (bound / width);
        }
        let left = sqrt(bound * bound - width * width);
        across + along.max(-left).min(left) * direction
    }

    /// The exact solution of integrators and lags over a tick with `u` held.
    fn advance(&self, state: &mut ShaperState, u: Vec3) {
        let dt = self.config.step_period;
        state.offset += dt * state.velocity + (0.5 * dt * dt) * u;
        state.velocity += dt * u;
        let h = dt / self.config.smoothing_time;
        let [x1, x2, x3] = state.lags.map(|lag| lag - u);
        state.lags = [
            u + self.decay * x1,
            u + self.decay * (x2 + h * x1),
            u + self.decay * (x3 + h * (x2 + 0.5 * h * x1)),
        ];
        // The way ends where f32 does.
        let ahead = state.ahead_world();
        if ahead.abs().max_element() > REACH {
            state.offset = ahead.clamp(Vec3::splat(-REACH), Vec3::splat(REACH)) - state.cell_world;
            state.velocity = Vec3::ZERO;
        }
        *state = state.in_cells();
    }
}
