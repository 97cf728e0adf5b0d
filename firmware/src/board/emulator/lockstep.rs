//! The link in lock step: two FIFOs of the host instead of USART2, over semihosting.
//!
//! At every release of the telemetry group the emulator writes a packet with the frames that it has
//! sent since the last one and waits for a packet with bytes for it. While it waits no instruction
//! runs, so virtual time stands still: a simulated plant on the host and the whole image step
//! together, whatever the machine is busy with. A packet is its length (u16 LE) and that many bytes.

use core::cell::RefCell;
use core::ffi::CStr;

use critical_section::Mutex;
use heapless::{Deque, Vec};
use semihosting::fs::File;
use semihosting::io::{Read, Write};
use semihosting::{eprintln, process};

/// Bytes of a packet at most.
const PACKET: usize = 1024;

static LINK: Mutex<RefCell<Option<Lockstep>>> = Mutex::new(RefCell::new(None));

/// The two FIFOs and what waits between them and the tasks.
struct Lockstep {
    from_host: File,
    to_host: File,
    received: Deque<u8, PACKET>,
    sent: Vec<u8, PACKET>,
}

impl Lockstep {
    fn exchange(&mut self) -> Result<(), semihosting::io::Error> {
        self.to_host.write_all(&(self.sent.len() as u16).to_le_bytes())?;
        self.to_host.write_all(&self.sent)?;
        self.sent.clear();
        let mut length = [0; 2];
        self.from_host.read_exact(&mut length)?;
        let mut bytes = [0; PACKET];
        let length = usize::from(u16::from_le_bytes(length)).min(PACKET);
        self.from_host.read_exact(&mut bytes[..length])?;
        for byte in &bytes[..length] {
            // A full queue drops the byte, as the wire would.
            let _ = self.received.push_back(*byte);
        }
        Ok(())
    }
}

/// Opens the FIFOs `PATH.in` and `PATH.out`, seen from here.
pub fn open(path: &str) {
    let Some((from_host, to_host)) = open_both(path) else {
        eprintln!("no FIFOs at {path}");
        process::exit(1)
    };
    let link = Lockstep { from_host, to_host, received: Deque::new(), sent: Vec::new() };
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

/// Whether the link is in lock step.
pub fn is_open() -> bool {
    with(|_| ()).is_some()
}

/// The next byte from the host.
pub fn receive() -> Option<u8> {
    with(|link| link.received.pop_front()).flatten()
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
