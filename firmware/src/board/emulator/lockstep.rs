//! The link in lock step: two FIFOs of the host instead of USART2, over semihosting.
//!
//! At every release of the telemetry group, or in the link's own lock step when a tick is done, the
//! emulator writes a packet with the frames that it has sent since the last one and waits for a packet
//! with bytes for it. While it waits no instruction runs, so virtual time stands still: a simulated
//! plant on the host and the whole image step together, whatever the machine is busy with.
//!
//! A packet is its length (u16 LE) and that many bytes, written at once, so that it can be read at once.

use core::cell::RefCell;
use core::ffi::CStr;

use critical_section::Mutex;
use heapless::Vec;
use semihosting::fs::File;
use semihosting::io::{Read, Write};
use semihosting::{eprintln, process};

/// Bytes of a packet at most, without its length.
const PACKET: usize = 1024;
/// Bytes of the length.
const LENGTH: usize = 2;

static LINK: Mutex<RefCell<Option<Lockstep>>> = Mutex::new(RefCell::new(None));

/// The two FIFOs and what waits between them and the tasks.
struct Lockstep {
    from_host: File,
    to_host: File,
    received: Vec<u8, PACKET>,
    /// A packet: its length, filled in last, and its bytes.
    sent: Vec<u8, { LENGTH + PACKET }>,
}

impl Lockstep {
    fn exchange(&mut self) -> Result<(), semihosting::io::Error> {
        let length = (self.sent.len() - LENGTH) as u16;
        self.sent[..LENGTH].copy_from_slice(&length.to_le_bytes());
        self.to_host.write_all(&self.sent)?;
        self.sent.truncate(LENGTH);
        let mut packet = [0; LENGTH + PACKET];
        let mut read = 0;
        while read < LENGTH || read < LENGTH + length_of(&packet) {
            match self.from_host.read(&mut packet[read..])? {
                0 => return Err(semihosting::io::ErrorKind::UnexpectedEof.into()),
                more => read += more,
            }
        }
        // Bytes that have not been taken are dropped, as the wire would.
        self.received.clear();
        self.received.extend(packet[LENGTH..read].iter().copied());
        Ok(())
    }
}

/// Length of the packet that begins with `bytes`.
fn length_of(bytes: &[u8; LENGTH + PACKET]) -> usize {
    usize::from(u16::from_le_bytes([bytes[0], bytes[1]])).min(PACKET)
}

/// Opens the FIFOs `PATH.in` and `PATH.out`, seen from here.
pub fn open(path: &str) {
    let Some((from_host, to_host)) = open_both(path) else {
        eprintln!("no FIFOs at {path}");
        process::exit(1)
    };
    let sent = core::iter::repeat_n(0, LENGTH).collect();
    let link = Lockstep { from_host, to_host, received: Vec::new(), sent };
    critical_section::with(|cs| LINK.borrow_ref_mut(cs).replace(link));
}

fn open_both(path: &str) -> Option<(File, File)> {
    let name = |ending: &str| {
        let mut name = Vec::<u8, 512>::new();
        name.extend_from_slice(path.as_bytes()).ok()?;
        name.extend_from_slice(ending.as_bytes()).ok()?;
        name.push(0).ok()?;
        Some(name)
    };
    let (input, output) = (name(".in")?, name(".out")?);
    let from_host = File::open(CStr::from_bytes_with_nul(&input).ok()?).ok()?;
    let to_host = File::create(CStr::from_bytes_with_nul(&output).ok()?).ok()?;
    Some((from_host, to_host))
}

/// Runs `action` with the link, if there is one.
fn with<T>(action: impl FnOnce(&mut Lockstep) -> T) -> Option<T> {
    critical_section::with(|cs| LINK.borrow_ref_mut(cs).as_mut().map(action))
}

/// `true` if the link is in lock step.
pub fn is_open() -> bool {
    with(|_| ()).is_some()
}

/// Hands over the bytes from the host; none without a link in lock step.
pub fn receive(take: impl FnMut(u8)) -> Option<()> {
    // One critical section for all bytes: to leave one costs the emulator more than all of them.
    with(|link| {
        link.received.iter().copied().for_each(take);
        link.received.clear();
    })
}

/// Sends a frame, with the next packet.
pub fn transmit(frame: &[u8]) {
    with(|link| link.sent.extend_from_slice(frame));
}

/// Exchanges packets; true if bytes have come.
pub fn exchange() -> bool {
    match with(Lockstep::exchange) {
        None => false,
        Some(Ok(())) => with(|link| !link.received.is_empty()).unwrap_or(false),
        Some(Err(_)) => process::exit(0), // the host has gone
    }
}
