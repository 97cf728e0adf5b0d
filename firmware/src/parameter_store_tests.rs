//! The log in a simulated flash that only clears bits and whose supply fails at any operation.

use std::cell::RefCell;
use std::rc::Rc;
use std::vec::Vec;

use embedded_storage::nor_flash::{ErrorType, NorFlashError, NorFlashErrorKind, ReadNorFlash};

use super::*;

const SECTOR: usize = 2048;
const SLOTS: usize = SECTOR / SLOT;

/// Memory that outlives its user.
#[derive(Clone)]
struct Simulated {
    cells: Rc<RefCell<Vec<u8>>>,
    /// Operations before the supply fails; one is a byte programmed or a step of an erasure.
    left: Rc<RefCell<usize>>,
    done: Rc<RefCell<usize>>,
}

/// No supply, or no such place.
#[derive(Debug)]
struct Dead;

impl NorFlashError for Dead {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for Simulated {
    type Error = Dead;
}

impl Simulated {
    fn new(byte: u8) -> Self {
        let cells = Rc::new(RefCell::new(std::vec![byte; SECTORS * SECTOR]));
        let left = Rc::new(RefCell::new(usize::MAX));
        Self { cells, left, done: Rc::default() }
    }

    /// The same memory after the supply has come back, to fail again after `left` operations.
    fn restarted(&self, left: usize) -> Self {
        let cells = Rc::new(RefCell::new(self.cells.borrow().clone()));
        Self { cells, left: Rc::new(RefCell::new(left)), done: Rc::default() }
    }

    /// Spends one operation, or fails in the middle of it.
    fn operate(&mut self) -> Result<(), Dead> {
        *self.done.borrow_mut() += 1;
        let mut left = self.left.borrow_mut();
        *left = left.checked_sub(1).ok_or(Dead)?;
        Ok(())
    }
}

impl ReadNorFlash for Simulated {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Dead> {
        let cells = self.cells.borrow();
        bytes.copy_from_slice(
            cells.get(offset as usize..).and_then(|c| c.get(..bytes.len())).ok_or(Dead)?,
        );
        Ok(())
    }

    fn capacity(&self) -> usize {
        SECTORS * SECTOR
    }
}

impl NorFlash for Simulated {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SECTOR;

    /// In steps that leave a part erased, and some bits of it only half.
    fn erase(&mut self, from: u32, to: u32) -> Result<(), Dead> {
        assert_eq!((from as usize % SECTOR, to - from), (0, SECTOR as u32));
        for step in 0..8 {
            if self.operate().is_err() {
                let mut cells = self.cells.borrow_mut();
                for (index, cell) in cells[from as usize..to as usize].iter_mut().enumerate() {
                    if index % 8 < step {
                        *cell |= 0x5A;
                    }
                }
                return Err(Dead);
            }
        }
        self.cells.borrow_mut()[from as usize..to as usize].fill(ERASED);
        Ok(())
    }

