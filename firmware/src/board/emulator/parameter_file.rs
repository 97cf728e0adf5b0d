//! The memory for parameters: a file of the host that behaves as the chip's flash, whose emulation
//! is a stub. Erasing sets bits, programming only clears them. Without a file every access fails.

use core::cell::RefCell;
use core::ffi::CStr;

use critical_section::Mutex;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use heapless::Vec;
use semihosting::fs::{File, OpenOptions};
use semihosting::io::{self, Read, Seek, SeekFrom, Write};
use semihosting::{eprintln, process};

/// As on the chip.
const SECTOR: usize = 16 * 1024;
const SECTORS: usize = 2;
/// Bytes that are read or written at once.
const CHUNK: usize = 256;

static FILE: Mutex<RefCell<Option<File>>> = Mutex::new(RefCell::new(None));

/// See the module's documentation.
pub struct ParameterFile(Option<File>);

/// Opens the file for [`ParameterFile::take`]; one that does not exist begins erased.
pub fn open(path: &str) {
    let Some(file) = open_or_create(path) else {
        eprintln!("no parameters at {path}");
        process::exit(1)
    };
    critical_section::with(|cs| FILE.borrow_ref_mut(cs).replace(file));
}

fn open_or_create(path: &str) -> Option<File> {
    let mut name = Vec::<u8, 512>::from_slice(path.as_bytes()).ok()?;
    name.push(0).ok()?;
    let name = CStr::from_bytes_with_nul(&name).ok()?;
    let mut options = OpenOptions::new();
    options.read(true).write(true);
    if let Ok(file) = options.open(name) {
        return Some(file);
    }
    let mut file = options.create(true).truncate(true).open(name).ok()?;
    fill(&mut file, 0, SECTORS * SECTOR).ok()?;
    Some(file)
}

/// Sets all bits.
fn fill(file: &mut File, from: u32, length: usize) -> io::Result<()> {
    file.seek(SeekFrom::Start(from.into()))?;
    (0..length / CHUNK).try_for_each(|_| file.write_all(&[0xFF; CHUNK]))
}

/// Clears the bits that are zero in `bytes`, at most [`CHUNK`].
fn clear(file: &mut File, offset: u32, bytes: &[u8]) -> io::Result<()> {
    let mut cells = [0; CHUNK];
    let cells = &mut cells[..bytes.len()];
    file.seek(SeekFrom::Start(offset.into()))?;
    file.read_exact(cells)?;
    for (cell, byte) in cells.iter_mut().zip(bytes) {
        *cell &= byte;
    }
    file.seek(SeekFrom::Start(offset.into()))?;
    file.write_all(cells)
}

impl ParameterFile {
    /// The file that was [opened](open), if one was.
    pub fn take() -> Self {
        Self(critical_section::with(|cs| FILE.borrow_ref_mut(cs).take()))
    }

    fn with(
        &mut self,
        action: impl FnOnce(&mut File) -> io::Result<()>,
    ) -> Result<(), NorFlashErrorKind> {
        let file = self.0.as_mut().ok_or(NorFlashErrorKind::Other)?;
        action(file).map_err(|_| NorFlashErrorKind::Other)
    }
}

impl ErrorType for ParameterFile {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for ParameterFile {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        self.with(|file| {
            file.seek(SeekFrom::Start(offset.into()))?;
            file.read_exact(bytes)
        })
    }

    fn capacity(&self) -> usize {
        SECTORS * SECTOR
    }
}

impl NorFlash for ParameterFile {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.with(|file| fill(file, from, to.saturating_sub(from) as usize))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        self.with(|file| {
            let chunks = (offset..).step_by(CHUNK).zip(bytes.chunks(CHUNK));
            chunks.into_iter().try_for_each(|(offset, chunk)| clear(file, offset, chunk))
        })
    }
}
