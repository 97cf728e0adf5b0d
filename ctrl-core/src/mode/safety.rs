//! Hazards of a flight and the reactions to them: what ends a flight that nobody ends.
//!
//! | hazard | seen by | usual reaction |
//! |---|---|---|
//! | link lost | no message of a station for a time | return |
//! | remote control lost | no frame of the receiver for a time | return |
//! | battery low, critical | voltage below either level for a time; stays for the flight | return, land |
//! | geofence | distance or height from the place of the start | return |
//! | attitude | tilt or rate beyond its limit for a time | failsafe |
//! | saturation | the rotors short of the commanded wrench for a time | land |
//! | crash | tilted and at rest for a time with the rotors turning | stop |
//!
//! A lost estimate is the [`Supervisor`](super::Supervisor)'s: it has no state to judge by. [`Safety::step`] is
//! pure and total and is called once a control period; nothing is watched unless it is configured.

mod config;

pub use config::{
    AttitudeGuard, BatteryGuard, CrashGuard, Geofence, SafetyConfig, SaturationGuard, Silence,
};

use core::fmt;

use glam::Vec3;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use super::{Mode, cos_tilt};
use crate::error::ConfigError;
use crate::vehicle::VehicleState;

bitflags::bitflags! {
    /// Hazards that are present.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    #[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
    pub struct Hazards: u8 {
        /// No message of a station.
        const LINK_LOST = 1 << 0;
        /// No frame of the remote control.
        const RC_LOST = 1 << 1;
        /// Voltage below the first level.
        const BATTERY_LOW = 1 << 2;
        /// Voltage below the second level.
        const BATTERY_CRITICAL = 1 << 3;
        /// Outside the fence.
        const GEOFENCE = 1 << 4;
        /// Tilt or rate beyond its limit.
        const ATTITUDE = 1 << 5;
        /// The rotors are short of the command.
        const SATURATION = 1 << 6;
        /// At rest where no vehicle can hover.
        const CRASH = 1 << 7;
    }
}

/// Names of the hazards, in the order of their bits.
const NAMES: [&str; 8] = [
    "link lost",
    "remote control lost",
    "battery low",
    "battery critical",
    "outside the geofence",
    "tilt or rate beyond limits",
    "rotors saturated",
    "crashed",
];

impl Hazards {
    /// The hazards in words, one each.
    pub fn words(self) -> impl Iterator<Item = &'static str> {
        let present = (0..8).zip(NAMES).filter(move |(bit, _)| self.bits() & 1 << bit != 0);
        present.map(|(_, name)| name)
    }
}

impl fmt::Display for Hazards {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, name) in self.words().enumerate() {
            out.write_str(if index == 0 { "" } else { ", " })?;
            out.write_str(name)?;
        }
        Ok(())
    }
}

/// Action against a hazard, from the mildest to the strongest; of several, the strongest is taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Reaction {
    /// Tell the operator, and refuse to arm.
    #[default]
    Warn,
    /// Fly home and land.
    Return,
    /// Land.
    Land,
    /// The supervisor's failsafe: descend without a state, or cut, as it is configured.
    Failsafe,
    /// Stop the rotors.
    Stop,
}

/// Observations of one control period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observations {
    /// The latest good state, if it is not stale.
    pub vehicle: Option<VehicleState>,
    /// Time since the latest message of a station (s).
    pub link_silence: f32,
    /// Time since the latest frame of the remote control (s).
    pub rc_silence: f32,
    /// Voltage of the battery (V), if it is measured.
    pub voltage: Option<f32>,
    /// The rotors did not make the commanded wrench in the period before.
    pub saturated: bool,
}

/// Result of one control period.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SafetyReport {
    /// Hazards that are present.
    pub hazards: Hazards,
    /// Those that were not in the period before.
    pub raised: Hazards,
    /// The strongest reaction to what is present; none without a hazard.
    pub reaction: Option<Reaction>,
}

/// Memory of the watch: periods in a row of each condition, hazards present, place of the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SafetyState {
    low: u32,
    critical: u32,
    attitude: u32,
    saturated: u32,
    at_rest: u32,
    present: Hazards,
    home_world: Vec3,
}

/// The watch for hazards, validated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Safety {
    config: SafetyConfig,
    step_period: f32,
    /// Cosines of the tilts of attitude and crash.
    attitude_cos: f32,
    crash_cos: f32,
}

impl Safety {
    /// A watch that is called every `step_period` (s).
    ///
    /// # Errors
    /// Names a number that is out of its range.
    pub fn new(config: &SafetyConfig, step_period: f32) -> Result<Self, ConfigError> {
        config.check(step_period)?;
        let cosine = |tilt: Option<f32>| tilt.map_or(-1.0, libm::cosf);
        Ok(Self {
            config: *config,
            step_period,
            attitude_cos: cosine(config.attitude.map(|guard| guard.tilt)),
            crash_cos: cosine(config.crash.map(|guard| guard.tilt)),
        })
    }

    /// Judges one control period, `mode` being the supervisor's.
    pub fn step(&self, state: &mut SafetyState, mode: Mode, seen: &Observations) -> SafetyReport {
        let flying = matches!(mode, Mode::Flying | Mode::Failsafe);
        if !flying {
            state.on_ground(seen.vehicle.as_ref());
        }
        let mut present = self.lines(seen) | self.battery(state, seen.voltage, flying);
        if let (true, Some(vehicle)) = (flying, &seen.vehicle) {
            present |= self.motion(state, vehicle);
        }
        if flying {
            present |= self.saturation(state, seen.saturated);
        }
        let raised = present - state.present;
        state.present = present;
        SafetyReport { hazards: present, raised, reaction: self.reaction(present) }
    }

