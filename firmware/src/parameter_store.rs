//! Keeps one short record in flash, over restarts and a supply that fails at any moment.
//!
//! Two sectors hold a log. A slot of [`SLOT`] bytes is written once between two erasures:
//!
//! ```text
//! slot 0:   mark of a sector                                    written when it has been erased
//! slot 1..: mark of a record | generation u32 | length u16 | payload | CRC-32     little-endian
//! ```
//!
//! The record with the highest generation is in force. It is never touched: the next one goes to the
//! next slot, and a record that was cut off has no right checksum. When a sector is full the log goes
//! on in the other one. Only [`ParameterStore::open`] erases, and only the sector that does not
//! hold the newest record: erasing stalls a processor for most of a second, which harms nobody
//! before the control loop has begun. [`ParameterStore::append`] programs some 360 bytes.

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use embedded_storage::nor_flash::NorFlash;
use heapless::Vec;

/// Bytes of a slot.
pub const SLOT: usize = 512;
/// Sectors of the log, each of [`NorFlash::ERASE_SIZE`].
pub const SECTORS: usize = 2;
/// Mark, generation, length.
const HEADER: usize = 10;
const CHECKSUM: usize = 4;
/// Bytes that are read back at once.
const CHUNK: usize = 32;
/// Longest payload of a record (bytes).
pub const PAYLOAD_MAX: usize = SLOT - HEADER - CHECKSUM;

/// The last character is the version of the format.
const RECORD_MARK: [u8; 4] = *b"GYR3";
const SECTOR_MARK: [u8; 4] = *b"GYS2";
const ERASED: u8 = 0xFF;
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Content of a record.
pub type Payload = Vec<u8, PAYLOAD_MAX>;

/// Record found by [`ParameterStore::open`].
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to put one on")]
pub enum Found {
    /// Never written.
    Nothing,
    /// Written, but no whole record is left.
    Unreadable,
    /// The newest whole record and its generation.
    Record(u32, Payload),
}

/// Reason that a record was not stored; the one before is still in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreError {
    /// Both sectors are full; the next [`ParameterStore::open`] erases one.
    Full,
    /// The memory does not do what it should.
    Failed,
}

impl fmt::Display for StoreError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Full => "no free slot; a restart of the vehicle erases a sector",
            Self::Failed => "the memory cannot be written or read back",
        })
    }
}

impl core::error::Error for StoreError {}

/// See the module's documentation. The memory begins with the two sectors.
#[derive(Debug)]
pub struct ParameterStore<F> {
    flash: F,
    generation: u32,
    /// The sector that the log is in.
    active: usize,
    /// Slot of the newest record there.
    newest: Option<usize>,
    /// Next free slot of each sector; none if it cannot be written to.
    free: [Option<usize>; SECTORS],
}

/// Content of a sector.
#[derive(Clone, Copy, Debug, Default)]
struct Survey {
    /// Newest record: its generation and slot.
    newest: Option<(u32, usize)>,
    /// Behind the last slot that is not blank.
    end: usize,
    /// Erased to the end, and marked since.
    marked: bool,
}

impl<F: NorFlash> ParameterStore<F> {
    const SLOTS: usize = F::ERASE_SIZE / SLOT;

    /// Finds the newest record and makes room. May erase: up to a second on the F405.
    #[inline(never)]
    pub fn open(flash: F) -> (Self, Found) {
        const {
            assert!(F::ERASE_SIZE.is_multiple_of(SLOT) && F::ERASE_SIZE >= 2 * SLOT);
            assert!(SLOT.is_multiple_of(F::WRITE_SIZE) && SLOT.is_multiple_of(CHUNK));
            assert!(CHUNK.is_multiple_of(F::READ_SIZE));
        }
        let (newest, free) = (None, [None; SECTORS]);
        let mut store = Self { flash, generation: 0, active: 0, newest, free };
        let surveys: [_; SECTORS] = core::array::from_fn(|sector| store.survey(sector));
        let newest = (0..SECTORS).filter_map(|sector| {
            let (generation, slot) = (*surveys.get(sector)?)?.newest?;
            Some((generation, sector, slot))
        });
        let newest = newest.max();
        let found = match newest {
            Some((generation, sector, slot)) => store.take_up(generation, sector, slot),
            None if surveys.iter().flatten().all(|survey| survey.end <= 1) => Found::Nothing,
            None => Found::Unreadable,
        };
        let mut free = [None; SECTORS];
        for ((sector, survey), free) in surveys.into_iter().enumerate().zip(&mut free) {
            let holds_newest = newest.is_some_and(|(_, holder, _)| holder == sector);
            *free = store.make_room(sector, survey, holds_newest);
        }
        store.free = free;
        (store, found)
    }

    /// Keeps a record; returns its generation. Takes as long as programming a slot.
    ///
    /// # Errors
    /// The record before is then still in force.
    #[inline(never)]
    pub fn append(&mut self, payload: &[u8]) -> Result<u32, StoreError> {
        let generation = self.generation.checked_add(1).ok_or(StoreError::Failed)?;
        let mut record = Vec::new();
        encode(generation, payload, F::WRITE_SIZE, &mut record).ok_or(StoreError::Failed)?;
        let other = SECTORS - 1 - self.active;
        let room = |sector: usize| {
            let slot = (*self.free.get(sector)?).filter(|slot| *slot < Self::SLOTS);
            slot.map(|slot| (sector, slot))
        };
        let (sector, slot) = room(self.active).or_else(|| room(other)).ok_or_else(|| {
            if self.free == [None; SECTORS] { StoreError::Failed } else { StoreError::Full }
        })?;
        // A slot is used up even if that fails: what is left in it is not known.
        *self.free.get_mut(sector).ok_or(StoreError::Failed)? = Some(slot + 1);
        let place = Self::offset(sector, slot);
        self.flash.write(place, &record).map_err(|_| StoreError::Failed)?;
        if !self.holds(place, &record) {
            return Err(StoreError::Failed);
        }
        (self.generation, self.active, self.newest) = (generation, sector, Some(slot));
        Ok(generation)
    }

