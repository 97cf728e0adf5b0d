//! Arming, flight and failsafe: which wrench may reach the rotors.
//!
//! ```text
//!              Arm            Start             n in a row: samples missed, steps faulted, overruns
//! Disarmed ---------> Armed ---------> Flying ----------------------------------+
//!    ^  ^              |  ^------------- | Stop                                  v
//!    |  +--------------+                 | <--- Start (samples are back) --- Failsafe
//!    |   Disarm, samples missed          |                                       | time is over
//!    +--- Disarm, from every mode but a Locked one with a fault ---- Locked <----+---- any fault
//! ```
//!
//! A kill leads from every mode to Locked, and back only a Disarm once it is released. Hazards that
//! [`safety`] watches for keep the vehicle from being armed, disarm it on the ground, and lead from Flying
//! to Failsafe or Locked where the reaction is so strong.
//!
//! Only Flying passes the controller's wrench on; Failsafe gives the descent's constant thrust;
//! every other mode gives [`SAFE`]. The way to either leads through an accepted Arm and Start.
//! `Stop` and `Disarm` cut the thrust where the vehicle is: to come down, fly a trajectory that
//! does.
//!
//! Pure: the tick and all conditions are arguments. [`Supervisor::step`] is called once a control
//! period, before the output, so that the failsafe output takes over in the period of the n-th
//! miss.
//!
//! [`navigation`] chooses the references of a flight that is commanded while it lasts.

pub mod navigation;
pub mod safety;

use core::fmt;

use glam::{Quat, Vec3};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::controller::StepStatus;
use crate::error::{Bound, ConfigError, require};
use crate::trigonometry::sin_cos;
use crate::vehicle::Wrench;
use safety::{Hazards, Reaction, SafetyReport};

/// The wrench of stopped rotors.
pub const SAFE: Wrench = Wrench { thrust: 0.0, torque_body: Vec3::ZERO };

/// Permission of the vehicle to turn its rotors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub enum Mode {
    /// Rotors stopped.
    #[default]
    Disarmed,
    /// Rotors stopped, ready to fly at a Start.
    Armed,
    /// The controller's wrench is live.
    Flying,
    /// Descending with constant thrust and zero torque.
    Failsafe,
    /// Rotors stopped after a failsafe or a fault, until a Disarm.
    Locked,
}

/// Reason for a change to a safer mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[non_exhaustive]
pub enum Cause {
    /// Too many periods in a row without a good state sample.
    SamplesMissed,
    /// Too many steps in a row with a [`StepStatus::FAULT`].
    StepsFaulted,
    /// Too many periods in a row that ended late.
    Overruns,
    /// A fault was reported.
    Fault,
    /// The kill switch.
    Killed,
    /// A hazard whose reaction is to descend or to cut.
    Hazard,
}

impl Cause {
    /// The reason in words.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::SamplesMissed => "state samples missed",
            Self::StepsFaulted => "the law could not be evaluated",
            Self::Overruns => "control overruns",
            Self::Fault => "fault",
            Self::Killed => "kill switch",
            Self::Hazard => "hazard",
        }
    }
}

/// Command of an operator or host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub enum Command {
    /// Get ready to fly.
    Arm,
    /// Stop the rotors and forget a failsafe.
    Disarm,
    /// Make the controller's wrench live; also recovers from a failsafe.
    Start,
    /// Stop the rotors but stay armed.
    Stop,
    /// Stop the rotors at once, from every mode, and stay locked until a Disarm.
    Kill,
}

/// Reason for the refusal of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[non_exhaustive]
pub enum Refusal {
    /// Arm first.
    NotArmed,
    /// Too few good state samples in a row.
    StateStale,
    /// Tilted beyond the arming limit, or the attitude is not a rotation.
    Tilted,
    /// A fault is present.
    Fault,
    /// In failsafe: only Start and Disarm are accepted.
    InFailsafe,
    /// Locked: Disarm first.
    Locked,
    /// The kill switch is on.
    Killed,
    /// These hazards are present.
    Hazard(Hazards),
}

