//! Framing: COBS, CRC-32, version, sequence numbers.
//!
//! A zero byte ends every frame and occurs nowhere else, so a receiver that has lost its place
//! finds it again at the next zero. The checksum is CRC-32 as in Ethernet and zlib.

use core::marker::PhantomData;

use crc::{CRC_32_ISO_HDLC, Crc, Digest};

use super::message::Message;
use super::statistics::LinkStatistics;
use super::{MAX_FRAME, MAX_PAYLOAD};

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// The checksum of any payload with its own checksum behind it.
const INTACT: u32 = 0x2144_DF1C;

/// A frame at most this many numbers behind the last is late or doubled and is dropped; one
/// further behind is from a sender that has begun anew.
const LATE_WINDOW: u16 = 32;

/// A message does not fit a frame. No message of this crate is that long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EncodeError;

impl core::fmt::Display for EncodeError {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        out.write_str("message longer than a frame")
    }
}

impl core::error::Error for EncodeError {}

/// Makes the frames of one direction and numbers them.
#[derive(Clone, Debug)]
pub struct Encoder<M> {
    next: u16,
    direction: PhantomData<M>,
}

impl<M> Default for Encoder<M> {
    fn default() -> Self {
        Self { next: 0, direction: PhantomData }
    }
}

impl<M: Message> Encoder<M> {
    /// The sequence number of the next frame.
    #[must_use]
    pub fn next_sequence(&self) -> u16 {
        self.next
    }

    /// Writes the next frame with its delimiter to `frame` and returns it.
    ///
    /// # Errors
    /// When the message is longer than [`MAX_MESSAGE`](super::MAX_MESSAGE); no number is spent.
    pub fn encode<'a>(
        &mut self,
        message: &M,
        frame: &'a mut [u8; MAX_FRAME],
    ) -> Result<&'a [u8], EncodeError> {
        let length = write_frame(message, self.next, frame).ok_or(EncodeError)?;
        self.next = self.next.wrapping_add(1);
        frame.get(..length).ok_or(EncodeError)
    }
}

/// Writes one frame; its length, or nothing if it does not fit.
fn write_frame<M: Message>(message: &M, sequence: u16, frame: &mut [u8]) -> Option<usize> {
    let mut payload = [0; MAX_PAYLOAD];
    let (header, rest) = payload.split_first_chunk_mut()?;
    let [low, high] = sequence.to_le_bytes();
    *header = [M::TAG, low, high];
    let covered = header.len() + postcard::to_slice(message, rest).ok()?.len();
    // wcet: at most 199 iterations
    let checksum = CRC.checksum(payload.get(..covered)?).to_le_bytes();
    *payload.get_mut(covered..)?.first_chunk_mut()? = checksum;
    // wcet: at most 199 iterations
    let length = cobs::try_encode(payload.get(..covered + checksum.len())?, frame).ok()?;
    *frame.get_mut(length)? = 0;
    Some(length + 1)
}

/// A message that has arrived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Received<M> {
    /// Sequence number of its frame.
    pub sequence: u16,
    /// The message.
    pub message: M,
}

/// Reason for dropping a frame.
enum Drop {
    Damaged,
    Foreign,
    Malformed,
    Late,
}

/// Checksum of a payload as its bytes come.
struct Checksum(Digest<'static, u32>);

impl Checksum {
    fn new() -> Self {
        Self(CRC.digest())
    }

    #[inline(always)]
    fn add(&mut self, byte: u8) {
        // wcet: at most 1 iterations
        self.0.update(&[byte]);
    }

    /// `true` if the last four bytes are the checksum of those before.
    fn is_intact(&self) -> bool {
        self.0.clone().finalize() == INTACT
    }
}

impl core::fmt::Debug for Checksum {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        out.debug_tuple("Checksum").field(&self.is_intact()).finish()
    }
}

