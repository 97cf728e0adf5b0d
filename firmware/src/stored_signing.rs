//! Content of a record in flash: the key of MAVLink's signatures, if there is one, and the parameters.
//!
//! A chip without a clock has to know a time that no message before its start has reached: a timestamp that is
//! ahead of all of them is stored with the key, before it is reached.

use core::fmt;

use embedded_storage::nor_flash::NorFlash;

use crate::parameter_store::{Found, ParameterStore, Payload, StoreError};

/// Time by which what is stored is ahead of the newest message (10 us): an hour.
pub const AHEAD: u64 = 3600 * 100_000;

/// Key of MAVLink's signatures, and the timestamp (10 us since 2015-01-01) that a start goes on from.
#[derive(Clone, Copy, PartialEq, Eq)]
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
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to put one on")]
pub enum Change {
    /// Other parameters, as [`StoredParameters::encode`](crate::stored_parameters::StoredParameters::encode) writes them.
    Parameters(Payload),
    /// Another key, another time, or none.
    Signing(Option<StoredSigning>),
}

impl Change {
    /// Keeps the record that comes after the newest one.
    ///
    /// # Errors
    /// As [`ParameterStore::append`]; the record before is then still in force.
    #[inline(never)]
    pub fn store<F: NorFlash>(&self, store: &mut ParameterStore<F>) -> Result<u32, StoreError> {
        let before = store.newest();
        let record = self.apply(before.as_deref()).ok_or(StoreError::Failed)?;
        store.append(&record)
    }

    /// The record that comes after `before`.
    pub(crate) fn apply(&self, before: Option<&[u8]>) -> Option<Payload> {
        let (signing, parameters) = before.and_then(split).unwrap_or_default();
        match self {
            Self::Parameters(parameters) => join(signing.as_ref(), parameters),
            Self::Signing(signing) => join(signing.as_ref(), parameters),
        }
    }
}

/// Bytes of a key and a time, and what a record with them begins with.
const SIGNING: usize = 40;
const WITH: u8 = 1;
const WITHOUT: u8 = 0;

/// The signatures of a record, and the bytes of its parameters; none of a record that this firmware cannot read.
pub(crate) fn split(record: &[u8]) -> Option<(Option<StoredSigning>, &[u8])> {
    match record {
        [WITHOUT, parameters @ ..] => Some((None, parameters)),
        [WITH, rest @ ..] if rest.len() >= SIGNING => {
            let (mut key, mut timestamp) = ([0; 32], [0; 8]);
            let stored = key.iter_mut().chain(&mut timestamp);
            stored.zip(rest).for_each(|(place, byte)| *place = *byte);
            let timestamp = u64::from_le_bytes(timestamp);
            let parameters = rest.get(SIGNING..).unwrap_or_default();
            Some((Some(StoredSigning { key, timestamp }), parameters))
        }
        _ => None,
    }
}

/// The record of both parts; one without parameters leaves the built-in ones in force.
fn join(signing: Option<&StoredSigning>, parameters: &[u8]) -> Option<Payload> {
    let mut record = Payload::new();
    match signing {
        None => record.push(WITHOUT).ok()?,
        Some(StoredSigning { key, timestamp }) => {
            record.push(WITH).ok()?;
            record.extend_from_slice(key).ok()?;
            record.extend_from_slice(&timestamp.to_le_bytes()).ok()?;
        }
    }
    record.extend_from_slice(parameters).ok()?;
    Some(record)
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
        let from = split(record)?.0?;
        let ahead = StoredSigning::ahead(from.key, from.timestamp);
        let stored = match Change::Signing(Some(ahead)).store(store) {
            Ok(newer) => {
                *generation = newer;
                ahead.timestamp
            }
            Err(_) => from.timestamp,
        };
        Some(Self { from, stored })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter_store::PAYLOAD_MAX;
    use crate::scenario::BUILT_IN_MISSION;
    use crate::stored_parameters::StoredParameters;

    const KEYED: StoredSigning = StoredSigning { key: [7; 32], timestamp: u64::MAX };

    #[test]
    fn each_part_survives_a_change_of_the_other() {
        let set = StoredParameters::of(&BUILT_IN_MISSION.tuning).encode();
        let keyed = Change::Signing(Some(KEYED)).apply(None).unwrap();
        assert_eq!(split(&keyed), Some((Some(KEYED), &[][..])));
        let both = Change::Parameters(set.clone()).apply(Some(&keyed)).unwrap();
        assert_eq!(split(&both), Some((Some(KEYED), &set[..])));
        assert!(both.len() < PAYLOAD_MAX);
        let plain = Change::Signing(None).apply(Some(&both)).unwrap();
        assert_eq!(split(&plain), Some((None, &set[..])));
        let forgotten = Change::Parameters(StoredParameters::Forgotten.encode());
        let forgotten = forgotten.apply(Some(&both)).unwrap();
        assert_eq!(split(&forgotten).unwrap().0, Some(KEYED));
    }

    #[test]
    fn a_record_that_is_cut_short_has_neither_part() {
        let whole = Change::Signing(Some(KEYED)).apply(None).unwrap();
        for record in [&whole[..whole.len() - 1], &[9, 9, 9], &[]] {
            assert_eq!(split(record), None);
        }
    }

    #[test]
    fn a_key_is_not_shown() {
        let signing = StoredSigning { key: [250; 32], timestamp: 11 };
        let shown = std::format!("{:?}", Change::Signing(Some(signing)));
        assert!(!shown.contains("250") && shown.contains("timestamp: 11"), "{shown}");
    }
}
