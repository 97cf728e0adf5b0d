//! Content of a record in flash: the parameters, and behind them the key of MAVLink's signatures, if there is one.
//!
//! A chip without a clock has to know a time that no message before its start has reached: a timestamp that is
//! ahead of all of them is stored with the key, before it is reached.

use core::fmt;

use embedded_storage::nor_flash::NorFlash;
use serde::{Deserialize, Serialize};

use crate::parameter_store::{Found, PAYLOAD_MAX, ParameterStore, Payload};
use crate::stored_parameters::StoredParameters;

/// Time by which what is stored is ahead of the newest message (10 us): an hour.
pub const AHEAD: u64 = 3600 * 100_000;

/// Key of MAVLink's signatures, and the timestamp (10 us since 2015-01-01) that a start goes on from.
#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredSigning {
    /// The key.
    pub key: [u8; 32],
    /// No message before the next start has reached it.
    pub timestamp: u64,
}

impl fmt::Debug for StoredSigning {
    /// Never shows the key.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("StoredSigning")
            .field("timestamp", &self.timestamp)
            .finish_non_exhaustive()
    }
}

impl StoredSigning {
    /// Signatures from `timestamp` on, stored ahead of it.
    #[must_use]
    pub fn ahead(key: [u8; 32], timestamp: u64) -> Self {
        Self { key, timestamp: timestamp.saturating_add(AHEAD) }
    }
}

/// A change of what is stored; the other part stays.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to put one on")]
pub enum Change {
    /// Other parameters.
    Parameters(StoredParameters),
    /// Another key, another time, or none.
    Signing(Option<StoredSigning>),
}

impl Change {
    /// The record that comes after `before`, the newest one; parameters that this firmware cannot read are forgotten.
    #[inline(never)]
    #[must_use]
    pub fn apply(&self, before: Option<&[u8]>) -> Payload {
        let (stored, signing) = parts(before.unwrap_or_default());
        match self {
            Self::Parameters(parameters) => encode(parameters, signing.as_ref()),
            Self::Signing(signing) => {
                encode(&stored.unwrap_or(StoredParameters::Forgotten), signing.as_ref())
            }
        }
    }
}

/// Signatures after a start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StartedSigning {
    /// Key, and the time that the clock goes on from.
    pub from: StoredSigning,
    /// Time that is stored now: ahead of it, unless the memory has failed.
    pub stored: u64,
}

impl StartedSigning {
    /// The signatures of the record that was found, once a time ahead of theirs is stored in its place: before the first
    /// message, so that a start that is cut short repeats none.
    #[inline(never)]
    pub fn begin<F: NorFlash>(store: &mut ParameterStore<F>, found: &mut Found) -> Option<Self> {
        let Found::Record(generation, record) = found else { return None };
        let from = parts(record).1?;
        let ahead = StoredSigning::ahead(from.key, from.timestamp);
        let renewed = Change::Signing(Some(ahead)).apply(Some(record));
        let stored = match store.append(&renewed) {
            Ok(newer) => {
                *generation = newer;
                ahead.timestamp
            }
            Err(_) => from.timestamp,
        };
        Some(Self { from, stored })
    }
}

/// The parameters of a record, and the signatures.
pub(crate) fn parts(record: &[u8]) -> (Option<StoredParameters>, Option<StoredSigning>) {
    let Ok((parameters, rest)) = postcard::take_from_bytes(record) else { return (None, None) };
    match postcard::take_from_bytes(rest) {
        _ if rest.is_empty() => (Some(parameters), None),
        Ok((signing, [])) => (Some(parameters), Some(signing)),
        _ => (None, None),
    }
}

/// Every record fits.
fn encode(parameters: &StoredParameters, signing: Option<&StoredSigning>) -> Payload {
    let mut payload = parameters.encode();
    let used = payload.len();
    if let Some(signing) = signing {
        // As long as it may be, then as long as it is.
        let _ = payload.resize(PAYLOAD_MAX, 0);
        let rest = payload.get_mut(used..).unwrap_or_default();
        let more = postcard::to_slice(signing, rest).map_or(0, |used| used.len());
        payload.truncate(used + more);
    }
    payload
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::BUILT_IN_MISSION;

    const SIGNING: StoredSigning = StoredSigning { key: [7; 32], timestamp: u64::MAX };

    #[test]
    fn each_part_survives_a_change_of_the_other() {
        let set = StoredParameters::of(&BUILT_IN_MISSION.tuning);
        let keyed = Change::Signing(Some(SIGNING)).apply(None);
        assert_eq!(parts(&keyed), (Some(StoredParameters::Forgotten), Some(SIGNING)));
        let both = Change::Parameters(set).apply(Some(&keyed));
        assert_eq!(parts(&both), (Some(set), Some(SIGNING)));
        assert!(both.len() < PAYLOAD_MAX);
        let plain = Change::Signing(None).apply(Some(&both));
        assert_eq!(parts(&plain), (Some(set), None));
        assert_eq!(plain, set.encode(), "as without a key");
        let forgotten = Change::Parameters(StoredParameters::Forgotten).apply(Some(&both));
        assert_eq!(parts(&forgotten).1, Some(SIGNING));
    }

    #[test]
    fn a_damaged_record_has_neither_part() {
        let whole = Change::Signing(Some(SIGNING)).apply(None);
        let mut long = whole.clone();
        long.push(0).unwrap();
        for record in [&whole[..whole.len() - 1], &long, &[]] {
            assert_eq!(parts(record), (None, None));
        }
    }

    #[test]
    fn a_key_is_not_shown() {
        let signing = StoredSigning { key: [250; 32], timestamp: 11 };
        let shown = std::format!("{:?}", Change::Signing(Some(signing)));
        assert!(!shown.contains("250") && shown.contains("timestamp: 11"), "{shown}");
    }
}
