//! Stored parameters, and the choice of those in force after a start.

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use ctrl_core::config::{RobustAdaptiveConfig, SaturatedConfig};
use ctrl_core::controller::{AdaptiveController, TrackingController};
use ctrl_core::error::ConfigError;
use ctrl_core::trajectory::TrajectoryConfig;
use link::{ControllerKind, ParameterOrigin, Parameters, ParametersInForce};
use serde::{Deserialize, Serialize};

use crate::parameter_store::{Found, PAYLOAD_MAX, Payload};
use crate::scenario::Tuning;
use crate::stored_signing::split;

const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);
const ROBUST_ADAPTIVE: usize = RobustAdaptiveConfig::NAMES.len();
const SATURATED: usize = SaturatedConfig::NAMES.len();

/// The content of a record, in postcard: everything that a host can change by name.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to put one on")]
pub enum StoredParameters {
    /// The built-in parameters are to be in force.
    Forgotten,
    /// These are.
    Set(StoredSet),
}

/// Parameters in the order of the tables in `link`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredSet {
    /// Checksum of all names, in order: other firmware may have other parameters.
    layout: u32,
    kind: ControllerKind,
    #[serde(with = "serde_big_array::BigArray")]
    robust_adaptive: [f32; ROBUST_ADAPTIVE],
    #[serde(with = "serde_big_array::BigArray")]
    saturated: [f32; SATURATED],
}

/// Reason to refuse a stored set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SetError {
    /// It was written by firmware with other parameters, or is none.
    Foreign,
    /// A controller refuses it, or the built-in trajectory.
    Invalid(ConfigError),
}

impl fmt::Display for SetError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Foreign => out.write_str("a set of other parameters than this firmware's"),
            Self::Invalid(error) => error.fmt(out),
        }
    }
}

impl core::error::Error for SetError {}

impl From<ConfigError> for SetError {
    fn from(error: ConfigError) -> Self {
        Self::Invalid(error)
    }
}

impl StoredParameters {
    /// The set of `tuning`.
    #[inline(never)]
    #[must_use]
    pub fn of(tuning: &Tuning) -> Self {
        let (mut robust_adaptive, mut saturated) = ([0.0; ROBUST_ADAPTIVE], [0.0; SATURATED]);
        tuning.robust_adaptive.read_all(&mut robust_adaptive);
        tuning.saturated.read_all(&mut saturated);
        Self::Set(StoredSet { layout: layout(), kind: tuning.kind, robust_adaptive, saturated })
    }

    /// Appends the content of its record; none if it has no room.
    #[must_use]
    pub fn encode(&self, record: &mut Payload) -> Option<()> {
        let start = record.len();
        // As long as it may be, then as long as it is.
        record.resize(PAYLOAD_MAX, 0).ok()?;
        let used = postcard::to_slice(self, record.get_mut(start..)?).ok()?.len();
        record.truncate(start + used);
        Some(())
    }
}

impl StoredSet {
    /// `built_in` with these parameters; what is not among them, such as the step period, stays.
    fn tuning(&self, built_in: &Tuning) -> Result<Tuning, SetError> {
        if self.layout != layout() {
            return Err(SetError::Foreign);
        }
        Ok(Tuning {
            kind: self.kind,
            robust_adaptive: built_in.robust_adaptive.with_all(&self.robust_adaptive),
            saturated: built_in.saturated.with_all(&self.saturated),
        })
    }
}

/// Puts what was found in memory in force in place of the built-in parameters in `tuning`, if both
/// controllers accept it and the one that flies accepts the trajectory.
///
/// # Errors
/// The refusal of what was found; `tuning` is then unchanged. The origin states it in either case.
pub fn put_in_force(
    tuning: &mut Tuning,
    trajectory: &TrajectoryConfig,
    found: &Found,
) -> (ParametersInForce, Result<(), SetError>) {
    let in_force = |origin, generation| ParametersInForce { origin, generation, changed: false };
    let (generation, payload) = match found {
        Found::Nothing => return (in_force(ParameterOrigin::BuiltIn, 0), Ok(())),
        Found::Unreadable => return (in_force(ParameterOrigin::Unreadable, 0), Ok(())),
        Found::Record(generation, record) => (*generation, split(record)),
    };
    let accepted = match payload {
        Some((_, parameters)) => accept(tuning, trajectory, parameters),
        None => Err(SetError::Foreign),
    };
    let (origin, result) = match accepted {
        Ok(origin) => (origin, Ok(())),
        Err(error) => (ParameterOrigin::Refused, Err(error)),
    };
    (in_force(origin, generation), result)
}

/// Replaces the tuning by that of a record, unless that says that it was forgotten.
fn accept(
    tuning: &mut Tuning,
    trajectory: &TrajectoryConfig,
    payload: &[u8],
) -> Result<ParameterOrigin, SetError> {
    let stored = match postcard::take_from_bytes(payload) {
        _ if payload.is_empty() => return Ok(ParameterOrigin::BuiltIn),
        Ok((StoredParameters::Set(set), [])) => set.tuning(tuning)?,
        Ok((StoredParameters::Forgotten, [])) => return Ok(ParameterOrigin::BuiltIn),
        _ => return Err(SetError::Foreign),
    };
    let other = match stored.kind {
        ControllerKind::RobustAdaptive => ControllerKind::Saturated,
        ControllerKind::Saturated => ControllerKind::RobustAdaptive,
    };
    stored.controller_of(other)?;
    let law = stored.controller()?;
    let trajectory = trajectory.check(law.step_period())?;
    law.accept_limits(trajectory.acceleration_bound(), trajectory.step_period())?;
    *tuning = stored;
    Ok(ParameterOrigin::Stored)
}

