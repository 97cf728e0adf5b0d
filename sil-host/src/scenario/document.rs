//! The text of a scenario: values changed by path, and every byte traced back to its line and key.

use std::ops::Range;

use serde::de::DeserializeOwned;
use toml_edit::{Document, DocumentMut, Item, TableLike, Value};

use super::error::{Origin, ScenarioError, with_hint};

/// A TOML text with a name, and the changes made to it.
#[derive(Clone, Debug)]
pub(crate) struct ScenarioText {
    name: String,
    original: Document<String>,
    effective: String,
    overrides: Vec<Override>,
}

#[derive(Clone, Debug)]
struct Override {
    path: Vec<String>,
    written: String,
}

impl ScenarioText {
    /// Parses TOML; `name` is what errors call it.
    pub(crate) fn parse(name: &str, text: &str) -> Result<Self, ScenarioError> {
        let parsed = Document::parse(text.to_owned());
        let original = parsed.map_err(|error| ScenarioError {
            origin: Origin::File {
                name: name.to_owned(),
                line: error.span().map(|span| line_at(text, span.start)),
            },
            key: String::new(),
            message: with_hint(error.message()),
        })?;
        Ok(Self { name: name.to_owned(), original, effective: text.to_owned(), overrides: vec![] })
    }

    /// The text with all changes made.
    pub(crate) fn effective(&self) -> &str {
        &self.effective
    }

    /// Makes one change, written `path=value`; a value that is no TOML is taken as a string.
    pub(crate) fn set(&mut self, change: &str) -> Result<(), ScenarioError> {
        let refuse = |key: &str, message: &str| ScenarioError {
            origin: Origin::Override(change.to_owned()),
            key: key.to_owned(),
            message: message.to_owned(),
        };
        let Some((key, value)) = change.split_once('=') else {
            return Err(refuse("", "expected path=value"));
        };
        let (key, value) = (key.trim(), value.trim());
        let path: Vec<String> = key.split('.').map(str::to_owned).collect();
        if path.iter().any(String::is_empty) {
            return Err(refuse(key, "expected keys separated by single dots"));
        }
        let value = value.parse::<Value>().unwrap_or_else(|_| Value::from(value));
        let mut document: DocumentMut =
            self.effective.parse().map_err(|_| refuse(key, "the text before is not TOML"))?;
        replace(document.as_table_mut(), &path, value).map_err(|message| refuse(key, &message))?;
        self.effective = document.to_string();
        self.overrides.push(Override { path, written: change.to_owned() });
        Ok(())
    }

    /// The text as a value; errors name line and key.
    pub(crate) fn deserialize<T: DeserializeOwned>(&self) -> Result<T, ScenarioError> {
        toml_edit::de::from_str(&self.effective).map_err(|error| {
            let path = error
                .span()
                .and_then(|span| {
                    let document = Document::parse(self.effective.as_str()).ok()?;
                    path_at(document.as_table(), &span)
                })
                .unwrap_or_default();
            self.error(&path, with_hint(error.message()))
        })
    }

    /// An error about the value at `path`.
    pub(crate) fn error(&self, path: &[String], message: String) -> ScenarioError {
        let origin = match self.overrides.iter().rfind(|change| self.concerns(change, path)) {
            Some(change) => Origin::Override(change.written.clone()),
            None => Origin::File { name: self.name.clone(), line: self.line_of(path) },
        };
        ScenarioError { origin, key: path.join("."), message }
    }

    /// Whether `change` wrote the value at `path`, or the whole table around it, or brought the
    /// table at `path` into being.
    fn concerns(&self, change: &Override, path: &[String]) -> bool {
        let is_new = || item_at(self.original.as_table(), path).is_none();
        let inside = path.starts_with(&change.path);
        !path.is_empty() && (inside || (change.path.starts_with(path) && is_new()))
    }

    /// Whether the text has a value or table at `path`.
    pub(crate) fn contains(&self, path: &[String]) -> bool {
        Document::parse(self.effective.as_str())
            .is_ok_and(|document| item_at(document.as_table(), path).is_some())
    }

    /// The line on which the key at `path`, or the nearest table above it, was written.
    fn line_of(&self, path: &[String]) -> Option<usize> {
        let mut table: &dyn TableLike = self.original.as_table();
        let mut start = None;
        for name in path {
            let Some((key, item)) = table.get_key_value(name) else { break };
            start = key.span().map(|span| span.start).or(start);
            let Some(inner) = item.as_table_like() else { break };
            table = inner;
        }
        start.map(|start| line_at(self.original.raw(), start))
    }
}

/// The item at a path, if there is one.
fn item_at<'a>(table: &'a dyn TableLike, path: &[String]) -> Option<&'a Item> {
    let (name, rest) = path.split_first()?;
    let item = table.get(name)?;
    if rest.is_empty() { Some(item) } else { item_at(item.as_table_like()?, rest) }
}

/// Puts `value` at `path`, in a new table where there is none.
fn replace(table: &mut dyn TableLike, path: &[String], value: Value) -> Result<(), String> {
    let Some((name, rest)) = path.split_first() else { return Ok(()) };
    if rest.is_empty() {
        if table.get(name).is_some_and(|old| old.is_table() || old.is_array_of_tables()) {
            return Err("is a table, not a value".to_owned());
        }
        table.insert(name, Item::Value(value));
        return Ok(());
    }
    let inner = table.entry(name).or_insert_with(toml_edit::table);
    match inner.as_table_like_mut() {
        Some(inner) => replace(inner, rest, value),
        None => Err(format!("`{name}` is a value, not a table")),
    }
}

/// The innermost key whose name or value covers the start of `span`.
fn path_at(table: &dyn TableLike, span: &Range<usize>) -> Option<Vec<String>> {
    let covers = |outer: Option<Range<usize>>| outer.is_some_and(|o| o.contains(&span.start));
    for (name, item) in table.iter() {
        let inner = match item {
            Item::ArrayOfTables(array) => array.iter().find_map(|table| path_at(table, span)),
            _ => item.as_table_like().and_then(|table| path_at(table, span)),
        };
        if let Some(inner) = inner {
            return Some([vec![name.to_owned()], inner].concat());
        }
        if covers(table.key(name).and_then(|key| key.span())) || covers(item.span()) {
            return Some(vec![name.to_owned()]);
        }
    }
    None
}

fn line_at(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&byte| byte == b'\n').count()
}
