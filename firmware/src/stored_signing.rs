//! Content of a record in flash: the key of MAVLink's signatures, if there is one, and the parameters.
//!
//! A chip without a clock has to know a time that no message before its start has reached: a timestamp that is
//! ahead of all of them is stored with the key, before it is reached.

use core::fmt;

use embedded_storage::nor_flash::NorFlash;

use crate::parameter_store::{Found, ParameterStore, Payload, StoreError};
use crate::stored_parameters::StoredParameters;

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
    /// Other parameters.
    Parameters(StoredParameters),
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
        let mut record = Payload::new();
        if !store.newest(&mut record) {
            record.clear();
        }
        self.apply(&mut record).ok_or(StoreError::Failed)?;
        store.append(&record)
    }

    /// Makes the record before, empty if there is none, the one that comes after it; none if that has no room.
    pub(crate) fn apply(&self, record: &mut Payload) -> Option<()> {
        let start = match split(record) {
            Some((_, parameters)) => record.len() - parameters.len(),
            None => {
                record.clear();
                record.push(WITHOUT).ok()?;
                1
            }
        };
        match self {
            Self::Parameters(parameters) => {
                record.truncate(start);
                parameters.encode(record)
            }
            Self::Signing(None) => {
                record.copy_within(start.., 1);
                *record.first_mut()? = WITHOUT;
                record.truncate(1 + record.len() - start);
                Some(())
            }
            Self::Signing(Some(StoredSigning { key, timestamp })) => {
                let (behind, length) = (1 + SIGNING, record.len());
                record.resize(length.max(behind) + behind - start, 0).ok()?;
                record.copy_within(start..length, behind);
                record.truncate(behind + length - start);
                let stored = key.iter().copied().chain(timestamp.to_le_bytes());
                let bytes = [WITH].into_iter().chain(stored);
                record.iter_mut().zip(bytes).for_each(|(place, byte)| *place = byte);
                Some(())
            }
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

    const KEYED: StoredSigning = StoredSigning { key: [7; 32], timestamp: u64::MAX };

    /// The record that comes after `before`.
    fn applied(change: &Change, before: &[u8]) -> Payload {
        let mut record = Payload::from_slice(before).unwrap();
        change.apply(&mut record).unwrap();
        record
    }

    /// Parameters alone.
    fn encoded(parameters: &StoredParameters) -> Payload {
        let mut record = Payload::new();
        parameters.encode(&mut record).unwrap();
        record
    }

    #[test]
    fn each_part_survives_a_change_of_the_other() {
        let parameters = StoredParameters::of(&BUILT_IN_MISSION.tuning);
        let set = encoded(&parameters);
        let keyed = applied(&Change::Signing(Some(KEYED)), &[]);
        assert_eq!(split(&keyed), Some((Some(KEYED), &[][..])));
        let both = applied(&Change::Parameters(parameters), &keyed);
        assert_eq!(split(&both), Some((Some(KEYED), &set[..])));
        assert!(both.len() < PAYLOAD_MAX);
        let later = StoredSigning { timestamp: 3, ..KEYED };
        let renewed = applied(&Change::Signing(Some(later)), &both);
        assert_eq!(split(&renewed), Some((Some(later), &set[..])));
        let plain = applied(&Change::Signing(None), &both);
        assert_eq!(split(&plain), Some((None, &set[..])));
        assert_eq!(applied(&Change::Signing(None), &plain), plain);
        assert_eq!(applied(&Change::Signing(Some(KEYED)), &plain), both);
        let forgotten = applied(&Change::Parameters(StoredParameters::Forgotten), &both);
        let expected = encoded(&StoredParameters::Forgotten);
        assert_eq!(split(&forgotten), Some((Some(KEYED), &expected[..])));
    }

    #[test]
    fn what_cannot_be_read_is_replaced() {
        for before in [&[9, 9, 9][..], &[WITH, 1, 2], &[]] {
            assert_eq!(applied(&Change::Signing(None), before)[..], [WITHOUT]);
        }
    }

    #[test]
    fn a_record_that_is_cut_short_has_neither_part() {
        let whole = applied(&Change::Signing(Some(KEYED)), &[]);
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
