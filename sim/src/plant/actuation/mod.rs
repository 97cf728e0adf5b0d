//! Actuator dynamics between the commanded and the applied wrench: limits of the rotors, a transport
//! delay, a first-order lag; any of them, in this order. Without any the vehicle is ideal: the command
//! acts at once and exactly, as the theorems assume.

pub(super) mod delay;
pub(super) mod lag;
mod limits;

pub use limits::Limits;

use ctrl_core::vehicle::{GRAVITY, Wrench};
use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::rigid_body::RigidBody;
use super::{AppliedWrench, Disturbance, PlantParameters, PlantState};
use delay::Delay;
use lag::Lag;

/// `[actuation]` of a scenario; what is absent does not act.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActuationConfig {
    /// Most thrust that the rotors can give; commands are clipped to `[0, thrust_max]` (N).
    pub thrust_max: Option<f64>,
    /// Most torque that they can give about each body axis, either way round (N m).
    #[serde(default, with = "crate::per_axis::optional")]
    pub torque_max: Option<DVec3>,
    /// Delay of a command, rounded to the nearest whole number of plant steps; at most [`DELAY_MAX`](Self::DELAY_MAX) (s).
    pub delay: Option<f64>,
    /// Time constant with which thrust and torque follow the command;
    /// at most [`ROTOR_LAG_MAX`](Self::ROTOR_LAG_MAX) (s).
    pub rotor_lag: Option<f64>,
}

impl ActuationConfig {
    /// Longest delay (s). It bounds the memory: a command is kept for each tick of the delay.
    pub const DELAY_MAX: f64 = 1.0;
    /// Longest time constant (s).
    pub const ROTOR_LAG_MAX: f64 = 10.0;

    /// The same with the delay that the plant steps of `h` (s) give.
    #[must_use]
    pub fn in_steps_of(self, h: f64) -> Self {
        Self { delay: self.delay.map(|delay| (delay / h).round() * h), ..self }
    }

    /// `true` if every command within the limits acts at once and exactly.
    #[must_use]
    pub fn is_prompt(&self) -> bool {
        [self.delay, self.rotor_lag].iter().all(|time| time.is_none_or(|time| time == 0.0))
    }

    /// `true` if every command acts at once and exactly.
    #[must_use]
    pub fn is_ideal(&self) -> bool {
        self.is_prompt() && self.limits().is_none()
    }

    /// The limits, if there are any.
    #[must_use]
    pub fn limits(&self) -> Option<Limits> {
        Limits::new(self.thrust_max, self.torque_max)
    }
}

/// The rotors in flight. Before the first command they hover: the vehicle's weight as thrust along body
/// z, no torque.
#[derive(Clone, Debug)]
pub struct Actuators {
    limits: Option<Limits>,
    delay: Delay<AppliedWrench>,
    lag: Option<Lag<AppliedWrench>>,
}

impl Actuators {
    /// Of a vehicle with `parameters` that `body` moves; none when the vehicle is ideal. `config`
    /// must have been validated.
    #[must_use]
    pub fn new(
        config: &ActuationConfig,
        parameters: &PlantParameters,
        body: &RigidBody,
    ) -> Option<Self> {
        let config = config.in_steps_of(body.sub_step_duration());
        if config.is_ideal() {
            return None;
        }
        let limits = config.limits();
        let weight = Wrench { thrust: parameters.mass as f32 * GRAVITY, ..Wrench::default() };
        let hover = AppliedWrench::from(limits.map_or(weight, |limits| limits.clip(&weight)));
        Some(Self {
            limits,
            delay: Delay::new(config.delay.unwrap_or_default(), hover, body),
            lag: Lag::new(config.rotor_lag.unwrap_or_default(), hover, body.sub_step_duration()),
        })
    }

    /// Receives the command of a tick, once before each [`advance`](Self::advance). Returns the wrench that acts on
    /// the vehicle at this instant.
    pub fn take(&mut self, command: &Wrench) -> AppliedWrench {
        let possible = self.limits.map_or(*command, |limits| limits.clip(command));
        self.delay.take(possible.into());
        self.lag.map_or_else(|| self.delay.acting(0), |lag| lag.now())
    }

    /// The state of the vehicle one step period later, under a held disturbance.
    pub fn advance(
        &mut self,
        body: &RigidBody,
        state: &PlantState,
        held: &Disturbance,
    ) -> PlantState {
        let mut state = *state;
        for step in 0..body.sub_steps() {
            let target = self.delay.acting(step);
            state = match &mut self.lag {
                None => body.sub_step_held(&state, &target, held),
                Some(lag) => body.sub_step_varying(&state, &lag.advance(target), held),
            };
        }
        state
    }
}

impl From<Wrench> for AppliedWrench {
    #[inline]
    fn from(wrench: Wrench) -> Self {
        Self { thrust: wrench.thrust.into(), torque_body: wrench.torque_body.as_dvec3() }
    }
}

/// What can lag: linear combinations of it.
pub(super) trait Combine: Copy {
    /// `a` of this and `b` of the other.
    fn combined(self, a: f64, other: Self, b: f64) -> Self;
}

impl Combine for AppliedWrench {
    #[inline]
    fn combined(self, a: f64, other: Self, b: f64) -> Self {
        let torque_body: DVec3 = a * self.torque_body + b * other.torque_body;
        Self { thrust: a * self.thrust + b * other.thrust, torque_body }
    }
}