    /// The newest record, read again; none if there is none.
    #[inline(never)]
    pub fn newest(&mut self) -> Option<Payload> {
        let slot = self.slot(self.active, self.newest?)?;
        Some(decode(&slot)?.1)
    }

    /// `true` if the memory at `place` reads as `record` and is blank behind it, to the end of the slot.
    fn holds(&mut self, place: u32, record: &[u8]) -> bool {
        let blank = [ERASED; CHUNK];
        (0..SLOT).step_by(CHUNK).all(|offset| {
            let mut read = [0; CHUNK];
            let expected = record.iter().skip(offset).chain(blank.iter());
            self.flash.read(place + offset as u32, &mut read).is_ok()
                && read.iter().zip(expected).all(|(read, expected)| read == expected)
        })
    }

    /// Goes on with the log behind its newest record.
    fn take_up(&mut self, generation: u32, sector: usize, slot: usize) -> Found {
        (self.generation, self.active, self.newest) = (generation, sector, Some(slot));
        match self.slot(sector, slot).as_ref().and_then(decode) {
            Some((generation, payload)) => Found::Record(generation, payload),
            None => Found::Unreadable,
        }
    }

    /// The first free slot of a sector, which is erased unless that has been done or it holds the
    /// newest record.
    fn make_room(
        &mut self,
        sector: usize,
        survey: Option<Survey>,
        holds_newest: bool,
    ) -> Option<usize> {
        match survey {
            Some(Survey { marked: true, end, .. }) if holds_newest || end == 1 => Some(end),
            // Its free slots may be erased in part only; the log goes on in the other sector.
            Some(_) if holds_newest => Some(Self::SLOTS),
            _ => self.prepare(sector).map(|()| 1),
        }
    }

    fn prepare(&mut self, sector: usize) -> Option<()> {
        let (start, end) = (Self::offset(sector, 0), Self::offset(sector + 1, 0));
        self.flash.erase(start, end).ok()?;
        let mut mark = [ERASED; SLOT];
        *mark.first_chunk_mut()? = SECTOR_MARK;
        let length = SECTOR_MARK.len().next_multiple_of(F::WRITE_SIZE);
        self.flash.write(start, mark.get(..length)?).ok()
    }

    /// Reads a whole sector; none if that fails.
    fn survey(&mut self, sector: usize) -> Option<Survey> {
        let mut survey = Survey::default();
        for slot in 0..Self::SLOTS {
            let bytes = self.slot(sector, slot)?;
            if bytes != [ERASED; SLOT] {
                survey.end = slot + 1;
            }
            if slot == 0 {
                survey.marked = bytes.starts_with(&SECTOR_MARK);
            }
            if let Some((generation, _)) = decode(&bytes) {
                survey.newest = survey.newest.max(Some((generation, slot)));
            }
        }
        Some(survey)
    }

    fn slot(&mut self, sector: usize, slot: usize) -> Option<[u8; SLOT]> {
        let mut bytes = [0; SLOT];
        self.flash.read(Self::offset(sector, slot), &mut bytes).ok()?;
        Some(bytes)
    }

    fn offset(sector: usize, slot: usize) -> u32 {
        (sector * F::ERASE_SIZE + slot * SLOT) as u32
    }
}

/// Writes a record for the start of a slot, in whole units of `write_size`; none if the payload is too
/// long.
fn encode(
    generation: u32,
    payload: &[u8],
    write_size: usize,
    record: &mut Vec<u8, SLOT>,
) -> Option<()> {
    let length = u16::try_from(payload.len()).ok()?.to_le_bytes();
    record.extend_from_slice(&RECORD_MARK).ok()?;
    record.extend_from_slice(&generation.to_le_bytes()).ok()?;
    record.extend_from_slice(&length).ok()?;
    record.extend_from_slice(payload).ok()?;
    let checksum = CRC.checksum(record).to_le_bytes();
    record.extend_from_slice(&checksum).ok()?;
    record.resize(record.len().next_multiple_of(write_size), ERASED).ok()
}

/// Generation and payload of the record in a slot, if it holds a whole one.
fn decode(slot: &[u8; SLOT]) -> Option<(u32, Payload)> {
    let (mark, rest) = slot.split_first_chunk()?;
    let (generation, rest) = rest.split_first_chunk()?;
    let (length, rest) = rest.split_first_chunk()?;
    if *mark != RECORD_MARK {
        return None;
    }
    let length = usize::from(u16::from_le_bytes(*length));
    let payload = rest.get(..length)?;
    let checksum = rest.get(length..)?.first_chunk()?;
    let covered = slot.get(..HEADER + length)?;
    (CRC.checksum(covered) == u32::from_le_bytes(*checksum)).then_some(())?;
    Some((u32::from_le_bytes(*generation), Payload::from_slice(payload).ok()?))
}

#[cfg(test)]
#[path = "parameter_store_tests.rs"]
mod tests;
