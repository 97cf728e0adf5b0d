//! Evidence of a fault for the next boot.
//!
//! Pure encoding: the report becomes 32-bit words with a mark and a checksum, so that power-on
//! noise or a half-written record is not taken for a fault. `fault` keeps the words in a RAM region
//! that no start-up code touches.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use heapless::String;
use link::{FaultKind, FaultReport, REGISTERS, TEXT_MAX};

/// Size of an encoded report in words: checksum, mark, kind, uptime, line, length, registers, text.
pub const WORDS: usize = 6 + REGISTERS + TEXT_MAX / 4;

/// Marks a record.
const MARK: u32 = u32::from_be_bytes(*b"GYRF");
const CHECKSUM: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Names of [`FaultReport::registers`], in order.
pub const REGISTER_NAMES: [&str; REGISTERS] = [
    "r0", "r1", "r2", "r3", "r12", "lr", "pc", "xpsr", "cfsr", "hfsr", "mmfar", "bfar", "msp",
    "icsr",
];

/// The kinds, in the order of their numbers in a record.
const KINDS: [FaultKind; 4] =
    [FaultKind::Panic, FaultKind::HardFault, FaultKind::UnexpectedInterrupt, FaultKind::Watchdog];

/// The kind in words.
#[must_use]
pub const fn kind_name(kind: FaultKind) -> &'static str {
    match kind {
        FaultKind::Panic => "panic",
        FaultKind::HardFault => "hard fault",
        FaultKind::UnexpectedInterrupt => "unexpected interrupt",
        FaultKind::Watchdog => "watchdog",
    }
}

/// A report without text.
#[must_use]
pub const fn report(
    kind: FaultKind,
    uptime_ticks: u32,
    registers: [u32; REGISTERS],
) -> FaultReport {
    FaultReport { kind, uptime_ticks, registers, line: 0, text: String::new() }
}

/// Appends as much of `more` as fits; a character is kept whole or not at all.
pub fn append<const N: usize>(text: &mut String<N>, more: &str) {
    // wcet: at most 4 iterations
    let room = more.floor_char_boundary(text.capacity() - text.len());
    if let Some(fitting) = more.get(..room) {
        let _ = text.push_str(fitting);
    }
}

/// The record of a report.
#[must_use]
pub fn encode(report: &FaultReport) -> [u32; WORDS] {
    let mut bytes = report.text.bytes();
    let text = core::iter::from_fn(|| {
        let first = bytes.next()?;
        let mut rest = || bytes.next().unwrap_or(0);
        Some(u32::from_le_bytes([first, rest(), rest(), rest()]))
    });
    let kind = KINDS.iter().take_while(|kind| **kind != report.kind).count() as u32;
    let head = [MARK, kind, report.uptime_ticks, report.line, report.text.len() as u32];
    let content = head.into_iter().chain(report.registers).chain(text);
    let mut words = [0; WORDS];
    for (word, value) in words[1..].iter_mut().zip(content) {
        *word = value;
    }
    words[0] = checksum(&words);
    words
}

/// The report in `words`, if there is a whole record.
#[must_use]
pub fn decode(words: &[u32; WORDS]) -> Option<FaultReport> {
    let [sum, MARK, kind, uptime_ticks, line, length, rest @ ..] = words else { return None };
    if *sum != checksum(words) {
        return None;
    }
    let (registers, text) = rest.split_first_chunk::<REGISTERS>()?;
    let mut report = report(*KINDS.get(*kind as usize)?, *uptime_ticks, *registers);
    report.line = *line;
    let mut bytes = [0; TEXT_MAX];
    for (chunk, word) in bytes.chunks_exact_mut(4).zip(text) {
        chunk.copy_from_slice(&word.to_le_bytes());
    }
    append(&mut report.text, core::str::from_utf8(bytes.get(..*length as usize)?).ok()?);
    Some(report)
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

    fn example() -> FaultReport {
        let mut registers = [0; REGISTERS];
        for (i, register) in registers.iter_mut().enumerate() {
            *register = 0x0800_0000 + i as u32;
        }
        let mut report = report(FaultKind::Panic, 12_345, registers);
        report.line = 77;
        append(&mut report.text, "index out of bounds at firmware/src/ä.rs");
        report
    }

    #[test]
    fn a_report_survives_encoding() {
        assert_eq!(decode(&encode(&example())), Some(example()));
        for kind in KINDS {
            let bare = report(kind, 0, [u32::MAX; REGISTERS]);
            assert_eq!(decode(&encode(&bare)), Some(bare));
        }
    }

    #[test]
    fn a_full_text_is_cut_at_a_character() {
        let mut report = report(FaultKind::Panic, 1, [0; REGISTERS]);
        for _ in 0..40 {
            append(&mut report.text, "xäö");
        }
        assert!(report.text.len() > TEXT_MAX - 2);
        assert_eq!(decode(&encode(&report)), Some(report));
    }

    #[test]
    fn every_flipped_bit_is_noticed() {
        let words = encode(&example());
        for bit in 0..WORDS * 32 {
            let mut damaged = words;
            damaged[bit / 32] ^= 1 << (bit % 32);
            assert_eq!(decode(&damaged), None, "bit {bit}");
        }
    }

    #[test]
    fn memory_after_power_on_is_no_evidence() {
        for noise in [0, u32::MAX, 0xdead_beef, MARK] {
            assert_eq!(decode(&[noise; WORDS]), None);
        }
    }
}
