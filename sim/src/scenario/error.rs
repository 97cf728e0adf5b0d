//! The error of reading a scenario: place, key, fault, and the nearest known name.

use std::fmt;

/// Fault of a scenario. `Display` puts it on one line: `file:line: key: message`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScenarioError {
    /// Place of the fault.
    pub origin: Origin,
    /// Dotted path of the key; empty when the fault belongs to no key.
    pub key: String,
    /// Description of the fault.
    pub message: String,
}

/// Origin of a faulty value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// In a file or built-in scenario, at a line counted from one where one is known.
    File {
        /// Path of the file, or name of the built-in scenario.
        name: String,
        /// Line, counted from one.
        line: Option<usize>,
    },
    /// In an option of the program that changed a value, such as `--set path=value`.
    Override(String),
}

impl fmt::Display for Origin {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File { name, line: Some(line) } => write!(out, "{name}:{line}"),
            Self::File { name, line: None } => out.write_str(name),
            Self::Override(option) => out.write_str(option),
        }
    }
}

impl fmt::Display for ScenarioError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}: ", self.origin)?;
        if !self.key.is_empty() {
            write!(out, "{}: ", self.key)?;
        }
        out.write_str(&self.message)
    }
}

impl std::error::Error for ScenarioError {}

/// The known name most similar to `unknown`, if any is similar.
pub(super) fn nearest<'a>(unknown: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    known
        .map(|known| (strsim::jaro_winkler(unknown, known), known))
        .filter(|(likeness, _)| *likeness > 0.75)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, known)| known)
}

/// A deserializer's message with the nearest known name.
pub(super) fn with_hint(message: &str) -> String {
    let message = message.replace('\n', ", ");
    if message.starts_with("unknown field") || message.starts_with("unknown variant") {
        let mut quoted = message.split('`').skip(1).step_by(2);
        let unknown = quoted.next().unwrap_or_default();
        if let Some(known) = nearest(unknown, quoted) {
            return format!("{message}; did you mean `{known}`?");
        }
    }
    if message.starts_with("invalid type: string") && message.contains("expected f") {
        return format!("{message}; write a number alone, in the unit that the comments give");
    }
    message
}
