//! From bytes to packets: framing of MAVLink 1 and 2, in bounded memory and time.

use mavlink::{MAV_STX, MAV_STX_V2, calculate_crc};

use crate::frame::{FRAME_MAX, Frame, HEADER, PAYLOAD_MAX, SIGNED};
use crate::message::extra_crc;
use crate::signing::{SIGNATURE, Trailer};

/// Bytes before the payload in MAVLink 1.
const HEADER_1: usize = 6;

/// A message that has passed its checksum; its numbers are whatever the other side sent.
#[derive(Clone, Copy, Debug)]
pub struct Packet {
    /// System that sent it.
    pub system: u8,
    /// Component that sent it.
    pub component: u8,
    /// Number of the message.
    pub id: u32,
    payload: [u8; PAYLOAD_MAX],
    len: usize,
    /// The first bytes and the checksum of the frame, which its signature covers.
    pub(crate) header: [u8; HEADER],
    pub(crate) checksum: [u8; 2],
    /// End of a signed frame; it has not been checked.
    pub(crate) trailer: Option<Trailer>,
}

impl Packet {
    /// A packet of its parts, not signed.
    #[cfg(test)]
    pub(crate) fn of_parts(system: u8, component: u8, id: u32, bytes: &[u8]) -> Self {
        let mut payload = [0; PAYLOAD_MAX];
        payload[..bytes.len()].copy_from_slice(bytes);
        let (len, header, checksum) = (bytes.len(), [0; HEADER], [0; 2]);
        Self { system, component, id, payload, len, header, checksum, trailer: None }
    }

    /// The payload; zeros at its end may have been left out.
    #[must_use]
    pub fn payload(&self) -> &[u8] {
        self.payload.get(..self.len).unwrap_or_default()
    }

    /// The frame that it came in, byte for byte: for those who pass it on.
    #[must_use]
    pub fn frame(&self) -> Frame {
        let first = if self.header[0] == MAV_STX_V2 { HEADER } else { HEADER_1 };
        let header = self.header.get(..first).unwrap_or_default();
        let trailer = self.trailer.map(Trailer::to_bytes);
        let signature = trailer.as_ref().map_or(&[][..], |bytes| bytes);
        Frame::of_parts(&[header, self.payload(), &self.checksum, signature])
    }

    /// The byte at `index` of the whole payload.
    #[must_use]
    pub(crate) fn byte(&self, index: usize) -> u8 {
        self.payload().get(index).copied().unwrap_or(0)
    }

    pub(crate) fn u16_at(&self, index: usize) -> u16 {
        u16::from_le_bytes([self.byte(index), self.byte(index + 1)])
    }

    pub(crate) fn i32_at(&self, index: usize) -> i32 {
        // wcet: at most 4 iterations
        i32::from_le_bytes([0, 1, 2, 3].map(|i| self.byte(index + i)))
    }

    pub(crate) fn f32_at(&self, index: usize) -> f32 {
        // wcet: at most 4 iterations
        f32::from_le_bytes([0, 1, 2, 3].map(|i| self.byte(index + i)))
    }
}

/// Shape of a frame, from its first bytes.
struct Shape {
    header: usize,
    payload: usize,
    whole: usize,
    id: u32,
    system: u8,
    component: u8,
    signed: bool,
}

/// Framing of one line of bytes: a port, a connection.
#[derive(Clone, Debug)]
pub struct Decoder {
    buffer: [u8; FRAME_MAX],
    len: usize,
    damaged: u32,
    unknown: u32,
}

impl Decoder {
    /// Nothing has come.
    #[must_use]
    pub const fn new() -> Self {
        Self { buffer: [0; FRAME_MAX], len: 0, damaged: 0, unknown: 0 }
    }

    /// Starts of frames that were none, or failed the checksum.
    #[must_use]
    pub fn damaged(&self) -> u32 {
        self.damaged
    }

    /// Frames of messages that are not understood.
    #[must_use]
    pub fn unknown(&self) -> u32 {
        self.unknown
    }

    /// Takes the next byte; the packet that it completes, if any.
    pub fn push(&mut self, byte: u8) -> Option<Packet> {
        if self.len == self.buffer.len() {
            self.drop_front(1); // never: a frame is no longer than the buffer
        }
        if let Some(place) = self.buffer.get_mut(self.len) {
            *place = byte;
            self.len += 1;
        }
        self.next_packet()
    }

