//! The link in lock step: two FIFOs of the host instead of USART2, over semihosting.
//!
//! At every release of the telemetry group, or in the link's own lock step when a tick is done, the
//! emulator writes a packet with the frames that it has sent since the last one and waits for a packet
//! with bytes for it. While it waits no instruction runs, so virtual time stands still: a simulated
//! plant on the host and the whole image step together, whatever the machine is busy with.
//!
//! A packet is its length (u16 LE) and that many bytes. A host that knows what it will send may send many packets
//! at once: each is still taken at its own release, but they are read at once, and the answers are kept until
//! no packet is left to go on with, then written at once.

use core::cell::RefCell;
use core::ffi::CStr;
use core::ops::Range;

use critical_section::Mutex;
use heapless::Vec;
use semihosting::fs::File;
use semihosting::io::{ErrorKind, Read, Result, Write};
use semihosting::{eprintln, process};

/// Bytes of a packet at most, without its length.
const PACKET: usize = 1024;
/// Bytes of the length.
const LENGTH: usize = 2;
/// Bytes read ahead at most.
const READ: usize = 8 * 1024;
/// Bytes that wait to be written at most.
const WRITTEN: usize = 8 * 1024;

static LINK: Mutex<RefCell<Option<Lockstep>>> = Mutex::new(RefCell::new(None));
/// Packets that have been read: too large for the stack, from which [`LINK`] is filled.
static READ_AHEAD: Mutex<RefCell<[u8; READ]>> = Mutex::new(RefCell::new([0; READ]));
/// Packets that wait to be written.
static TO_WRITE: Mutex<RefCell<Vec<u8, WRITTEN>>> = Mutex::new(RefCell::new(Vec::new()));

/// The two FIFOs and what waits between them and the tasks.
struct Lockstep {
    from_host: File,
    to_host: File,
    /// Bytes of [`READ_AHEAD`] that no exchange has looked at.
    unseen: Range<usize>,
    /// Bytes of [`READ_AHEAD`] that the latest exchange has received.
    received: Range<usize>,
    /// Place of the open packet's length in [`TO_WRITE`].
    open: usize,
}

impl Lockstep {
    fn exchange(&mut self, read: &mut [u8; READ], sent: &mut Vec<u8, WRITTEN>) -> Result<()> {
        let length = (sent.len() - self.open - LENGTH) as u16;
        sent[self.open..][..LENGTH].copy_from_slice(&length.to_le_bytes());
        // Bytes that have not been taken are dropped, as the wire would.
        self.received = loop {
            if let Some(packet) = self.next_packet(read) {
                break packet;
            }
            self.write(sent)?;
            self.read(read)?;
        };
        if sent.capacity() - sent.len() < 2 * LENGTH + PACKET {
            self.write(sent)?;
        }
        self.open = sent.len();
        let _ = sent.extend_from_slice(&[0; LENGTH]); // there is room
        Ok(())
    }

    /// The next packet of those that have been read, if it is whole.
    fn next_packet(&mut self, read: &[u8; READ]) -> Option<Range<usize>> {
        let (length, rest) = read[self.unseen.clone()].split_first_chunk()?;
        let length = usize::from(u16::from_le_bytes(*length)).min(PACKET);
        (rest.len() >= length).then(|| {
            let start = self.unseen.start + LENGTH;
            self.unseen.start = start + length;
            start..start + length
        })
    }

    fn write(&mut self, sent: &mut Vec<u8, WRITTEN>) -> Result<()> {
        self.to_host.write_all(sent)?;
        sent.clear();
        Ok(())
    }

    /// Reads what has come, at least a byte.
    fn read(&mut self, read: &mut [u8; READ]) -> Result<()> {
        read.copy_within(self.unseen.clone(), 0);
        self.unseen = 0..self.unseen.len();
        match self.from_host.read(&mut read[self.unseen.end..])? {
            0 => Err(ErrorKind::UnexpectedEof.into()),
            more => {
                self.unseen.end += more;
                Ok(())
            }
        }
    }
}

/// Opens the FIFOs `PATH.in` and `PATH.out`, seen from here.
pub fn open(path: &str) {
    let Some((from_host, to_host)) = open_both(path) else {
        eprintln!("no FIFOs at {path}");
        process::exit(1)
    };
    let link = Lockstep { from_host, to_host, unseen: 0..0, received: 0..0, open: 0 };
    critical_section::with(|cs| {
        let _ = TO_WRITE.borrow_ref_mut(cs).extend_from_slice(&[0; LENGTH]); // there is room
        LINK.borrow_ref_mut(cs).replace(link)
    });
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

/// `true` if the link is in lock step.
pub fn is_open() -> bool {
    critical_section::with(|cs| LINK.borrow_ref(cs).is_some())
}

/// Hands over the bytes from the host; none without a link in lock step.
pub fn receive(take: impl FnMut(u8)) -> Option<()> {
    // One critical section for all bytes: to leave one costs the emulator more than all of them.
    critical_section::with(|cs| {
        let mut link = LINK.borrow_ref_mut(cs);
        let received = core::mem::take(&mut link.as_mut()?.received);
        READ_AHEAD.borrow_ref(cs)[received].iter().copied().for_each(take);
        Some(())
    })
}

/// Sends a frame, with the next packet; one that finds no room is lost, as on the wire.
pub fn transmit(frame: &[u8]) {
    let _ = critical_section::with(|cs| TO_WRITE.borrow_ref_mut(cs).extend_from_slice(frame));
}

/// Exchanges packets; true if bytes have come.
pub fn exchange() -> bool {
    let exchanged = critical_section::with(|cs| {
        let mut link = LINK.borrow_ref_mut(cs);
        let link = link.as_mut()?;
        let (mut read, mut sent) = (READ_AHEAD.borrow_ref_mut(cs), TO_WRITE.borrow_ref_mut(cs));
        Some(link.exchange(&mut read, &mut sent).map(|()| !link.received.is_empty()))
    });
    match exchanged {
        None => false,
        Some(Ok(come)) => come,
        Some(Err(_)) => process::exit(0), // the host has gone
    }
}
