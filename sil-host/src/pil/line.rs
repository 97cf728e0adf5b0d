//! Carrier of the link's bytes: the FIFOs of an emulator, or a serial port.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::Child;
use std::time::{Duration, Instant};

use serial2::SerialPort;

use super::PilError;
use super::lockstep::{Lockstep, PATIENCE};

/// Time to wait for messages that a vehicle by its timer may send at any moment.
const LISTEN: Duration = Duration::from_millis(20);
/// Time without an answer after which a step over a wire is requested again.
const RETRY: Duration = Duration::from_millis(500);

/// See the module's documentation.
#[derive(Debug)]
pub enum Line {
    /// To an image in an emulator, in lock step by its packets.
    Fifos(Lockstep),
    /// To a board, or to the serial port of an emulator.
    Serial(Wire),
}

/// A serial port.
#[derive(Debug)]
pub struct Wire {
    port: SerialPort,
    path: PathBuf,
}

impl Wire {
    /// Opens a port at `rate` bits a second: 8 data bits, no parity, one stop bit.
    ///
    /// # Errors
    /// When it cannot be opened or does not know the rate.
    pub fn open(path: &Path, rate: u32) -> Result<Self, PilError> {
        let port = SerialPort::open(path, rate).and_then(|mut port| {
            port.set_read_timeout(LISTEN)?;
            port.discard_buffers()?;
            Ok(port)
        });
        let failed = |error: std::io::Error| PilError::Line(path.to_owned(), error.to_string());
        Ok(Self { port: port.map_err(failed)?, path: path.to_owned() })
    }

    fn failed(&self, error: &std::io::Error) -> PilError {
        PilError::Line(self.path.clone(), error.to_string())
    }

    /// Bytes that have arrived, at most after [`LISTEN`].
    fn receive(&self) -> Result<Vec<u8>, PilError> {
        let mut buffer = [0; 4096];
        match self.port.read(&mut buffer) {
            Ok(read) => Ok(buffer[..read].to_vec()),
            Err(error) if error.kind() == ErrorKind::TimedOut => Ok(Vec::new()),
            Err(error) => Err(self.failed(&error)),
        }
    }
}

impl Line {
    /// Sends bytes.
    ///
    /// # Errors
    /// When the line fails.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), PilError> {
        match self {
            Self::Fifos(fifos) => fifos.send(bytes),
            Self::Serial(wire) => wire.port.write_all(bytes).map_err(|error| wire.failed(&error)),
        }
    }

    /// Sends the bytes of several ticks at once; a wire brings them one after the other.
    ///
    /// # Errors
    /// When the line fails.
    pub fn send_all(&mut self, packets: &[Vec<u8>]) -> Result<(), PilError> {
        match self {
            Self::Fifos(fifos) => fifos.send_all(packets),
            Self::Serial(_) => packets.iter().try_for_each(|packet| self.send(packet)),
        }
    }

    /// Bytes of a vehicle by its timer: a packet of FIFOs, or those of 20 ms over a wire.
    ///
    /// # Errors
    /// When the line fails, and when an emulator is silent.
    pub fn listen(&mut self) -> Result<Vec<u8>, PilError> {
        match self {
            Self::Fifos(fifos) => fifos.receive(PATIENCE),
            Self::Serial(wire) => {
                let (begin, mut bytes) = (Instant::now(), Vec::new());
                while begin.elapsed() < LISTEN {
                    bytes.extend(wire.receive()?);
                }
                Ok(bytes)
            }
        }
    }

    /// Bytes of a vehicle in lock step, until `complete` returns `true` for all of them; the bytes of
    /// `again` are sent after each half second of silence of a wire. A packet of an emulator is complete.
    ///
    /// # Errors
    /// As [`listen`](Self::listen), and when a wire is silent all the same.
    pub fn listen_until(
        &mut self,
        mut again: impl FnMut() -> Vec<u8>,
        mut complete: impl FnMut(&[u8]) -> bool,
    ) -> Result<Vec<u8>, PilError> {
        let Self::Serial(wire) = self else { return self.listen() };
        let (begin, mut asked) = (Instant::now(), Instant::now());
        let mut bytes = Vec::new();
        while begin.elapsed() < PATIENCE {
            bytes.extend(wire.receive()?);
            if complete(&bytes) {
                return Ok(bytes);
            }
            if asked.elapsed() > RETRY {
                wire.port.write_all(&again()).map_err(|error| wire.failed(&error))?;
                asked = Instant::now();
            }
        }
        Err(PilError::Silent(PATIENCE))
    }

    /// The emulator's process, if there is one here.
    pub fn emulator(&mut self) -> Option<&mut Child> {
        match self {
            Self::Fifos(fifos) => Some(fifos.emulator()),
            Self::Serial(_) => None,
        }
    }
}