    /// Tells that the line has been silent for longer than a frame takes: what has begun will not go on. The
    /// packet behind it, if one is whole.
    ///
    /// Without this the rest of a frame whose end was lost takes the next message with it until more bytes come.
    pub fn resume(&mut self) -> Option<Packet> {
        if self.len == 0 {
            return None;
        }
        self.damaged = self.damaged.wrapping_add(1);
        self.skip_to_start();
        self.next_packet()
    }

    /// The first whole frame that is held; what is in front of it is dropped.
    fn next_packet(&mut self) -> Option<Packet> {
        // Each turn takes a byte at least, so there are at most as many as the buffer is long.
        // wcet: at most 281 iterations
        for _ in 0..=FRAME_MAX {
            let shape = match self.shape()? {
                Ok(shape) => shape,
                Err(()) => {
                    self.skip_to_start();
                    continue;
                }
            };
            if self.len < shape.whole {
                return None;
            }
            let Some(extra) = extra_crc(shape.id) else {
                // Its length cannot be trusted: without the extra byte there is no checksum.
                self.unknown = self.unknown.wrapping_add(1);
                self.skip_to_start();
                continue;
            };
            if !self.checks(&shape, extra) {
                self.damaged = self.damaged.wrapping_add(1);
                self.skip_to_start();
                continue;
            }
            let packet = self.packet(&shape);
            self.drop_front(shape.whole);
            return Some(packet);
        }
        None
    }

    fn at(&self, index: usize) -> u8 {
        self.buffer.get(index).copied().unwrap_or(0)
    }

    /// The frame at the front; none while its header is not complete, an error if there is none.
    fn shape(&self) -> Option<Result<Shape, ()>> {
        if self.len == 0 {
            return None;
        }
        let payload = usize::from(self.at(1));
        match self.at(0) {
            MAV_STX if self.len >= HEADER_1 => Some(Ok(Shape {
                header: HEADER_1,
                payload,
                whole: HEADER_1 + payload + 2,
                id: self.at(5).into(),
                system: self.at(3),
                component: self.at(4),
                signed: false,
            })),
            MAV_STX_V2 if self.len >= 10 => {
                let flags = self.at(2);
                if flags & !SIGNED != 0 {
                    return Some(Err(()));
                }
                let signed = flags & SIGNED != 0;
                let signature = if signed { SIGNATURE } else { 0 };
                Some(Ok(Shape {
                    header: HEADER,
                    payload,
                    whole: HEADER + payload + 2 + signature,
                    id: u32::from_le_bytes([self.at(7), self.at(8), self.at(9), 0]),
                    system: self.at(5),
                    component: self.at(6),
                    signed,
                }))
            }
            MAV_STX | MAV_STX_V2 => None,
            _ => Some(Err(())),
        }
    }

    fn checks(&self, shape: &Shape, extra: u8) -> bool {
        let end = shape.header + shape.payload;
        let crc = calculate_crc(self.buffer.get(1..end).unwrap_or_default(), extra);
        crc.to_le_bytes() == [self.at(end), self.at(end + 1)]
    }

    fn packet(&self, shape: &Shape) -> Packet {
        let Shape { id, system, component, payload: len, header: start, signed, .. } = *shape;
        let end = start + len;
        let mut payload = [0; PAYLOAD_MAX];
        let bytes = self.buffer.iter().skip(start).take(len);
        // wcet: at most 255 iterations
        payload.iter_mut().zip(bytes).for_each(|(place, byte)| *place = *byte);
        let trailer = signed.then(|| Trailer::of(self.array(end + 2)));
        let (header, checksum) = (self.array(0), self.array(end));
        Packet { system, component, id, payload, len, header, checksum, trailer }
    }

    /// The bytes from `start` on.
    fn array<const N: usize>(&self, start: usize) -> [u8; N] {
        core::array::from_fn(|index| self.at(start + index))
    }

    /// Drops the front up to the next byte that may start a frame.
    fn skip_to_start(&mut self) {
        let held = self.buffer.get(..self.len).unwrap_or_default();
        let start = |byte: &u8| matches!(*byte, MAV_STX | MAV_STX_V2);
        // wcet: at most 280 iterations
        let next = held.iter().skip(1).position(start).map_or(self.len, |at| at + 1);
        self.drop_front(next);
    }

    fn drop_front(&mut self, count: usize) {
        let count = count.min(self.len);
        self.len -= count;
        // wcet: at most 280 iterations
        for index in 0..self.len {
            let byte = self.at(index + count);
            if let Some(place) = self.buffer.get_mut(index) {
                *place = byte;
            }
        }
    }
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}
