//! Sentences for the ground station.
//!
//! They are put together of parts, without `core::fmt`, whose calls through pointers no static walk can follow
//! and whose numbers take more flash than the rest of this module.

use ctrl_core::error::{Bound, ConfigError};
use ctrl_core::mode::safety::Hazards;
use heapless::{Deque, Vec};
use mavlink::dialects::common::{MavSeverity, STATUSTEXT_DATA};
use mavlink::types::CharArray;

/// Longest sentence (bytes); what is longer is cut.
const TEXT_MAX: usize = 96;
/// Bytes of a message.
const CHUNK: usize = 50;
/// Parts of a sentence; what is more is cut.
const PARTS_MAX: usize = 12;
/// Sentences that wait.
const WAITING: usize = 6;

/// Severity of a sentence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// As expected.
    Info,
    /// A request was refused.
    Warning,
    /// Something failed in flight.
    Critical,
}

/// A part of a sentence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part<'a> {
    /// Words.
    Text(&'a str),
    /// A whole number.
    Count(u32),
    /// A number, shown with at most four decimals.
    Number(f32),
    /// Names of hazards.
    Hazards(Hazards),
}

impl Part<'_> {
    /// Adds the part at the end; what does not fit is cut.
    fn append<const N: usize>(self, sentence: &mut Sentence<N>) {
        match self {
            Self::Text(text) => append(sentence, text),
            Self::Count(count) => append_count(sentence, count),
            Self::Number(number) => append_number(sentence, number),
            Self::Hazards(hazards) => {
                // wcet: at most 8 iterations
                for (index, name) in hazards.words().enumerate() {
                    append(sentence, if index == 0 { "" } else { ", " });
                    append(sentence, name);
                }
            }
        }
    }
}

/// The parameter of an error, its value and its bound.
pub(crate) fn explained(error: &ConfigError) -> [Part<'static>; 8] {
    use Part::{Number, Text};
    let (words, rest) = match error.bound {
        Bound::Finite => (", must be finite", None),
        Bound::Positive => (", must be positive", None),
        Bound::NotNegative => (", must be zero or positive", None),
        Bound::Below(limit) => (", must be below ", Some((limit, None))),
        Bound::AtMost(limit) => (", must be at most ", Some((limit, None))),
        Bound::AtLeast(limit) => (", must be at least ", Some((limit, None))),
        Bound::Inside(lower, upper) => (", must be in [", Some((lower, Some(upper)))),
        _ => (", must be inside its bound", None),
    };
    let lower = rest.map_or(Text(""), |(lower, _)| Number(lower));
    let upper = rest.and_then(|(_, upper)| upper);
    let (to, end) = if upper.is_some() { (", ", "]") } else { ("", "") };
    let (name, value, upper) = (error.parameter, error.value, upper.map_or(Text(""), Number));
    [Text(name), Text(" "), Number(value), Text(words), lower, Text(to), upper, Text(end)]
}

/// The text of a sentence.
type Sentence<const N: usize = TEXT_MAX> = Vec<u8, N>;

fn append<const N: usize>(sentence: &mut Sentence<N>, text: &str) {
    let room = N.saturating_sub(sentence.len());
    // At a boundary of characters, and there is room.
    let fits = text.get(..text.floor_char_boundary(room)).unwrap_or_default();
    // Each takes room of the sentence.
    // wcet: at most TEXT_MAX iterations in all of StatusTexts::push
    for byte in fits.bytes() {
        let _ = sentence.push(byte);
    }
}

/// At most ten digits.
#[inline(never)]
fn append_count<const N: usize>(sentence: &mut Sentence<N>, mut count: u32) {
    let mut digits = [b'0'; 10];
    let mut first = digits.len() - 1;
    // wcet: at most 10 iterations
    for (place, digit) in digits.iter_mut().enumerate().rev() {
        (*digit, first) = (b'0' + (count % 10) as u8, place);
        count /= 10;
        // wcet: at most 10 iterations
        if count == 0 {
            break;
        }
    }
    // wcet: at most 10 iterations
    for digit in digits.iter().skip(first) {
        let _ = sentence.push(*digit);
    }
}

/// Four decimals at most, and a power of ten where they do not suffice.
#[inline(never)]
fn append_number<const N: usize>(sentence: &mut Sentence<N>, number: f32) {
    if number.is_nan() {
        return append(sentence, "NaN");
    }
    if number < 0.0 {
        append(sentence, "-");
    }
    let (mut size, mut exponent) = (number.abs(), 0_i32);
    if size == f32::INFINITY {
        return append(sentence, "infinite");
    }
    // A number of single precision has 39 digits before its point or 45 after it.
    if size >= 1e6 || (size > 0.0 && size < 1e-3) {
        // wcet: at most 45 iterations
        for _ in 0..45 {
            match size {
                10.0.. => (size, exponent) = (size / 10.0, exponent + 1),
                ..1.0 => (size, exponent) = (size * 10.0, exponent - 1),
                _ => break,
            }
        }
    }
    let whole = size as u32;
    // The difference is exact.
    let parts = ((size - whole as f32) * 1e4 + 0.5) as u32;
    append_count(sentence, whole + parts / 10_000);
    let mut rest = parts % 10_000;
    if rest > 0 {
        append(sentence, ".");
    }
    let mut unit = 1_000;
    // wcet: at most 4 iterations
    while rest > 0 && unit > 0 {
        let _ = sentence.push(b'0' + (rest / unit) as u8);
        (rest, unit) = (rest % unit, unit / 10);
    }
    if exponent != 0 {
        append(sentence, if exponent < 0 { "e-" } else { "e" });
        append_count(sentence, exponent.unsigned_abs());
    }
}

