//! Signatures of MAVLink 2 (`mavlink.io/en/guide/message_signing.html`): those of the frames that are sent, and
//! the check of those that come.
//!
//! ```text
//! signature = first 48 bits of SHA-256(key | frame from its first byte to the checksum | link | timestamp)
//! ```
//!
//! A timestamp counts 10 us since 2015-01-01 and grows from message to message of a stream, which is a
//! system, a component and one of its links. A message whose timestamp does not grow is a replay; that of a new
//! stream must be at most a minute behind the newest one known.

use core::fmt;

use heapless::Vec;
use mavlink::dialects::common::SETUP_SIGNING_DATA;
use sha2::{Digest, Sha256};

use crate::decoder::Packet;
use crate::status_text::{Part, Severity};

/// Streams that are remembered.
const STREAMS: usize = 8;
/// Time by which a new stream may be behind (10 us): one minute.
const BEHIND_MAX: u64 = 60 * 100_000;
/// Largest timestamp: it has 48 bits.
const TIMESTAMP_MAX: u64 = (1 << 48) - 1;
/// Bytes of a key.
const KEY: usize = 32;
/// Bytes of link, timestamp and signature.
pub(crate) const SIGNATURE: usize = 13;
/// Shortest time between two sentences about refusals (us).
const SAY_EVERY: u64 = 5_000_000;

/// The secret that both sides share.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct SigningKey([u8; KEY]);

impl SigningKey {
    /// The key of these bytes; none if all are zero, MAVLink's mark for no key.
    #[must_use]
    pub fn new(bytes: [u8; KEY]) -> Option<Self> {
        bytes.iter().any(|byte| *byte != 0).then_some(Self(bytes))
    }

    /// Its bytes, for those who keep it.
    #[must_use]
    pub fn to_bytes(self) -> [u8; KEY] {
        self.0
    }
}

impl fmt::Debug for SigningKey {
    /// Never shows the key.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("SigningKey(..)")
    }
}

/// Line that a packet came over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// Nobody else reads it: a cable, the loopback interface. A key may be set over it.
    Secure,
    /// A radio or a network.
    Open,
}

/// Messages that were refused.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SigningRefusals {
    /// Without a signature.
    pub unsigned: u32,
    /// With a signature of another key, or of another message.
    pub forged: u32,
    /// With a timestamp that is not newer than the last one of its stream, or with a new stream's that is more
    /// than a minute old.
    pub replayed: u32,
    /// Of a new stream while as many as can be remembered were active within the last minute.
    pub streams: u32,
}

impl SigningRefusals {
    fn count(&mut self, refusal: Refused) {
        let counter = match refusal {
            Refused::Unsigned => &mut self.unsigned,
            Refused::Forged => &mut self.forged,
            Refused::Replayed => &mut self.replayed,
            Refused::Streams => &mut self.streams,
        };
        *counter = counter.saturating_add(1);
    }
}

/// Reason for which a packet is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refused {
    Unsigned,
    Forged,
    Replayed,
    Streams,
}

impl Refused {
    pub(crate) fn as_str(self) -> &'static str {
        match self {
            Self::Unsigned => "not signed",
            Self::Forged => "signature of another key",
            Self::Replayed => "signed before: clocks differ, or a replay",
            Self::Streams => "too many senders",
        }
    }
}

/// A stream of signed messages: system, component and link, and its newest timestamp.
#[derive(Clone, Copy, Debug)]
struct Stream {
    id: (u8, u8, u8),
    newest: u64,
}

/// Key, clock and streams.
#[derive(Clone, Debug)]
pub(crate) struct Signing {
    key: Option<SigningKey>,
    link: u8,
    /// The newest timestamp known: of the caller's clock, or of a message either way.
    timestamp: u64,
    streams: Vec<Stream, STREAMS>,
    refusals: SigningRefusals,
    said: Option<u64>,
}

/// Link, timestamp and signature at the end of a signed frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trailer {
    pub link: u8,
    pub timestamp: u64,
    pub signature: [u8; 6],
}

impl Trailer {
    pub(crate) fn of([link, t0, t1, t2, t3, t4, t5, signature @ ..]: [u8; SIGNATURE]) -> Self {
        let timestamp = u64::from_le_bytes([t0, t1, t2, t3, t4, t5, 0, 0]);
        Self { link, timestamp, signature }
    }

    pub(crate) fn to_bytes(self) -> [u8; SIGNATURE] {
        let [t0, t1, t2, t3, t4, t5, ..] = self.timestamp.to_le_bytes();
        let [s0, s1, s2, s3, s4, s5] = self.signature;
        [self.link, t0, t1, t2, t3, t4, t5, s0, s1, s2, s3, s4, s5]
    }
}

impl SigningKey {
    /// The signature of a frame in `parts`, up to its checksum.
    fn sign(&self, parts: &[&[u8]], link: u8, timestamp: u64) -> Trailer {
        let mut hash = Sha256::new();
        hash.update(self.0);
        for part in parts {
            hash.update(part);
        }
        let unsigned = Trailer { link, timestamp, signature: [0; 6] };
        let [link_and_timestamp @ .., _, _, _, _, _, _] = unsigned.to_bytes();
        hash.update(link_and_timestamp);
        let [s0, s1, s2, s3, s4, s5, ..] = hash.finalize().0;
        Trailer { signature: [s0, s1, s2, s3, s4, s5], ..unsigned }
    }
}