impl Refusal {
    /// The reason in words; [`Hazard`](Self::Hazard) without its names.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Hazard(_) => "a hazard is present",
            Self::Killed => "the kill switch is on",
            Self::NotArmed => "not armed",
            Self::StateStale => "too few good state samples in a row",
            Self::Tilted => "tilted beyond the arming limit",
            Self::Fault => "a fault is present",
            Self::InFailsafe => "in failsafe: start or disarm",
            Self::Locked => "locked: disarm first",
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hazard(hazards) => hazards.fmt(out),
            _ => out.write_str(self.as_str()),
        }
    }
}

impl core::error::Error for Refusal {}

/// Action of the failsafe.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case", deny_unknown_fields))]
pub enum FailsafePolicy {
    /// Stop the rotors at once.
    Cut,
    /// Constant thrust with zero torque for a time, then stop the rotors.
    Descend {
        /// Thrust along body z (N), not negative: a little below the weight.
        thrust: f32,
        /// For how many ticks, at least one.
        ticks: u32,
    },
}

/// Limits of the supervision.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct SupervisorConfig {
    /// Largest angle between body z and the vertical at Arm and at Start on the ground (rad), in
    /// (0, pi/2].
    pub arming_tilt_max: f32,
    /// Good state samples in a row that make the state fresh, at least one.
    pub fresh_samples: u16,
    /// Missed samples in a row that trigger the failsafe, at least one.
    pub missed_samples_max: u16,
    /// Faulted steps in a row that trigger the failsafe, at least one.
    pub faulted_steps_max: u16,
    /// Overruns in a row that trigger the failsafe, at least one.
    pub overruns_max: u16,
    /// Action of the failsafe.
    pub failsafe: FailsafePolicy,
}

/// Conditions of one control period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// Attitude of this period's good state sample; none if it was missed.
    pub attitude: Option<Quat>,
    /// Status of the last step of the controller; empty while none runs.
    pub step: StepStatus,
    /// The last control period ended after its deadline.
    pub overrun: bool,
    /// A fault is present: a driver failed, or a crash has not been acknowledged.
    pub fault: bool,
    /// The rotor outputs are off whatever the mode: the arming tilt does not matter.
    pub outputs_off: bool,
    /// The kill switch is on.
    pub kill: bool,
    /// Hazards of this period; empty where none is watched for.
    pub safety: SafetyReport,
}

/// Memory of the supervision; starts disarmed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SupervisorState {
    mode: Mode,
    since: u64,
    cause: Option<Cause>,
    level: bool,
    fault: bool,
    kill: bool,
    hazards: Hazards,
    fresh: u16,
    missed: u16,
    faulted: u16,
    overruns: u16,
}

impl SupervisorState {
    /// The current mode.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// The tick of the last change of mode.
    #[must_use]
    pub fn since(&self) -> u64 {
        self.since
    }

    /// Reason for the last change to a safer mode; `None` since the last accepted Arm or Start.
    #[must_use]
    pub fn cause(&self) -> Option<Cause> {
        self.cause
    }

    fn enter(&mut self, mode: Mode, tick: u64, cause: Option<Cause>) {
        if self.mode != mode {
            *self = Self { mode, since: tick, ..*self };
        }
        self.cause = cause;
    }

    /// Counts what a period saw; each count is of periods in a row.
    fn count(&mut self, conditions: &Conditions, cos_tilt_max: f32) {
        let in_a_row =
            |count: u16, happened: bool| if happened { count.saturating_add(1) } else { 0 };
        self.fresh = in_a_row(self.fresh, conditions.attitude.is_some());
        self.missed = in_a_row(self.missed, conditions.attitude.is_none());
        self.faulted = in_a_row(self.faulted, conditions.step.intersects(StepStatus::FAULT));
        self.overruns = in_a_row(self.overruns, conditions.overrun);
        self.fault = conditions.fault;
        self.kill = conditions.kill;
        self.hazards = conditions.safety.hazards;
        if let Some(attitude) = conditions.attitude {
            let cos_tilt = cos_tilt(attitude);
            let is_rotation = !cos_tilt.is_nan();
            self.level = cos_tilt >= cos_tilt_max || conditions.outputs_off && is_rotation;
        }
    }
}

