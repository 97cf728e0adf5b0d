//! The image's MAVLink port with any number of stations behind it: every frame of a station goes to the image, and every
//! frame of the image to all stations.

use std::io::{self, ErrorKind, Read};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::time::{Duration, Instant};

use super::ports::{Ports, write_owed};

/// Most bytes that wait for the image: a tenth of a second of its port. Frames beyond are dropped whole, so that a flood
/// does not make commands old.
const OWED_MAX: usize = 9216;
/// Longest time in which the emulator must connect.
const PATIENCE: Duration = Duration::from_secs(30);

/// A port that waits for the emulator.
#[derive(Debug)]
pub(super) struct ImageDoor(TcpListener);

/// See the module's documentation.
#[derive(Debug)]
pub(super) struct ImageLine {
    stream: TcpStream,
    owed: Vec<u8>,
    frames: FrameSplitter,
}

impl ImageDoor {
    /// Opens a port of the loopback interface.
    ///
    /// # Errors
    /// When there is none.
    pub fn open() -> io::Result<Self> {
        TcpListener::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, 0))).map(Self)
    }

    /// QEMU's character device that connects to it.
    ///
    /// # Errors
    /// When the socket fails.
    pub fn device(&self) -> io::Result<String> {
        self.0.local_addr().map(|address| format!("tcp:{address},nodelay=on"))
    }

    /// The line to the emulator that has connected.
    ///
    /// # Errors
    /// When none does.
    pub fn accept(self) -> io::Result<ImageLine> {
        self.0.set_nonblocking(true)?;
        let begin = Instant::now();
        loop {
            match self.0.accept() {
                Ok((stream, _)) => {
                    stream.set_nonblocking(true)?;
                    stream.set_nodelay(true)?;
                    let (owed, frames) = (Vec::new(), FrameSplitter::default());
                    return Ok(ImageLine { stream, owed, frames });
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(error) => return Err(error),
            }
            if begin.elapsed() > PATIENCE {
                return Err(io::Error::new(ErrorKind::TimedOut, "the emulator has not connected"));
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

impl ImageLine {
    /// Passes on what has come on either side.
    ///
    /// # Errors
    /// When the emulator has closed its side.
    pub fn exchange(&mut self, ports: &mut Ports) -> io::Result<()> {
        ports.receive(|packet, _| {
            let frame = packet.frame();
            if self.owed.len() + frame.as_bytes().len() <= OWED_MAX {
                self.owed.extend_from_slice(frame.as_bytes());
            }
        });
        let mut open = write_owed(&mut self.stream, &mut self.owed);
        let mut buffer = [0; 4096];
        loop {
            match self.stream.read(&mut buffer) {
                Ok(0) => open = false,
                Ok(count) => {
                    self.frames.push(buffer.get(..count).unwrap_or_default());
                    continue;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) => open &= error.kind() == ErrorKind::WouldBlock,
            }
            break;
        }
        while let Some(frame) = self.frames.next_frame() {
            ports.send(&frame);
        }
        ports.flush();
        if open { Ok(()) } else { Err(io::Error::from(ErrorKind::BrokenPipe)) }
    }
}

/// Cuts the image's bytes into frames of MAVLink 2, whole ones only: it sends nothing else, and loses nothing.
#[derive(Debug, Default)]
struct FrameSplitter(Vec<u8>);

impl FrameSplitter {
    const START: u8 = 0xFD;

    fn push(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    fn next_frame(&mut self) -> Option<Vec<u8>> {
        let start = self.0.iter().position(|byte| *byte == Self::START).unwrap_or(self.0.len());
        self.0.drain(..start);
        let [_, payload, flags, ..] = self.0[..] else { return None };
        let signature = if flags & 1 == 0 { 0 } else { 13 };
        let whole = 10 + usize::from(payload) + 2 + signature;
        (self.0.len() >= whole).then(|| self.0.drain(..whole).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_come_whole_however_their_bytes_come() {
        let plain = [&[0xFD, 3, 0, 0, 0, 1, 1, 0, 0, 0][..], &[0xFD, 2, 1], &[9, 9]].concat();
        let signed = [&[0xFD, 1, 1, 0, 1, 1, 1, 0, 0, 0][..], &[7], &[9, 9], &[5; 13]].concat();
        let bytes = [&[1, 2][..], &plain, &signed, &plain].concat();
        for part in [1, 2, 7, bytes.len()] {
            let mut splitter = FrameSplitter::default();
            let mut frames = Vec::new();
            for part in bytes.chunks(part) {
                splitter.push(part);
                frames.extend(std::iter::from_fn(|| splitter.next_frame()));
            }
            assert_eq!(frames, [plain.clone(), signed.clone(), plain.clone()], "{part}");
            assert!(splitter.0.is_empty());
        }
    }
}
