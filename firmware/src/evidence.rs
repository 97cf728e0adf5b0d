//! What a fault leaves behind for the next boot.
//!
//! Pure encoding: the record becomes 32-bit words with a mark and a checksum, so that power-on
//! noise or a half-written record is not taken for a fault. [`crate::fault`] keeps the words in a
//! RAM region that no start-up code touches.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use heapless::String;

/// Longest text that is kept [bytes].
pub const TEXT_CAPACITY: usize = 96;
/// Number of registers that are kept.
pub const REGISTERS: usize = 14;
/// Size of an encoded record in 32-bit words: mark, cause, uptime, line, length, checksum, ...
pub const WORDS: usize = 6 + REGISTERS + TEXT_CAPACITY / 4;

/// Marks a record.
const MARK: u32 = u32::from_be_bytes(*b"GYRF");
const CHECKSUM: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// What went wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Cause {
    /// The program panicked.
    Panic = 1,
    /// The processor took a hard fault.
    HardFault = 2,
    /// An interrupt or exception without a handler.
    UnexpectedInterrupt = 3,
}

impl Cause {
    fn from_word(word: u32) -> Option<Self> {
        [Self::Panic, Self::HardFault, Self::UnexpectedInterrupt]
            .into_iter()
            .find(|cause| *cause as u32 == word)
    }

    /// The cause in words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Panic => "panic",
            Self::HardFault => "hard fault",
            Self::UnexpectedInterrupt => "unexpected interrupt",
        }
    }
}

/// Names of [`Evidence::registers`], in order.
pub const REGISTER_NAMES: [&str; REGISTERS] = [
    "r0", "r1", "r2", "r3", "r12", "lr", "pc", "xpsr", "cfsr", "hfsr", "mmfar", "bfar", "msp",
    "icsr",
];

/// A fault, as the next boot sees it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Evidence {
    /// What went wrong.
    pub cause: Cause,
    /// Control ticks since the start.
    pub uptime_ticks: u32,
    /// In the order of [`REGISTER_NAMES`]; zero where a cause does not know a register.
    pub registers: [u32; REGISTERS],
    /// Source line of a panic, else zero.
    pub line: u32,
    /// Message and file of a panic, cut to [`TEXT_CAPACITY`].
    pub text: String<TEXT_CAPACITY>,
}

impl Evidence {
    /// Evidence without text.
    #[must_use]
    pub const fn new(cause: Cause, uptime_ticks: u32, registers: [u32; REGISTERS]) -> Self {
        Self { cause, uptime_ticks, registers, line: 0, text: String::new() }
    }

    /// Appends as much of `text` as fits; a character is kept whole or not at all.
    pub fn append(&mut self, text: &str) {
        for character in text.chars() {
            if self.text.push(character).is_err() {
                return;
            }
        }
    }

    /// The record as words.
    #[must_use]
    pub fn encode(&self) -> [u32; WORDS] {
        let mut words = [0; WORDS];
        let mut bytes = self.text.bytes();
        let text_words = core::iter::from_fn(|| {
            let first = bytes.next()?;
            let mut rest = || bytes.next().unwrap_or(0);
            Some(u32::from_le_bytes([first, rest(), rest(), rest()]))
        });
        let head = [MARK, self.cause as u32, self.uptime_ticks, self.line, self.text.len() as u32];
        let content = head.into_iter().chain(self.registers).chain(text_words);
        for (word, value) in words[1..].iter_mut().zip(content) {
            *word = value;
        }
        words[0] = checksum(&words);
        words
    }

    /// The record in `words`, if there is a whole one.
    #[must_use]
    pub fn decode(words: &[u32; WORDS]) -> Option<Self> {
        let [sum, MARK, cause, uptime_ticks, line, length, rest @ ..] = words else { return None };
        if *sum != checksum(words) {
            return None;
        }
        let (registers, text) = rest.split_first_chunk::<REGISTERS>()?;
        let mut evidence = Self::new(Cause::from_word(*cause)?, *uptime_ticks, *registers);
        evidence.line = *line;
        let mut bytes = [0; TEXT_CAPACITY];
        for (chunk, word) in bytes.chunks_exact_mut(4).zip(text) {
            chunk.copy_from_slice(&word.to_le_bytes());
        }
        evidence.append(core::str::from_utf8(bytes.get(..*length as usize)?).ok()?);
        Some(evidence)
    }
}

/// Checksum of all words but the first, which holds it.
fn checksum(words: &[u32; WORDS]) -> u32 {
    let mut digest = CHECKSUM.digest();
    for word in &words[1..] {
        digest.update(&word.to_le_bytes());
    }
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Evidence {
        let mut registers = [0; REGISTERS];
        for (i, register) in registers.iter_mut().enumerate() {
            *register = 0x0800_0000 + i as u32;
        }
        let mut evidence = Evidence::new(Cause::Panic, 12_345, registers);
        evidence.line = 77;
        evidence.append("index out of bounds at firmware/src/ä.rs");
        evidence
    }

    #[test]
    fn a_record_survives_encoding() {
        assert_eq!(Evidence::decode(&example().encode()), Some(example()));
        let bare = Evidence::new(Cause::HardFault, 0, [u32::MAX; REGISTERS]);
        assert_eq!(Evidence::decode(&bare.encode()), Some(bare));
    }

    #[test]
    fn a_full_text_is_cut_at_a_character() {
        let mut evidence = Evidence::new(Cause::Panic, 1, [0; REGISTERS]);
        for _ in 0..40 {
            evidence.append("xäö");
        }
        assert!(evidence.text.len() > TEXT_CAPACITY - 2);
        assert_eq!(Evidence::decode(&evidence.encode()), Some(evidence));
    }

    #[test]
    fn every_flipped_bit_is_noticed() {
        let words = example().encode();
        for bit in 0..WORDS * 32 {
            let mut damaged = words;
            damaged[bit / 32] ^= 1 << (bit % 32);
            assert_eq!(Evidence::decode(&damaged), None, "bit {bit}");
        }
    }

    #[test]
    fn memory_after_power_on_is_no_evidence() {
        for noise in [0, u32::MAX, 0xdead_beef, MARK] {
            assert_eq!(Evidence::decode(&[noise; WORDS]), None);
        }
    }
}