/// The state machine, validated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Supervisor {
    config: SupervisorConfig,
    cos_tilt_max: f32,
}

impl Supervisor {
    /// Checks the limits.
    ///
    /// # Errors
    /// Names a limit that is zero or out of its range.
    pub fn new(config: &SupervisorConfig) -> Result<Self, ConfigError> {
        let upright = Bound::Inside(0.01, core::f32::consts::FRAC_PI_2);
        require("arming_tilt_max", config.arming_tilt_max, upright, "angle from upright, rad")?;
        let counts = [
            ("fresh_samples", config.fresh_samples),
            ("missed_samples_max", config.missed_samples_max),
            ("faulted_steps_max", config.faulted_steps_max),
            ("overruns_max", config.overruns_max),
        ];
        for (name, count) in counts {
            require(name, f32::from(count), Bound::AtLeast(1.0), "periods in a row")?;
        }
        if let FailsafePolicy::Descend { thrust, ticks } = config.failsafe {
            require(
                "failsafe.descend.thrust",
                thrust,
                Bound::Inside(0.0, 1e4),
                "constant thrust of the descent, N",
            )?;
            require(
                "failsafe.descend.ticks",
                ticks as f32,
                Bound::AtLeast(1.0),
                "for a descent of no duration, use cut",
            )?;
        }
        Ok(Self { config: *config, cos_tilt_max: sin_cos(config.arming_tilt_max).1 })
    }

    /// Takes note of one control period and makes the transitions that follow from it.
    pub fn step(&self, state: &mut SupervisorState, tick: u64, conditions: &Conditions) -> Mode {
        state.count(conditions, self.cos_tilt_max);
        if state.fault || state.kill {
            let cause = if state.fault { Cause::Fault } else { Cause::Killed };
            state.enter(Mode::Locked, tick, Some(cause));
            return state.mode;
        }
        let reaction = conditions.safety.reaction;
        let hazard = reaction >= Some(Reaction::Failsafe);
        let cut = reaction >= Some(Reaction::Stop);
        match (state.mode, self.trigger(state).or(hazard.then_some(Cause::Hazard))) {
            (Mode::Armed, _) if !state.hazards.is_empty() => {
                state.enter(Mode::Disarmed, tick, Some(Cause::Hazard));
            }
            (Mode::Flying | Mode::Failsafe, _) if cut => {
                state.enter(Mode::Locked, tick, Some(Cause::Hazard));
            }
            (Mode::Armed, Some(cause)) => state.enter(Mode::Disarmed, tick, Some(cause)),
            (Mode::Flying, Some(cause)) => {
                let mode = match self.config.failsafe {
                    FailsafePolicy::Cut => Mode::Locked,
                    FailsafePolicy::Descend { .. } => Mode::Failsafe,
                };
                state.enter(mode, tick, Some(cause));
            }
            (Mode::Failsafe, _) if self.descended(state, tick) => {
                state.enter(Mode::Locked, tick, state.cause);
            }
            _ => {}
        }
        state.mode
    }