/// Sentences that have not been sent.
#[derive(Clone, Debug)]
pub(crate) struct StatusTexts {
    waiting: Deque<(Severity, Sentence), WAITING>,
    /// Number of the sentence, and its part that comes next.
    number: u16,
    part: u8,
}

impl StatusTexts {
    pub(crate) const fn new() -> Self {
        Self { waiting: Deque::new(), number: 0, part: 0 }
    }

    /// Queues a sentence, unless too many wait or it is there already.
    #[inline(never)]
    pub(crate) fn push(&mut self, severity: Severity, parts: &[Part<'_>]) {
        let mut sentence = Sentence::new();
        // wcet: at most PARTS_MAX iterations
        parts.iter().take(PARTS_MAX).for_each(|part| part.append(&mut sentence));
        // wcet: at most TEXT_MAX bytes
        // wcet: at most TEXT_MAX iterations
        if self.waiting.back().is_none_or(|(_, last)| *last != sentence) {
            // More than a few sentences at once are a flood.
            let _ = self.waiting.push_back((severity, sentence));
        }
    }

    /// The next message with its extension fields.
    pub(crate) fn next(&mut self) -> Option<(STATUSTEXT_DATA, [u8; 3])> {
        let (severity, text) = self.waiting.front()?;
        let start = usize::from(self.part) * CHUNK;
        let bytes = text.as_slice();
        let mut chunk = [0; CHUNK];
        // wcet: at most CHUNK iterations
        for (place, byte) in chunk.iter_mut().zip(bytes.iter().skip(start)) {
            // wcet: at most CHUNK bytes
            *place = *byte;
        }
        let severity = match severity {
            Severity::Info => MavSeverity::MAV_SEVERITY_INFO,
            Severity::Warning => MavSeverity::MAV_SEVERITY_WARNING,
            Severity::Critical => MavSeverity::MAV_SEVERITY_CRITICAL,
        };
        // A sentence in one message has no number.
        let [low, high] = if bytes.len() > CHUNK { self.number.max(1) } else { 0 }.to_le_bytes();
        let part = self.part;
        if bytes.len() > start + CHUNK {
            self.part = self.part.saturating_add(1);
        } else {
            self.part = 0;
            self.number = self.number.wrapping_add(1);
            self.waiting.pop_front();
        }
        Some((STATUSTEXT_DATA { severity, text: CharArray::new(chunk) }, [low, high, part]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text<const N: usize>(sentence: &Sentence<N>) -> &str {
        core::str::from_utf8(sentence).unwrap()
    }

    fn shown(part: Part<'_>) -> std::string::String {
        let mut sentence = Sentence::<64>::new();
        part.append(&mut sentence);
        text(&sentence).into()
    }

    #[test]
    fn numbers_read_back_within_their_decimals() {
        for (number, text) in [
            (0.0, "0"),
            (-0.5, "-0.5"),
            (1.25, "1.25"),
            (0.0625, "0.0625"),
            (0.001, "0.001"),
            (10.0004, "10.0004"),
            (123_456.0, "123456"),
            (2e6, "2e6"),
            (-1.5e-5, "-1.5e-5"),
            (f32::MAX, "3.4028e38"),
            (f32::from_bits(1), "1.4013e-45"),
            (f32::NAN, "NaN"),
            (f32::NEG_INFINITY, "-infinite"),
        ] {
            assert_eq!(shown(Part::Number(number)), text, "{number}");
        }
        let mut number = 1e-9_f32;
        while number < 1e9 {
            let read: f32 = shown(Part::Number(number)).parse().unwrap();
            assert!((read - number).abs() <= 6e-5 * number.max(1.0), "{number} became {read}");
            number *= 1.37;
        }
    }

    #[test]
    fn counts_have_all_their_digits() {
        for (count, text) in
            [(0, "0"), (9, "9"), (10, "10"), (1_002, "1002"), (u32::MAX, "4294967295")]
        {
            assert_eq!(shown(Part::Count(count)), text);
        }
    }

    #[test]
    fn hazards_read_as_they_are_displayed() {
        for bits in 0..=u8::MAX {
            let hazards = Hazards::from_bits_retain(bits);
            let mut sentence = Sentence::<150>::new();
            Part::Hazards(hazards).append(&mut sentence);
            assert_eq!(text(&sentence), std::format!("{hazards}"));
        }
    }

    #[test]
    fn what_does_not_fit_is_cut() {
        let mut sentence = Sentence::<4>::new();
        Part::Text("abc").append(&mut sentence);
        Part::Text("d\u{e9}f").append(&mut sentence);
        assert_eq!(text(&sentence), "abcd");
        let mut texts = StatusTexts::new();
        texts.push(Severity::Info, &[Part::Text("x"); PARTS_MAX + 1]);
        let (data, _) = texts.next().unwrap();
        assert_eq!(data.text.to_str().unwrap(), "x".repeat(PARTS_MAX));
    }

    #[test]
    fn an_error_shows_name_value_and_bound() {
        let shown = |bound| {
            let mut sentence = Sentence::<64>::new();
            let error = ConfigError::new("k1", 2.5, bound, "");
            explained(&error).iter().for_each(|part| part.append(&mut sentence));
            std::string::String::from(text(&sentence))
        };
        assert_eq!(shown(Bound::Inside(0.5, 1.0)), "k1 2.5, must be in [0.5, 1]");
        assert_eq!(shown(Bound::AtMost(2.0)), "k1 2.5, must be at most 2");
        assert_eq!(shown(Bound::NotNegative), "k1 2.5, must be zero or positive");
    }
}
