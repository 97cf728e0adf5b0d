//! Frames of MAVLink 2 to be sent.

use mavlink::{MAV_STX_V2, MavlinkVersion, MessageData, calculate_crc};

use crate::signing::Signing;

/// Longest frame (bytes): header, payload, checksum and signature.
pub const FRAME_MAX: usize = 280;
/// Bytes before the payload.
pub(crate) const HEADER: usize = 10;
/// Longest payload (bytes).
pub(crate) const PAYLOAD_MAX: usize = 255;
/// Flag of a signed frame, the only incompatible one that is understood.
pub(crate) const SIGNED: u8 = 1;

/// A frame, ready to be sent.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    bytes: [u8; FRAME_MAX],
    len: usize,
}

/// Sender of a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sender {
    pub system: u8,
    pub component: u8,
    pub sequence: u8,
}

impl Frame {
    /// The bytes on the wire.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or_default()
    }

    /// The frame of a message, with the extension fields `extension` after its own.
    pub(crate) fn new<D: MessageData>(
        sender: Sender,
        data: &D,
        extension: &[u8],
        signed: bool,
    ) -> Self {
        let mut payload = [0; PAYLOAD_MAX];
        // As long as any payload: `ser` finds room.
        data.ser(MavlinkVersion::V2, &mut payload);
        let end = D::ENCODED_LEN + extension.len();
        if let Some(after) = payload.get_mut(D::ENCODED_LEN..end) {
            after.copy_from_slice(extension);
        }
        let payload = payload.get(..end).unwrap_or(&payload);
        Self::of_payload(sender, (D::ID, D::EXTRA_CRC), payload, signed)
    }

    /// The frame of a payload, which is [signed](Self::sign) when it is sent, if `signed`; zeros at its end are left out, but for the first byte.
    pub(crate) fn of_payload(
        sender: Sender,
        message: (u32, u8),
        payload: &[u8],
        signed: bool,
    ) -> Self {
        let (id, extra_crc) = message;
        // wcet: at most 255 iterations
        let used = payload.iter().rposition(|byte| *byte != 0).map_or(1, |last| last + 1);
        let used = used.min(payload.len()).min(PAYLOAD_MAX);
        let mut frame = Self { bytes: [0; FRAME_MAX], len: 0 };
        let [id0, id1, id2, _] = id.to_le_bytes();
        let Sender { system, component, sequence } = sender;
        let flags = if signed { SIGNED } else { 0 };
        frame.append(&[MAV_STX_V2, used as u8, flags, 0, sequence]);
        frame.append(&[system, component, id0, id1, id2]);
        frame.append(payload.get(..used).unwrap_or_default());
        let crc = calculate_crc(frame.as_bytes().get(1..).unwrap_or_default(), extra_crc);
        frame.append(&crc.to_le_bytes());
        frame
    }

    /// The frame that consists of `parts`.
    pub(crate) fn of_parts(parts: &[&[u8]]) -> Self {
        let mut frame = Self { bytes: [0; FRAME_MAX], len: 0 };
        parts.iter().for_each(|part| frame.append(part));
        frame
    }

    /// Adds the signature, if there is a key: at the moment of sending, since its time must grow.
    pub(crate) fn sign(&mut self, signing: &mut Signing) {
        if let Some(trailer) = signing.sign(&[self.as_bytes()]) {
            self.append(&trailer.to_bytes());
        }
    }

    /// Adds bytes at the end; a frame with all its parts has room for them.
    fn append(&mut self, bytes: &[u8]) {
        let free = self.bytes.iter_mut().skip(self.len);
        // wcet: at most FRAME_MAX iterations
        // wcet: at most FRAME_MAX bytes
        free.zip(bytes).for_each(|(place, byte)| *place = *byte);
        self.len = (self.len + bytes.len()).min(FRAME_MAX);
    }
}
