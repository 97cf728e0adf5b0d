//! Limits of the watch for hazards.

use core::f32::consts::PI;

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use super::Reaction;
use crate::error::{Bound, ConfigError, require};

/// Hazards to watch for; what is absent is not watched.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct SafetyConfig {
    /// Messages of the station.
    pub link: Option<Silence>,
    /// Frames of the remote control.
    pub rc: Option<Silence>,
    /// Voltage of the battery.
    pub battery: Option<BatteryGuard>,
    /// Distance from the place of the start.
    pub geofence: Option<Geofence>,
    /// Tilt and rate.
    pub attitude: Option<AttitudeGuard>,
    /// Rotors short of the command.
    pub saturation: Option<SaturationGuard>,
    /// Rest where no vehicle can hover.
    pub crash: Option<CrashGuard>,
}

/// A line that must not fall silent.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Silence {
    /// Longest silence (s).
    pub timeout: f32,
    /// What follows.
    pub reaction: Reaction,
}

/// Two levels of the voltage.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct BatteryGuard {
    /// First level (V).
    pub low: f32,
    /// Second level (V), below the first.
    pub critical: f32,
    /// Time below a level that counts (s): voltage sags while the rotors accelerate.
    pub time: f32,
    /// What follows the first level.
    pub low_reaction: Reaction,
    /// What follows the second level.
    pub critical_reaction: Reaction,
}

/// An upright cylinder about the place of the start.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Geofence {
    /// Largest horizontal distance (m).
    pub radius: f32,
    /// Largest height above the start (m).
    pub height: f32,
    /// What follows outside.
    pub reaction: Reaction,
}

/// Limits of tilt and rate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct AttitudeGuard {
    /// Largest angle between body z and the vertical (rad).
    pub tilt: f32,
    /// Largest body rate (rad/s).
    pub rate: f32,
    /// Time beyond either that counts (s).
    pub time: f32,
    /// What follows.
    pub reaction: Reaction,
}

/// Patience with rotors at their limits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct SaturationGuard {
    /// Time without a break that counts (s).
    pub time: f32,
    /// What follows.
    pub reaction: Reaction,
}

/// Signs of a crash; the rotors are cut.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct CrashGuard {
    /// Angle between body z and the vertical beyond which a vehicle in the air cannot stay at rest (rad).
    pub tilt: f32,
    /// Speed below which it is at rest (m/s).
    pub speed: f32,
    /// Time of both together that counts (s).
    pub time: f32,
}

impl SafetyConfig {
    pub(super) fn check(&self, step_period: f32) -> Result<(), ConfigError> {
        let time = |name, time| {
            require(name, time, Bound::Inside(step_period, 3600.0), "at least a step period, s")
        };
        if let Some(Silence { timeout, .. }) = self.link {
            time("safety.link.timeout", timeout)?;
        }
        if let Some(Silence { timeout, .. }) = self.rc {
            time("safety.rc.timeout", timeout)?;
        }
        if let Some(guard) = self.battery {
            require("safety.battery.low", guard.low, Bound::Inside(1.0, 1000.0), "voltage, V")?;
            let below = Bound::Inside(0.0, guard.low);
            require(
                "safety.battery.critical",
                guard.critical,
                below,
                "at most the first level, V",
            )?;
            time("safety.battery.time", guard.time)?;
        }
        if let Some(fence) = self.geofence {
            let far = Bound::Inside(1.0, 1e5);
            require("safety.geofence.radius", fence.radius, far, "distance from the start, m")?;
            require("safety.geofence.height", fence.height, far, "height above the start, m")?;
        }
        if let Some(guard) = self.attitude {
            require("safety.attitude.tilt", guard.tilt, Bound::Inside(0.1, PI), "angle, rad")?;
            require("safety.attitude.rate", guard.rate, Bound::Inside(0.1, 1e3), "rate, rad/s")?;
            time("safety.attitude.time", guard.time)?;
        }
        if let Some(guard) = self.saturation {
            time("safety.saturation.time", guard.time)?;
        }
        if let Some(guard) = self.crash {
            require("safety.crash.tilt", guard.tilt, Bound::Inside(0.3, PI), "angle, rad")?;
            require("safety.crash.speed", guard.speed, Bound::Inside(0.01, 10.0), "speed, m/s")?;
            time("safety.crash.time", guard.time)?;
        }
        Ok(())
    }
}