    /// Accepts or refuses a command.
    ///
    /// # Errors
    /// Returns the reason for a refusal; the mode is then unchanged.
    pub fn command(
        &self,
        state: &mut SupervisorState,
        tick: u64,
        command: Command,
    ) -> Result<Mode, Refusal> {
        use {Command as C, Mode as M};
        let next = match (state.mode, command) {
            (_, C::Kill) => Ok(M::Locked),
            (M::Locked, C::Disarm) if state.fault => Err(Refusal::Fault),
            (M::Locked, C::Disarm) if state.kill => Err(Refusal::Killed),
            (_, C::Disarm) => Ok(M::Disarmed),
            (M::Locked, _) => Err(Refusal::Locked),
            (M::Disarmed, C::Arm) | (M::Armed, C::Start) => {
                self.ready(state).map(|()| match command {
                    C::Start => M::Flying,
                    _ => M::Armed,
                })
            }
            (M::Disarmed, C::Start) => Err(Refusal::NotArmed),
            (M::Failsafe, C::Start) => self.fresh(state).map(|()| M::Flying),
            (M::Failsafe, C::Arm | C::Stop) => Err(Refusal::InFailsafe),
            (M::Armed | M::Flying, C::Stop) => Ok(M::Armed),
            (mode, C::Arm | C::Start | C::Stop) => Ok(mode),
        }?;
        let cause = (command == C::Kill).then_some(Cause::Killed);
        state.enter(next, tick, cause);
        Ok(next)
    }

    /// The wrench that may reach the rotors in the current mode, where the controller's is
    /// `wrench`; always finite.
    #[must_use]
    pub fn gate(&self, state: &SupervisorState, wrench: Wrench) -> Wrench {
        match (state.mode, self.config.failsafe) {
            (Mode::Flying, _) if wrench.thrust.is_finite() && wrench.torque_body.is_finite() => {
                wrench
            }
            (Mode::Failsafe, FailsafePolicy::Descend { thrust, .. }) => Wrench { thrust, ..SAFE },
            _ => SAFE,
        }
    }

    /// The count that has reached its limit, if any.
    fn trigger(&self, state: &SupervisorState) -> Option<Cause> {
        let Self { config, .. } = self;
        if state.missed >= config.missed_samples_max {
            Some(Cause::SamplesMissed)
        } else if state.faulted >= config.faulted_steps_max {
            Some(Cause::StepsFaulted)
        } else if state.overruns >= config.overruns_max {
            Some(Cause::Overruns)
        } else {
            None
        }
    }

    fn descended(&self, state: &SupervisorState, tick: u64) -> bool {
        match self.config.failsafe {
            FailsafePolicy::Cut => true,
            FailsafePolicy::Descend { ticks, .. } => {
                tick.saturating_sub(state.since) >= u64::from(ticks)
            }
        }
    }

    /// Refuses while a fault is present or the state is stale.
    fn fresh(&self, state: &SupervisorState) -> Result<(), Refusal> {
        if state.fault {
            Err(Refusal::Fault)
        } else if state.fresh < self.config.fresh_samples {
            Err(Refusal::StateStale)
        } else {
            Ok(())
        }
    }

    /// Readiness: `Ok` if an Arm would be accepted now.
    ///
    /// # Errors
    /// The reason why not.
    pub fn readiness(&self, state: &SupervisorState) -> Result<(), Refusal> {
        if state.mode == Mode::Locked {
            return Err(match state {
                SupervisorState { fault: true, .. } => Refusal::Fault,
                SupervisorState { kill: true, .. } => Refusal::Killed,
                _ => Refusal::Locked,
            });
        }
        self.ready(state)
    }

    /// Refuses a start from the ground: as [`fresh`](Self::fresh), with hazards, or tilted.
    fn ready(&self, state: &SupervisorState) -> Result<(), Refusal> {
        self.fresh(state)?;
        if !state.hazards.is_empty() {
            return Err(Refusal::Hazard(state.hazards));
        }
        if state.level { Ok(()) } else { Err(Refusal::Tilted) }
    }
}

/// Cosine of the angle between body z and world z; NaN for a quaternion without a direction.
fn cos_tilt(attitude: Quat) -> f32 {
    let (x, y) = (attitude.x, attitude.y);
    1.0 - 2.0 * (x * x + y * y) / attitude.length_squared()
}

#[cfg(test)]
mod tests;
