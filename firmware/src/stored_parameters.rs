//! Stored parameters, and the choice of those in force after a start.

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use ctrl_core::config::{RobustAdaptiveConfig, SaturatedConfig};
use ctrl_core::controller::{AdaptiveController, TrackingController};
use ctrl_core::error::ConfigError;
use link::{ControllerKind, ParameterOrigin, Parameters, ParametersInForce};
use serde::{Deserialize, Serialize};

use crate::parameter_store::{Found, PAYLOAD_MAX, Payload};
use crate::scenario::{BuiltInMission, Tuning};

const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);
const ROBUST_ADAPTIVE: usize = RobustAdaptiveConfig::TABLE.len();
const SATURATED: usize = SaturatedConfig::TABLE.len();

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
    robust_adaptive: [f32; ROBUST_ADAPTIVE],
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
    #[must_use]
    pub fn of(tuning: &Tuning) -> Self {
        let (mut robust_adaptive, mut saturated) = ([0.0; ROBUST_ADAPTIVE], [0.0; SATURATED]);
        tuning.robust_adaptive.read_all(&mut robust_adaptive);
        tuning.saturated.read_all(&mut saturated);
        Self::Set(StoredSet { layout: layout(), kind: tuning.kind, robust_adaptive, saturated })
    }

    /// The content of its record; every one fits.
    #[must_use]
    pub fn encode(&self) -> Payload {
        let mut bytes = [0; PAYLOAD_MAX];
        let used = postcard::to_slice(self, &mut bytes).map_or(0, |used| used.len());
        bytes.get(..used).and_then(|used| Payload::from_slice(used).ok()).unwrap_or_default()
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

/// Puts what was found in memory in force in place of the built-in parameters of `mission`, if both
/// controllers accept it and the one that flies accepts the trajectory.
///
/// # Errors
/// The refusal of what was found; `mission` is then unchanged. The origin states it in either case.
pub fn put_in_force(
    mission: &mut BuiltInMission,
    found: &Found,
) -> (ParametersInForce, Result<(), SetError>) {
    let in_force = |origin, generation| ParametersInForce { origin, generation, changed: false };
    let (generation, payload) = match found {
        Found::Nothing => return (in_force(ParameterOrigin::BuiltIn, 0), Ok(())),
        Found::Unreadable => return (in_force(ParameterOrigin::Unreadable, 0), Ok(())),
        Found::Record(generation, payload) => (*generation, payload),
    };
    match accepted(mission, payload) {
        Ok(None) => (in_force(ParameterOrigin::BuiltIn, generation), Ok(())),
        Ok(Some(tuning)) => {
            mission.tuning = tuning;
            (in_force(ParameterOrigin::Stored, generation), Ok(()))
        }
        Err(error) => (in_force(ParameterOrigin::Refused, generation), Err(error)),
    }
}

/// The tuning in a record, none if it was forgotten.
fn accepted(mission: &BuiltInMission, payload: &[u8]) -> Result<Option<Tuning>, SetError> {
    let set = match postcard::take_from_bytes(payload) {
        Ok((StoredParameters::Set(set), [])) => set,
        Ok((StoredParameters::Forgotten, [])) => return Ok(None),
        _ => return Err(SetError::Foreign),
    };
    let tuning = set.tuning(&mission.tuning)?;
    for kind in [ControllerKind::RobustAdaptive, ControllerKind::Saturated] {
        Tuning { kind, ..tuning }.controller()?;
    }
    let law = tuning.controller()?;
    let trajectory = mission.trajectory.check(law.step_period())?;
    law.accept_limits(trajectory.acceleration_bound(), trajectory.step_period())?;
    Ok(Some(tuning))
}

/// Checksum of the names of all parameters.
fn layout() -> u32 {
    let mut digest = CRC.digest();
    let robust_adaptive = RobustAdaptiveConfig::TABLE.iter().map(|parameter| parameter.name);
    for name in robust_adaptive.chain(SaturatedConfig::TABLE.iter().map(|parameter| parameter.name))
    {
        digest.update(name.as_bytes());
        digest.update(&[0]);
    }
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::built_in_mission;

    fn changed(built_in: &BuiltInMission) -> Tuning {
        let kind = match built_in.tuning.kind {
            ControllerKind::RobustAdaptive => ControllerKind::Saturated,
            ControllerKind::Saturated => ControllerKind::RobustAdaptive,
        };
        let robust_adaptive = built_in.tuning.robust_adaptive.with_parameter("k4", 0.75).unwrap();
        let saturated = built_in.tuning.saturated.with_parameter("cascade.k1", 0.4375).unwrap();
        Tuning { kind, robust_adaptive, saturated }
    }

    fn found(tuning: &Tuning) -> Found {
        Found::Record(7, StoredParameters::of(tuning).encode())
    }

    #[test]
    fn what_is_kept_is_in_force_after_a_restart() {
        let mut mission = built_in_mission().unwrap();
        let tuning = changed(&mission);
        let (in_force, result) = put_in_force(&mut mission, &found(&tuning));
        assert_eq!((result, mission.tuning), (Ok(()), tuning));
        let expected =
            ParametersInForce { origin: ParameterOrigin::Stored, generation: 7, changed: false };
        assert_eq!(in_force, expected);
    }

    #[test]
    fn the_step_period_is_the_images_own() {
        let mut mission = built_in_mission().unwrap();
        let built_in = mission.tuning.saturated.step_period;
        let mut slow = mission.tuning;
        slow.saturated.step_period = 2.0 * built_in;
        put_in_force(&mut mission, &found(&slow)).1.unwrap();
        assert_eq!(mission.tuning.saturated.step_period, built_in);
    }

    /// The origin of what is in force, and the reason; asserts that it is the built-in.
    fn refused(found: &Found) -> (ParameterOrigin, Result<(), SetError>) {
        let built_in = built_in_mission().unwrap();
        let mut mission = built_in.clone();
        let (in_force, result) = put_in_force(&mut mission, found);
        assert_eq!(mission, built_in);
        (in_force.origin, result)
    }

    #[test]
    fn without_a_set_the_built_in_one_is_in_force() {
        assert_eq!(refused(&Found::Nothing), (ParameterOrigin::BuiltIn, Ok(())));
        assert_eq!(refused(&Found::Unreadable), (ParameterOrigin::Unreadable, Ok(())));
        let forgotten = Found::Record(1, StoredParameters::Forgotten.encode());
        assert_eq!(refused(&forgotten), (ParameterOrigin::BuiltIn, Ok(())));
    }

    #[test]
    fn a_set_of_other_firmware_is_refused() {
        let StoredParameters::Set(mut set) =
            StoredParameters::of(&built_in_mission().unwrap().tuning)
        else {
            panic!()
        };
        set.layout ^= 1;
        let foreign = Found::Record(1, StoredParameters::Set(set).encode());
        let mut long = StoredParameters::of(&built_in_mission().unwrap().tuning).encode();
        long.push(0).unwrap();
        for found in [foreign, Found::Record(1, Payload::new()), Found::Record(1, long)] {
            assert_eq!(refused(&found), (ParameterOrigin::Refused, Err(SetError::Foreign)));
        }
    }

    #[test]
    fn a_set_that_a_controller_refuses_is_refused_whichever_flies() {
        for (first, second) in [(-1.0, 4.0), (4.0, f32::NAN)] {
            let mut tuning = built_in_mission().unwrap().tuning;
            (tuning.robust_adaptive.k4, tuning.saturated.k4) = (first, second);
            let (origin, result) = refused(&found(&tuning));
            assert_eq!(origin, ParameterOrigin::Refused);
            let Err(SetError::Invalid(error)) = result else { panic!("{result:?}") };
            assert_eq!(error.parameter, "k4");
        }
    }

    #[test]
    fn a_set_that_forbids_the_built_in_trajectory_is_refused() {
        let mut tuning = built_in_mission().unwrap().tuning;
        tuning.saturated.reference_acceleration_max = 1e-3;
        let (origin, result) = refused(&found(&tuning));
        assert!(origin == ParameterOrigin::Refused && result.is_err(), "{result:?}");
    }

    #[test]
    fn every_set_fits_a_record() {
        let mut tuning = built_in_mission().unwrap().tuning;
        tuning.saturated = tuning.saturated.with_all(&[f32::MAX; SATURATED]);
        let bytes = StoredParameters::of(&tuning).encode();
        assert!(bytes.len() > 4 * (ROBUST_ADAPTIVE + SATURATED) && bytes.len() < PAYLOAD_MAX);
    }
}
