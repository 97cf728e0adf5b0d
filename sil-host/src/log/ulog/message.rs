//! Messages of ULog: a length (u16), a kind, a body; all numbers little-endian.

use std::io;

/// First bytes of a file: `ULog`, three more of the magic, and version 1 of the format.
pub const MAGIC: [u8; 8] = [b'U', b'L', b'o', b'g', 0x01, 0x12, 0x35, 1];

/// The kinds that are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// Flags of newer parts of the format: none is in use.
    FlagBits = b'B',
    /// Names and types of a topic's fields.
    Format = b'F',
    /// A fact about the whole file.
    Information = b'I',
    /// A fact in several parts, or one of several.
    MultiInformation = b'M',
    /// A parameter's value.
    Parameter = b'P',
    /// Gives a topic the number that its data carry.
    Subscription = b'A',
    /// The values of a topic.
    Data = b'D',
    /// A line of text.
    Logging = b'L',
}

/// Appends a message to `out`; `body` writes what follows length and kind.
///
/// # Errors
/// When the body is longer than a message can be; then nothing is appended.
pub fn message(out: &mut Vec<u8>, kind: Kind, body: impl FnOnce(&mut Vec<u8>)) -> io::Result<()> {
    let start = out.len();
    out.extend([0, 0, kind as u8]);
    body(out);
    let length = out.len() - start - 3;
    let Ok(short) = u16::try_from(length) else {
        out.truncate(start);
        let message = format!("a message of {length} bytes is longer than ULog's 65535");
        return Err(io::Error::new(io::ErrorKind::InvalidData, message));
    };
    out[start..start + 2].copy_from_slice(&short.to_le_bytes());
    Ok(())
}

/// Appends a key as `type name` after its length, as facts and parameters have it.
pub fn key(out: &mut Vec<u8>, kind: &str, name: &str) {
    let text = format!("{kind} {name}");
    debug_assert!(text.len() <= usize::from(u8::MAX), "{text}");
    out.push(text.len() as u8);
    out.extend_from_slice(text.as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_length_kind_and_body() {
        let mut out = vec![7];
        message(&mut out, Kind::Parameter, |body| {
            key(body, "float", "k4");
            body.extend(0.5_f32.to_le_bytes());
        })
        .unwrap();
        let expected = [&[7, 13, 0, b'P', 8][..], b"float k4", &[0, 0, 0, 0x3f]].concat();
        assert_eq!(out, expected);
    }

    #[test]
    fn a_body_may_have_65535_bytes_and_no_more() {
        let mut out = Vec::new();
        message(&mut out, Kind::Logging, |body| body.resize(3 + 65_535, b'x')).unwrap();
        assert_eq!((out.len(), &out[..3]), (65_538, &[0xff, 0xff, b'L'][..]));
        let mut out = vec![7];
        let error = message(&mut out, Kind::Logging, |body| body.resize(4 + 65_536, 0));
        assert!(error.unwrap_err().to_string().contains("65536 bytes"));
        assert_eq!(out, [7]);
    }
}