/// Takes the bytes of one direction as they come.
///
/// Bounded: its buffer is one frame, and a byte costs constant time, its part of the checksum included, but for the
/// last of a frame, which costs one parse.
#[derive(Debug)]
pub struct Decoder<M> {
    cobs: cobs::DecoderState,
    payload: heapless::Vec<u8, MAX_PAYLOAD>,
    checksum: Checksum,
    overlong: bool,
    last: Option<u16>,
    statistics: LinkStatistics,
    direction: PhantomData<M>,
}

impl<M> Default for Decoder<M> {
    fn default() -> Self {
        Self {
            cobs: cobs::DecoderState::Idle,
            payload: heapless::Vec::new(),
            checksum: Checksum::new(),
            overlong: false,
            last: None,
            statistics: LinkStatistics::default(),
            direction: PhantomData,
        }
    }
}

impl<M: Message> Decoder<M> {
    /// Statistics so far.
    #[must_use]
    pub fn statistics(&self) -> LinkStatistics {
        self.statistics
    }

    /// Takes one byte; returns a message when it completes a good frame.
    ///
    /// Anything else is counted and dropped; the next frame starts after the next zero byte.
    pub fn push(&mut self, byte: u8) -> Option<Received<M>> {
        if self.push_byte(byte) { self.take_frame() } else { None }
    }

    /// Takes one byte in constant time; returns `true` if it ends a frame, good or not, which
    /// [`take_frame`](Self::take_frame) must judge before the next byte comes.
    pub fn push_byte(&mut self, byte: u8) -> bool {
        match self.cobs.feed(byte) {
            Ok(cobs::DecodeResult::NoData) => false,
            Ok(cobs::DecodeResult::DataContinue(data)) => {
                self.overlong |= self.payload.push(data).is_err();
                self.checksum.add(data);
                false
            }
            Ok(cobs::DecodeResult::DataComplete) => true,
            Err(_) => {
                self.overlong = true; // cut off inside a run: damaged all the same
                true
            }
        }
    }

    /// The message in the frame that has ended, if it is good.
    #[inline(never)]
    pub fn take_frame(&mut self) -> Option<Received<M>> {
        let result = if self.overlong { Err(Drop::Damaged) } else { self.receive() };
        self.payload.clear();
        self.checksum = Checksum::new();
        self.overlong = false;
        let statistics = &mut self.statistics;
        let (count, received) = match result {
            Ok(received) => (&mut statistics.delivered, Some(received)),
            Err(Drop::Damaged) => (&mut statistics.damaged, None),
            Err(Drop::Foreign) => (&mut statistics.foreign, None),
            Err(Drop::Malformed) => (&mut statistics.malformed, None),
            Err(Drop::Late) => (&mut statistics.late, None),
        };
        *count = count.wrapping_add(1);
        received
    }

    /// The message in the complete payload.
    fn receive(&mut self) -> Result<Received<M>, Drop> {
        let (covered, _) = self.payload.split_last_chunk::<4>().ok_or(Drop::Damaged)?;
        if !self.checksum.is_intact() {
            return Err(Drop::Damaged);
        }
        let (&[tag, low, high], message) = covered.split_first_chunk().ok_or(Drop::Damaged)?;
        if tag != M::TAG {
            return Err(Drop::Foreign);
        }
        let Ok((message, [])) = postcard::take_from_bytes::<M>(message) else {
            return Err(Drop::Malformed);
        };
        let sequence = u16::from_le_bytes([low, high]);
        self.follow(sequence, message.begins_numbering())?;
        Ok(Received { sequence, message })
    }

    /// Checks that the number is ahead of the last one, and counts what was skipped.
    fn follow(&mut self, sequence: u16, begins: bool) -> Result<(), Drop> {
        if let (Some(last), false) = (self.last, begins) {
            let ahead = sequence.wrapping_sub(last);
            if ahead == 0 || ahead > u16::MAX - LATE_WINDOW {
                return Err(Drop::Late);
            }
            if ahead <= u16::MAX / 2 {
                self.statistics.lost = self.statistics.lost.wrapping_add(u32::from(ahead - 1));
            }
        }
        self.last = Some(sequence);
        Ok(())
    }
}
