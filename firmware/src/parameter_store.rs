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
            assert!(CHUNK.is_multiple_of(F::WRITE_SIZE) && SLOT.is_multiple_of(CHUNK));
            assert!(F::READ_SIZE == 1);
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
        let length = u16::try_from(payload.len()).map_err(|_| StoreError::Failed)?;
        if payload.len() > PAYLOAD_MAX {
            return Err(StoreError::Failed);
        }
        let header = header(generation, length);
        let checksum = checksum(&header, payload).to_le_bytes();
        let record = header.iter().chain(payload).chain(&checksum).copied();
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
        let written = self.write(place, record.clone()).is_some();
        if !written || !self.holds(place, record) {
            return Err(StoreError::Failed);
        }
        (self.generation, self.active, self.newest) = (generation, sector, Some(slot));
        Ok(generation)
    }

    /// Reads the newest record again, into `payload`; `false` if there is none.
    #[inline(never)]
    pub fn newest(&mut self, payload: &mut Payload) -> bool {
        let slot = self.newest;
        slot.and_then(|slot| self.read(self.active, slot, payload)).is_some()
    }

    /// Writes bytes from `place` on, a chunk at a time, up to a whole unit of the memory.
    fn write(&mut self, place: u32, bytes: impl Iterator<Item = u8>) -> Option<()> {
        let (mut place, mut bytes) = (place, bytes.peekable());
        while bytes.peek().is_some() {
            let (mut chunk, mut length) = ([ERASED; CHUNK], 0);
            for (to, byte) in chunk.iter_mut().zip(bytes.by_ref().take(CHUNK)) {
                *to = byte;
                length += 1;
            }
            let whole = chunk.get(..usize::next_multiple_of(length, F::WRITE_SIZE))?;
            self.flash.write(place, whole).ok()?;
            place += CHUNK as u32;
        }
        Some(())
    }

    /// `true` if the memory at `place` reads as `record` and is blank behind it, to the end of the slot.
    fn holds(&mut self, place: u32, record: impl Iterator<Item = u8>) -> bool {
        let mut expected = record.chain(core::iter::repeat(ERASED));
        (0..SLOT).step_by(CHUNK).all(|offset| {
            let mut read = [0; CHUNK];
            self.flash.read(place + offset as u32, &mut read).is_ok()
                && read.iter().all(|read| expected.next() == Some(*read))
        })
    }

    /// Goes on with the log behind its newest record.
    fn take_up(&mut self, generation: u32, sector: usize, slot: usize) -> Found {
        (self.generation, self.active, self.newest) = (generation, sector, Some(slot));
        let mut payload = Payload::new();
        match self.read(sector, slot, &mut payload) {
            Some(generation) => Found::Record(generation, payload),
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
        self.write(start, SECTOR_MARK.into_iter())
    }

    /// Reads a whole sector; none if that fails.
    fn survey(&mut self, sector: usize) -> Option<Survey> {
        let mut survey = Survey::default();
        for slot in 0..Self::SLOTS {
            let place = Self::offset(sector, slot);
            if !self.is_blank(place)? {
                survey.end = slot + 1;
            }
            if slot == 0 {
                survey.marked = self.bytes(place)? == SECTOR_MARK;
            }
            if let Some(generation) = self.read(sector, slot, &mut Payload::new()) {
                survey.newest = survey.newest.max(Some((generation, slot)));
            }
        }
        Some(survey)
    }

    /// `true` if the slot at `place` has been erased and not written since.
    fn is_blank(&mut self, place: u32) -> Option<bool> {
        let mut blank = true;
        for offset in (0..SLOT).step_by(CHUNK) {
            blank &= self.bytes(place + offset as u32)? == [ERASED; CHUNK];
        }
        Some(blank)
    }

    /// Reads the record in a slot into `payload`; its generation, if there is a whole one.
    #[inline(never)]
    fn read(&mut self, sector: usize, slot: usize, payload: &mut Payload) -> Option<u32> {
        let place = Self::offset(sector, slot);
        let header: [u8; HEADER] = self.bytes(place)?;
        let (mark, rest) = header.split_first_chunk()?;
        let (generation, rest) = rest.split_first_chunk()?;
        let length = u16::from_le_bytes(*rest.first_chunk()?);
        if *mark != RECORD_MARK {
            return None;
        }
        payload.clear();
        payload.resize(length.into(), 0).ok()?;
        self.flash.read(place + HEADER as u32, payload).ok()?;
        let stored = self.bytes(place + HEADER as u32 + u32::from(length))?;
        (checksum(&header, payload) == u32::from_le_bytes(stored)).then_some(())?;
        Some(u32::from_le_bytes(*generation))
    }

    fn bytes<const N: usize>(&mut self, place: u32) -> Option<[u8; N]> {
        let mut bytes = [0; N];
        self.flash.read(place, &mut bytes).ok()?;
        Some(bytes)
    }

    fn offset(sector: usize, slot: usize) -> u32 {
        (sector * F::ERASE_SIZE + slot * SLOT) as u32
    }
}

/// What a record begins with.
fn header(generation: u32, length: u16) -> [u8; HEADER] {
    let [m0, m1, m2, m3] = RECORD_MARK;
    let [g0, g1, g2, g3] = generation.to_le_bytes();
    let [l0, l1] = length.to_le_bytes();
    [m0, m1, m2, m3, g0, g1, g2, g3, l0, l1]
}

/// Checksum of a record.
fn checksum(header: &[u8; HEADER], payload: &[u8]) -> u32 {
    let mut digest = CRC.digest();
    digest.update(header);
    digest.update(payload);
    digest.finalize()
}

#[cfg(test)]
#[path = "parameter_store_tests.rs"]
mod tests;