    /// Only clears bits; a byte that the supply fails in has some of them.
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Dead> {
        for (index, byte) in (offset as usize..).zip(bytes) {
            let alive = self.operate();
            assert_eq!(self.cells.borrow()[index], ERASED, "programmed twice without an erasure");
            self.cells.borrow_mut()[index] &= if alive.is_ok() { *byte } else { byte | 0xC3 };
            alive?;
        }
        Ok(())
    }
}

fn open(memory: &Simulated, left: usize) -> (ParameterStore<Simulated>, Found, Simulated) {
    let memory = memory.restarted(left);
    let (store, found) = ParameterStore::open(memory.clone());
    (store, found, memory)
}

fn record(generation: u32, content: &[u8]) -> Found {
    Found::Record(generation, Payload::from_slice(content).unwrap())
}

/// A payload that shows its number.
fn content(number: u32) -> Vec<u8> {
    (0..100).map(|index| (number * 7 + index) as u8).collect()
}

/// Memory after `count` records, each kept in a run of its own.
fn with_records(count: u32) -> Simulated {
    let mut memory = Simulated::new(ERASED);
    for number in 1..=count {
        let (mut store, _, now) = open(&memory, usize::MAX);
        assert_eq!(store.append(&content(number)), Ok(number));
        memory = now;
    }
    memory
}

#[test]
fn the_newest_record_is_found_however_many_there_were() {
    assert_eq!(open(&Simulated::new(ERASED), usize::MAX).1, Found::Nothing);
    let mut memory = Simulated::new(ERASED);
    for number in 1..=5 * SLOTS as u32 {
        let (mut store, _, now) = open(&memory, usize::MAX);
        assert_eq!(store.append(&content(number)), Ok(number));
        memory = now;
        assert_eq!(open(&memory, usize::MAX).1, record(number, &content(number)));
    }
}

#[test]
fn memory_that_was_never_ours_is_made_so() {
    for byte in [0x00, 0x5A, 0xFE] {
        let (mut store, found, memory) = open(&Simulated::new(byte), usize::MAX);
        assert_eq!(found, Found::Unreadable);
        assert_eq!(store.append(b"new"), Ok(1));
        assert_eq!(open(&memory, usize::MAX).1, record(1, b"new"));
    }
}

#[test]
fn one_run_keeps_until_both_sectors_are_full_and_a_restart_makes_room() {
    let (mut store, _, memory) = open(&Simulated::new(ERASED), usize::MAX);
    let room = SECTORS as u32 * (SLOTS as u32 - 1);
    for number in 1..=room {
        assert_eq!(store.append(&content(number)), Ok(number));
    }
    let erased = *memory.done.borrow();
    assert_eq!(store.append(b"more"), Err(StoreError::Full));
    assert_eq!(*memory.done.borrow(), erased, "nothing is erased in flight");
    let (mut store, found, memory) = open(&memory, usize::MAX);
    assert_eq!(found, record(room, &content(room)));
    assert_eq!(store.append(b"more"), Ok(room + 1));
    assert_eq!(open(&memory, usize::MAX).1, record(room + 1, b"more"));
}

#[test]
fn a_payload_that_is_too_long_is_refused() {
    let (mut store, ..) = open(&Simulated::new(ERASED), usize::MAX);
    assert_eq!(store.append(&[1; PAYLOAD_MAX + 1]), Err(StoreError::Failed));
    assert_eq!(store.append(&[1; PAYLOAD_MAX]), Ok(1));
}

/// The supply fails at every operation of a run that makes room and keeps a record: afterwards the
/// old record is in force or the new one, and the next record is kept. Returns the operations.
fn assert_survives_every_failure(memory: &Simulated, old: &Found, generation: u32) -> usize {
    let mut operations = 0;
    loop {
        let (mut store, found, torn) = open(memory, operations);
        assert_eq!(found, *old, "failed at {operations}");
        let kept = store.append(b"the new one");
        let (mut store, found, after) = open(&torn, usize::MAX);
        let new = record(generation + 1, b"the new one");
        assert!(found == *old || found == new, "{found:?}, failed at {operations}");
        assert!(kept.is_err() || found == new, "lost what was said to be kept");
        let next = store.append(b"a later one").unwrap();
        assert_eq!(open(&after, usize::MAX).1, record(next, b"a later one"));
        if kept.is_ok() {
            return operations;
        }
        operations += 1;
    }
}

#[test]
fn a_supply_that_fails_at_any_operation_leaves_the_old_record_or_the_new_one() {
    // Around the change to the other sector and the erasure of the first one.
    let mut most = 0;
    for count in 1..3 * SLOTS as u32 {
        let memory = with_records(count);
        let old = record(count, &content(count));
        most = most.max(assert_survives_every_failure(&memory, &old, count));
    }
    assert!(most > 30, "an erasure, a mark and a record: {most}");
}

#[test]
fn the_first_record_ever_is_whole_or_not_there() {
    let memory = Simulated::new(ERASED);
    for operations in 0..60 {
        let (mut store, _, torn) = open(&memory, operations);
        let kept = store.append(b"the first one");
        let (mut store, found, after) = open(&torn, usize::MAX);
        match found {
            Found::Record(1, payload) => assert_eq!(payload.as_slice(), b"the first one"),
            other => assert!(kept.is_err(), "{other:?}"),
        }
        let next = store.append(b"a later one").unwrap();
        assert_eq!(open(&after, usize::MAX).1, record(next, b"a later one"));
    }
}

/// Two failures in a row: in the run and in the one that clears up after it.
#[test]
fn a_supply_that_fails_twice_leaves_a_whole_record() {
    let memory = with_records(SLOTS as u32 - 1);
    let number = SLOTS as u32 - 1;
    for first in 0..60 {
        let (mut store, _, torn) = open(&memory, first);
        let _ = store.append(b"new");
        let (_, before, _) = open(&torn, usize::MAX);
        for second in 0..60 {
            let (mut store, _, torn) = open(&torn, second);
            let _ = store.append(b"newer");
            let found = open(&torn, usize::MAX).1;
            let Found::Record(generation, payload) = &found else { panic!("{found:?}") };
            let newer = *generation > number && payload.as_slice() == b"newer";
            assert!(found == before || newer, "{first}, {second}: {found:?}");
        }
    }
}

#[test]
fn any_wrong_bit_of_a_record_is_noticed_and_the_one_before_is_in_force() {
    let memory = with_records(2);
    let start = 2 * SLOT;
    for bit in 0..8 * (HEADER + 100 + CHECKSUM) {
        let damaged = memory.restarted(0);
        damaged.cells.borrow_mut()[start + bit / 8] ^= 1 << (bit % 8);
        assert_eq!(open(&damaged, usize::MAX).1, record(1, &content(1)), "bit {bit}");
    }
}

#[test]
fn a_damaged_mark_costs_no_record() {
    let memory = with_records(2);
    memory.cells.borrow_mut()[0] = 0;
    let (mut store, found, now) = open(&memory, usize::MAX);
    assert_eq!(found, record(2, &content(2)));
    assert_eq!(store.append(b"next"), Ok(3));
    assert_eq!(open(&now, usize::MAX).1, record(3, b"next"));
}

/// Memory of a board without any.
struct Missing;

impl ErrorType for Missing {
    type Error = Dead;
}

impl ReadNorFlash for Missing {
    const READ_SIZE: usize = 1;
    fn read(&mut self, _: u32, _: &mut [u8]) -> Result<(), Dead> {
        Err(Dead)
    }
    fn capacity(&self) -> usize {
        0
    }
}

impl NorFlash for Missing {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;
    fn erase(&mut self, _: u32, _: u32) -> Result<(), Dead> {
        Err(Dead)
    }
    fn write(&mut self, _: u32, _: &[u8]) -> Result<(), Dead> {
        Err(Dead)
    }
}

#[test]
fn without_a_memory_nothing_is_found_and_nothing_kept() {
    let (mut store, found) = ParameterStore::open(Missing);
    assert_eq!(found, Found::Nothing);
    assert_eq!(store.append(b"new"), Err(StoreError::Failed));
}