/// Checksum of the names of all parameters.
fn layout() -> u32 {
    let mut digest = CRC.digest();
    let robust_adaptive = RobustAdaptiveConfig::NAMES.iter().copied();
    for name in robust_adaptive.chain(SaturatedConfig::NAMES.iter().copied()) {
        digest.update(name.as_bytes());
        digest.update(&[0]);
    }
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::BUILT_IN_MISSION;
    use crate::stored_signing::Change;

    const BUILT_IN: &Tuning = &BUILT_IN_MISSION.tuning;

    fn put_in_force(
        tuning: &mut Tuning,
        found: &Found,
    ) -> (ParametersInForce, Result<(), SetError>) {
        super::put_in_force(tuning, &BUILT_IN_MISSION.trajectory, found)
    }

    fn changed() -> Tuning {
        let kind = match BUILT_IN.kind {
            ControllerKind::RobustAdaptive => ControllerKind::Saturated,
            ControllerKind::Saturated => ControllerKind::RobustAdaptive,
        };
        let robust_adaptive = BUILT_IN.robust_adaptive.with_parameter("k4.x", 0.75).unwrap();
        let saturated = BUILT_IN.saturated.with_parameter("cascade.k1", 0.4375).unwrap();
        Tuning { kind, robust_adaptive, saturated }
    }

    fn found(tuning: &Tuning) -> Found {
        record(7, &encoded(&StoredParameters::of(tuning)))
    }

    /// A record of parameters alone.
    fn record(generation: u32, parameters: &[u8]) -> Found {
        let mut record = Payload::new();
        Change::Signing(None).apply(&mut record).unwrap();
        record.extend_from_slice(parameters).unwrap();
        Found::Record(generation, record)
    }

    fn encoded(parameters: &StoredParameters) -> Payload {
        let mut record = Payload::new();
        parameters.encode(&mut record).unwrap();
        record
    }

    #[test]
    fn what_is_kept_is_in_force_after_a_restart() {
        let (mut in_use, tuning) = (*BUILT_IN, changed());
        let (in_force, result) = put_in_force(&mut in_use, &found(&tuning));
        assert_eq!((result, in_use), (Ok(()), tuning));
        let expected =
            ParametersInForce { origin: ParameterOrigin::Stored, generation: 7, changed: false };
        assert_eq!(in_force, expected);
    }

    #[test]
    fn the_step_period_is_the_images_own() {
        let built_in = BUILT_IN.saturated.step_period;
        let (mut in_use, mut slow) = (*BUILT_IN, *BUILT_IN);
        slow.saturated.step_period = 2.0 * built_in;
        put_in_force(&mut in_use, &found(&slow)).1.unwrap();
        assert_eq!(in_use.saturated.step_period, built_in);
    }

    /// The origin of what is in force, and the reason; asserts that it is the built-in.
    fn refused(found: &Found) -> (ParameterOrigin, Result<(), SetError>) {
        let mut in_use = *BUILT_IN;
        let (in_force, result) = put_in_force(&mut in_use, found);
        assert_eq!(in_use, *BUILT_IN);
        (in_force.origin, result)
    }

    #[test]
    fn without_a_set_the_built_in_one_is_in_force() {
        assert_eq!(refused(&Found::Nothing), (ParameterOrigin::BuiltIn, Ok(())));
        assert_eq!(refused(&Found::Unreadable), (ParameterOrigin::Unreadable, Ok(())));
        let forgotten = record(1, &encoded(&StoredParameters::Forgotten));
        assert_eq!(refused(&forgotten), (ParameterOrigin::BuiltIn, Ok(())));
    }

    #[test]
    fn a_set_of_other_firmware_is_refused() {
        let StoredParameters::Set(mut set) = StoredParameters::of(BUILT_IN) else { panic!() };
        set.layout ^= 1;
        let foreign = record(1, &encoded(&StoredParameters::Set(set)));
        let mut long = encoded(&StoredParameters::of(BUILT_IN));
        long.push(0).unwrap();
        for found in [foreign, Found::Record(1, Payload::new()), record(1, &long)] {
            assert_eq!(refused(&found), (ParameterOrigin::Refused, Err(SetError::Foreign)));
        }
    }

    #[test]
    fn a_set_that_a_controller_refuses_is_refused_whichever_flies() {
        for (first, second) in [(-1.0, 4.0), (4.0, f32::NAN)] {
            let mut tuning = *BUILT_IN;
            (tuning.robust_adaptive.k4.x, tuning.saturated.k4.x) = (first, second);
            let (origin, result) = refused(&found(&tuning));
            assert_eq!(origin, ParameterOrigin::Refused);
            let Err(SetError::Invalid(error)) = result else { panic!("{result:?}") };
            assert_eq!(error.parameter, "k4[0]");
        }
    }

    #[test]
    fn a_set_that_forbids_the_built_in_trajectory_is_refused() {
        let mut tuning = *BUILT_IN;
        tuning.saturated.reference_acceleration_max = 1e-3;
        let (origin, result) = refused(&found(&tuning));
        assert!(origin == ParameterOrigin::Refused && result.is_err(), "{result:?}");
    }

    #[test]
    fn every_set_fits_a_record() {
        let mut tuning = *BUILT_IN;
        tuning.saturated = tuning.saturated.with_all(&[f32::MAX; SATURATED]);
        let bytes = encoded(&StoredParameters::of(&tuning));
        assert!(bytes.len() > 4 * (ROBUST_ADAPTIVE + SATURATED) && bytes.len() < PAYLOAD_MAX);
    }
}
