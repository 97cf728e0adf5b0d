//! Two FIFOs that carry the link's bytes and, with them, time: the vehicle waits for a packet once a
//! control tick. A packet is its length (u16 LE) and that many bytes.

use std::fs::{self, File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;
use std::{env, process, thread};

use super::PilError;
use super::emulator::Emulator;

/// Longest that an answer may take.
pub const PATIENCE: Duration = Duration::from_secs(60);
/// Most bytes of a packet.
pub const PACKET_MAX: usize = 1024;

/// A running image that waits for its host. It ends with this value.
#[derive(Debug)]
pub struct Lockstep {
    emulator: Child,
    to_vehicle: File,
    packets: Receiver<Vec<u8>>,
    directory: PathBuf,
}

impl Lockstep {
    /// Starts the image with a link in lock step.
    ///
    /// # Errors
    /// When the FIFOs cannot be made or the emulator does not start.
    pub fn start(emulator: &Emulator, directives: &[String]) -> Result<Self, PilError> {
        let directory = own_directory();
        let path = directory.join("link");
        let made =
            fs::create_dir_all(&directory).map_err(|error| error.to_string()).and_then(|()| {
                Ok((fifo(&path.with_extension("in"))?, fifo(&path.with_extension("out"))?))
            });
        let (to_vehicle, from_vehicle) =
            made.map_err(|error| PilError::Fifo(directory.clone(), error))?;
        let link = format!("link={}", path.display());
        let all: Vec<_> = [link].into_iter().chain(directives.iter().cloned()).collect();
        let emulator = emulator.start(&all, "null")?;
        Ok(Self { emulator, to_vehicle, packets: packets(from_vehicle), directory })
    }

    /// Lets the vehicle go on with `bytes` received, at most [`PACKET_MAX`].
    ///
    /// # Errors
    /// When the FIFO fails.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), PilError> {
        let bytes = &bytes[..bytes.len().min(PACKET_MAX)];
        let packet = [&(bytes.len() as u16).to_le_bytes(), bytes].concat();
        self.to_vehicle
            .write_all(&packet)
            .map_err(|error| PilError::Fifo(self.directory.clone(), error.to_string()))
    }

    /// What the vehicle has sent until it waits.
    ///
    /// # Errors
    /// When nothing comes for `patience`.
    pub fn receive(&mut self, patience: Duration) -> Result<Vec<u8>, PilError> {
        self.packets.recv_timeout(patience).map_err(|_| PilError::Silent(patience))
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
        let _ = fs::remove_dir_all(&self.directory);
    }
}

/// A directory that no other link of this or another process uses.
fn own_directory() -> PathBuf {
    static LINKS: AtomicU32 = AtomicU32::new(0);
    let link = LINKS.fetch_add(1, Ordering::Relaxed);
    env::temp_dir().join(format!("sil-host-{}-{link}", process::id()))
}

/// Makes a FIFO; opened for both directions, neither side waits for the other to open it.
fn fifo(path: &Path) -> Result<File, String> {
    let made = Command::new("mkfifo").arg(path).status().map_err(|e| format!("mkfifo: {e}"))?;
    if !made.success() {
        return Err(format!("mkfifo: {made}"));
    }
    OpenOptions::new().read(true).write(true).open(path).map_err(|error| error.to_string())
}

/// Reads packets in a thread of its own, so that waiting for one can end.
fn packets(mut from_vehicle: File) -> Receiver<Vec<u8>> {
    let (sender, receiver) = channel();
    thread::spawn(move || {
        let mut length = [0; 2];
        while from_vehicle.read_exact(&mut length).is_ok() {
            let mut packet = vec![0; usize::from(u16::from_le_bytes(length))];
            if from_vehicle.read_exact(&mut packet).is_err() || sender.send(packet).is_err() {
                return;
            }
        }
    });
    receiver
}