impl Signing {
    pub(crate) fn new(key: Option<SigningKey>, link: u8) -> Self {
        let refusals = SigningRefusals::default();
        Self { key, link, timestamp: 0, streams: Vec::new(), refusals, said: None }
    }

    pub(crate) fn key(&self) -> Option<SigningKey> {
        self.key
    }

    pub(crate) fn refusals(&self) -> SigningRefusals {
        self.refusals
    }

    /// Follows the caller's clock, which may be behind what stations have sent.
    pub(crate) fn follow_clock(&mut self, timestamp: u64) {
        self.timestamp = self.timestamp.max(timestamp.min(TIMESTAMP_MAX));
    }

    /// The signature of the next frame, in `parts` up to its checksum; none without a key.
    pub(crate) fn sign(&mut self, parts: &[&[u8]]) -> Option<Trailer> {
        let key = self.key?;
        self.timestamp = (self.timestamp + 1).min(TIMESTAMP_MAX);
        Some(key.sign(parts, self.link, self.timestamp))
    }

    /// Accepts a packet that needs no signature or has a valid one, which makes every older one of its stream
    /// invalid.
    pub(crate) fn accept(&mut self, packet: &Packet) -> Result<(), Refused> {
        let Some(key) = self.key else { return Ok(()) };
        let result = self.check(&key, packet);
        if let Err(refusal) = result {
            self.refusals.count(refusal);
        }
        result
    }

    fn check(&mut self, key: &SigningKey, packet: &Packet) -> Result<(), Refused> {
        let trailer = packet.trailer.ok_or(Refused::Unsigned)?;
        let Trailer { link, timestamp, signature } = trailer;
        let parts = [packet.header.as_slice(), packet.payload(), &packet.checksum];
        let expected = key.sign(&parts, link, timestamp).signature;
        // Every byte is compared, so that the time tells nothing.
        let pairs = expected.iter().zip(&signature);
        if pairs.fold(0, |difference, (a, b)| difference | (a ^ b)) != 0 {
            return Err(Refused::Forged);
        }
        let id = (packet.system, packet.component, link);
        // wcet: at most STREAMS iterations
        match self.streams.iter_mut().find(|stream| stream.id == id) {
            Some(stream) if timestamp > stream.newest => stream.newest = timestamp,
            Some(_) => return Err(Refused::Replayed),
            None => self.begin_stream(Stream { id, newest: timestamp })?,
        }
        self.timestamp = self.timestamp.max(timestamp);
        Ok(())
    }

    fn begin_stream(&mut self, stream: Stream) -> Result<(), Refused> {
        let oldest = self.timestamp.saturating_sub(BEHIND_MAX);
        if stream.newest < oldest {
            return Err(Refused::Replayed);
        }
        // Those that are more than a minute behind may be forgotten: their messages are too old for a new one.
        // wcet: at most STREAMS iterations
        self.streams.retain(|known| known.newest >= oldest);
        self.streams.push(stream).map_err(|_| Refused::Streams)
    }

    /// Puts another key in force, or none.
    fn set(&mut self, key: Option<SigningKey>, timestamp: u64) {
        if key != self.key {
            self.streams.clear();
        }
        self.key = key;
        self.follow_clock(timestamp);
    }

    /// `true` if a refusal is to be told about at `time` (us).
    pub(crate) fn says(&mut self, time: u64) -> bool {
        let due = self.said.is_none_or(|said| time.saturating_sub(said) >= SAY_EVERY);
        if due {
            self.said = Some(time);
        }
        due
    }
}

impl crate::Protocol<'_> {
    /// Puts another key in force, or none, from `timestamp` on; what waits to be sent is dropped.
    pub fn set_signing_key(&mut self, key: Option<SigningKey>, timestamp: u64) {
        let changed = self.signing.key() != key;
        self.signing.set(key, timestamp);
        if changed {
            self.drop_answers();
        }
    }

    /// The key in force.
    #[must_use]
    pub fn signing_key(&self) -> Option<SigningKey> {
        self.signing.key()
    }

    /// The newest timestamp known: of the clock, or of a message either way.
    #[must_use]
    pub fn signing_time(&self) -> u64 {
        self.signing.timestamp
    }

    /// Sets the key that a station sends, on the ground and over a line that nobody else reads.
    pub(crate) fn set_up_signing<V: crate::Vehicle>(
        &mut self,
        data: &SETUP_SIGNING_DATA,
        line: Line,
        vehicle: &mut V,
    ) {
        let refused = match (line, vehicle.view().mode) {
            (Line::Open, _) => Some("the line is not secure"),
            (Line::Secure, ctrl_core::mode::Mode::Disarmed) => None,
            (Line::Secure, _) => Some("only disarmed"),
        };
        if let Some(reason) = refused {
            return self.say(
                Severity::Warning,
                &[Part::Text("signing key refused: "), Part::Text(reason)],
            );
        }
        let key = SigningKey::new(data.secret_key);
        let before = self.signing.key();
        self.set_signing_key(key, data.initial_timestamp);
        match (before, key) {
            (before, key) if before == key => {} // sent again, since nothing acknowledges it
            (_, Some(_)) => self.say(Severity::Info, &[Part::Text("signing key set")]),
            (_, None) => self.say(Severity::Info, &[Part::Text("signing is off")]),
        }
    }
}