    fn lines(&self, seen: &Observations) -> Hazards {
        let silent = |guard: &Option<Silence>, silence: f32| {
            // What is not a number is silence.
            guard.is_some_and(|guard| silence.is_nan() || silence > guard.timeout)
        };
        let mut present = Hazards::empty();
        present.set(Hazards::LINK_LOST, silent(&self.config.link, seen.link_silence));
        present.set(Hazards::RC_LOST, silent(&self.config.rc, seen.rc_silence));
        present
    }

    /// A level that was passed in flight stays passed: the voltage recovers as soon as the rotors slow down.
    fn battery(&self, state: &mut SafetyState, voltage: Option<f32>, flying: bool) -> Hazards {
        let Some(guard) = &self.config.battery else { return Hazards::empty() };
        let levels = Hazards::BATTERY_LOW | Hazards::BATTERY_CRITICAL;
        let mut present = if flying { state.present & levels } else { Hazards::empty() };
        // Without a measurement nothing changes.
        if let Some(voltage) = voltage {
            let below = |level: f32| voltage.is_nan() || voltage < level;
            state.low = in_a_row(state.low, below(guard.low));
            state.critical = in_a_row(state.critical, below(guard.critical));
        }
        present.set(
            Hazards::BATTERY_LOW,
            present.contains(Hazards::BATTERY_LOW) || self.lasts(state.low, guard.time),
        );
        let critical = present.contains(Hazards::BATTERY_CRITICAL);
        present.set(Hazards::BATTERY_CRITICAL, critical || self.lasts(state.critical, guard.time));
        present
    }

    fn motion(&self, state: &mut SafetyState, vehicle: &VehicleState) -> Hazards {
        let mut present = Hazards::empty();
        let cos_tilt = cos_tilt(vehicle.attitude);
        if let Some(fence) = &self.config.geofence {
            let from = vehicle.position_world - state.home_world;
            let inside = from.truncate().length_squared() <= fence.radius * fence.radius
                && from.z <= fence.height;
            present.set(Hazards::GEOFENCE, !inside);
        }
        if let Some(guard) = &self.config.attitude {
            let rate = vehicle.rate_body.length_squared() > guard.rate * guard.rate;
            state.attitude = in_a_row(state.attitude, rate || cos_tilt < self.attitude_cos);
            present.set(Hazards::ATTITUDE, self.lasts(state.attitude, guard.time));
        }
        if let Some(guard) = &self.config.crash {
            let slow = vehicle.velocity_world.length_squared() < guard.speed * guard.speed;
            state.at_rest = in_a_row(state.at_rest, slow && cos_tilt < self.crash_cos);
            present.set(Hazards::CRASH, self.lasts(state.at_rest, guard.time));
        }
        present
    }

    fn saturation(&self, state: &mut SafetyState, saturated: bool) -> Hazards {
        let Some(guard) = &self.config.saturation else { return Hazards::empty() };
        state.saturated = in_a_row(state.saturated, saturated);
        let lasts = self.lasts(state.saturated, guard.time);
        if lasts { Hazards::SATURATION } else { Hazards::empty() }
    }

    fn lasts(&self, periods: u32, time: f32) -> bool {
        periods as f32 * self.step_period > time - 0.5 * self.step_period
    }

    /// The strongest of the reactions to what is present.
    fn reaction(&self, present: Hazards) -> Option<Reaction> {
        if present.is_empty() {
            return None;
        }
        let SafetyConfig { link, rc, battery, geofence, attitude, saturation, crash } =
            &self.config;
        let of = |hazard: Hazards, reaction: Option<Reaction>| {
            if present.contains(hazard) { reaction } else { None }
        };
        of(Hazards::LINK_LOST, link.map(|guard| guard.reaction))
            .max(of(Hazards::RC_LOST, rc.map(|guard| guard.reaction)))
            .max(of(Hazards::BATTERY_LOW, battery.map(|guard| guard.low_reaction)))
            .max(of(Hazards::BATTERY_CRITICAL, battery.map(|guard| guard.critical_reaction)))
            .max(of(Hazards::GEOFENCE, geofence.map(|guard| guard.reaction)))
            .max(of(Hazards::ATTITUDE, attitude.map(|guard| guard.reaction)))
            .max(of(Hazards::SATURATION, saturation.map(|guard| guard.reaction)))
            .max(of(Hazards::CRASH, crash.map(|_| Reaction::Stop)))
    }
}

impl SafetyState {
    /// The next flight starts here, with no past.
    fn on_ground(&mut self, vehicle: Option<&VehicleState>) {
        (self.attitude, self.saturated, self.at_rest) = (0, 0, 0);
        if let Some(vehicle) = vehicle.filter(|vehicle| vehicle.position_world.is_finite()) {
            self.home_world = vehicle.position_world;
        }
    }
}

fn in_a_row(count: u32, happened: bool) -> u32 {
    if happened { count.saturating_add(1) } else { 0 }
}

#[cfg(test)]
mod tests;
