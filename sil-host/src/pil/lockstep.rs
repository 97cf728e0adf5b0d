//! Two FIFOs that carry the link's bytes and, with them, time: the vehicle waits for a packet once a
//! control tick. A packet is its length (u16 LE) and that many bytes, written at once.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use tempfile::TempDir;

use super::emulator::Emulator;
use super::{PilError, placement};

/// Longest that an answer may take.
pub const PATIENCE: Duration = Duration::from_secs(60);
/// Longest wait before the emulator is looked at.
const SLICE: Duration = Duration::from_millis(100);
/// Most bytes of a packet.
pub const PACKET_MAX: usize = 1024;
/// Most bytes that are read at once.
const READ: usize = 16 * 1024;

/// A running image that waits for its host. It ends with this value.
#[derive(Debug)]
pub struct Lockstep {
    emulator: Child,
    to_vehicle: File,
    from_vehicle: File,
    /// Bytes that have been read; those before `taken` have been received.
    read: Vec<u8>,
    taken: usize,
    /// Nothing else goes in and out of the emulator, and its main loop has not been put last yet.
    by_fifos_alone: bool,
    /// Has the FIFOs; no other link has it, nor one that was killed and left its own.
    directory: TempDir,
}

impl Lockstep {
    /// Starts the image with a link in lock step.
    ///
    /// # Errors
    /// When the FIFOs cannot be made or the emulator does not start.
    pub fn start(emulator: &Emulator, directives: &[String]) -> Result<Self, PilError> {
        Self::start_with(emulator, directives, "null")
    }

    /// As [`start`](Self::start), with `mavlink` as QEMU's character device behind USART3.
    ///
    /// # Errors
    /// As [`start`](Self::start).
    pub fn start_with(
        emulator: &Emulator,
        directives: &[String],
        mavlink: &str,
    ) -> Result<Self, PilError> {
        let directory = TempDir::with_prefix("sil-host-")
            .map_err(|error| PilError::Line(std::env::temp_dir(), error.to_string()))?;
        let path = directory.path().join("link");
        let made = |extension| {
            let path = path.with_extension(extension);
            fifo(&path).map_err(|error| PilError::Line(path, error))
        };
        let (to_vehicle, from_vehicle) = (made("in")?, made("out")?);
        let link = format!("link={}", path.display());
        let all: Vec<_> = [link].into_iter().chain(directives.iter().cloned()).collect();
        let emulator = emulator.start_with(&all, "null", mavlink)?;
        let by_fifos_alone = mavlink == "null"; // otherwise the main loop has a character device to serve
        if by_fifos_alone {
            placement::keep_on_one_processor(&emulator);
        }
        Ok(Self {
            emulator,
            to_vehicle,
            from_vehicle,
            read: Vec::new(),
            taken: 0,
            by_fifos_alone,
            directory,
        })
    }

    /// Lets the vehicle go on with `bytes` received, at most [`PACKET_MAX`].
    ///
    /// # Errors
    /// When the FIFO fails.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), PilError> {
        self.send_all(&[bytes])
    }

    /// Lets the vehicle go on for as many exchanges as there are packets.
    ///
    /// # Errors
    /// When the FIFO fails.
    pub fn send_all<P: AsRef<[u8]>>(&mut self, packets: &[P]) -> Result<(), PilError> {
        let mut all = Vec::new();
        for packet in packets {
            let bytes = packet.as_ref();
            let bytes = &bytes[..bytes.len().min(PACKET_MAX)];
            all.extend((bytes.len() as u16).to_le_bytes());
            all.extend(bytes);
        }
        self.to_vehicle.write_all(&all).map_err(|error| self.failed(&error))
    }

    /// Bytes that the vehicle has sent until an exchange, the oldest that has not been received.
    ///
    /// # Errors
    /// When nothing comes for `patience`, or the emulator has ended.
    pub fn receive(&mut self, patience: Duration) -> Result<Vec<u8>, PilError> {
        let begin = Instant::now();
        loop {
            if let Some((length, rest)) = self.read[self.taken..].split_first_chunk()
                && let length = usize::from(u16::from_le_bytes(*length))
                && let Some(packet) = rest.get(..length)
            {
                self.taken += 2 + length;
                return Ok(packet.to_vec());
            }
            self.wait(begin + patience)?;
            self.read.drain(..self.taken);
            let end = self.read.len();
            self.taken = 0;
            self.read.resize(end + READ, 0);
            let read = self.from_vehicle.read(&mut self.read[end..]);
            if std::mem::take(&mut self.by_fifos_alone) {
                placement::main_loop_last(&self.emulator);
            }
            self.read.truncate(end + *read.as_ref().unwrap_or(&0));
            read.map_err(|error| self.failed(&error))?;
        }
    }

    /// Waits until there is something to read.
    fn wait(&mut self, end: Instant) -> Result<(), PilError> {
        let begin = Instant::now();
        while !readable(&self.from_vehicle, SLICE).map_err(|error| self.failed(&error))? {
            if let Ok(Some(status)) = self.emulator.try_wait() {
                return Err(PilError::Ended(status.to_string()));
            }
            if Instant::now() > end {
                return Err(PilError::Silent(begin.elapsed()));
            }
        }
        Ok(())
    }

    fn failed(&self, error: &dyn std::fmt::Display) -> PilError {
        PilError::Line(self.directory.path().to_owned(), error.to_string())
    }

    /// The emulator's process.
    pub fn emulator(&mut self) -> &mut Child {
        &mut self.emulator
    }
}

impl Drop for Lockstep {
    fn drop(&mut self) {
        let _ = self.emulator.kill();
        let _ = self.emulator.wait();
    }
}

/// Makes a FIFO; opened for both directions, neither side waits for the other to open it.
fn fifo(path: &Path) -> Result<File, String> {
    let made = Command::new("mkfifo").arg(path).status().map_err(|e| format!("mkfifo: {e}"))?;
    if !made.success() {
        return Err(format!("mkfifo: {made}"));
    }
    OpenOptions::new().read(true).write(true).open(path).map_err(|error| error.to_string())
}

/// Waits until a file has something to read, or for `patience`, and returns `false` then.
fn readable(file: &File, patience: Duration) -> rustix::io::Result<bool> {
    let patience =
        Timespec { tv_sec: patience.as_secs() as i64, tv_nsec: patience.subsec_nanos().into() };
    let mut files = [PollFd::new(file, PollFlags::IN)];
    match poll(&mut files, Some(&patience)) {
        Err(rustix::io::Errno::INTR) => Ok(false), // a signal; the caller waits again
        readable => Ok(readable? > 0),
    }
}
