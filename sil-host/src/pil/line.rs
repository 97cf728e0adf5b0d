//! What carries the link's bytes: the FIFOs of an emulator, or a serial port.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::Child;
use std::time::{Duration, Instant};

use serial2::SerialPort;

use super::PilError;
use super::lockstep::{Lockstep, PATIENCE};

/// What a vehicle by the clock may say at any time is waited for so long.
const LISTEN: Duration = Duration::from_millis(20);
/// A step over a wire that is not answered for so long is asked for again.
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

    /// What has come, at most after [`LISTEN`].
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

    /// What a vehicle by the clock has sent: of FIFOs a packet, of a wire what comes in 20 ms.
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

    /// What a vehicle in lock step has sent, until `complete` says so of all of it; what `again` gives is
    /// sent if a wire says nothing for long. What an emulator sends is complete.
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
