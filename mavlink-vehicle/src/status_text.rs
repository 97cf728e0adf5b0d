//! Sentences for the ground station.

use core::fmt::{self, Write};

use heapless::{Deque, String};
use mavlink::dialects::common::{MavSeverity, STATUSTEXT_DATA};
use mavlink::types::CharArray;

/// Longest sentence (bytes); what is longer is cut.
const TEXT_MAX: usize = 150;
/// Bytes of a message.
const CHUNK: usize = 50;
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

/// Sentences that have not been sent.
#[derive(Clone, Debug)]
pub(crate) struct StatusTexts {
    waiting: Deque<(Severity, String<TEXT_MAX>), WAITING>,
    /// Number of the sentence, and its part that comes next.
    number: u16,
    part: u8,
}

impl StatusTexts {
    pub(crate) const fn new() -> Self {
        Self { waiting: Deque::new(), number: 0, part: 0 }
    }

    /// Queues a sentence, unless too many wait or it is there already.
    pub(crate) fn push(&mut self, severity: Severity, text: fmt::Arguments<'_>) {
        let mut sentence = Cut(String::new());
        // Cutting is no error.
        let _ = sentence.write_fmt(text);
        let Cut(sentence) = sentence;
        if self.waiting.back().is_none_or(|(_, last)| *last != sentence) {
            // More than a few sentences at once are a flood.
            let _ = self.waiting.push_back((severity, sentence));
        }
    }

    /// The next message with its extension fields.
    pub(crate) fn next(&mut self) -> Option<(STATUSTEXT_DATA, [u8; 3])> {
        let (severity, text) = self.waiting.front()?;
        let start = usize::from(self.part) * CHUNK;
        let bytes = text.as_bytes();
        let mut chunk = [0; CHUNK];
        for (place, byte) in chunk.iter_mut().zip(bytes.iter().skip(start)) {
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

/// A text that is cut where there is no more room.
struct Cut(String<TEXT_MAX>);

impl Write for Cut {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        text.chars().try_for_each(|char| self.0.push(char).map_err(|_| fmt::Error))
    }
}
