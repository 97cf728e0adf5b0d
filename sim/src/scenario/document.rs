//! A TOML text, a scenario or a campaign: values changed by path, and every byte traced back to its
//! line and key.

use std::ops::Range;

use serde::de::DeserializeOwned;
use toml_edit::{Document, DocumentMut, Item, TableLike, Value};

use super::error::{Origin, ScenarioError, with_hint};

/// A TOML text with a name, and the changes made to it.
#[derive(Clone, Debug)]
pub struct TomlText {
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

impl TomlText {
    /// Parses TOML; `name` is what errors call it.
    pub fn parse(name: &str, text: &str) -> Result<Self, ScenarioError> {
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
    pub fn effective(&self) -> &str {
        &self.effective
    }

    /// Makes changes in order, each written `path=value`; a value that is no TOML is taken as a
    /// string.
    pub fn set<S: AsRef<str>>(&mut self, changes: &[S]) -> Result<(), ScenarioError> {
        if changes.is_empty() {
            return Ok(());
        }
        let parsed: Result<DocumentMut, _> = self.effective.parse();
        let mut document = parsed.map_err(|error| self.error(&[], with_hint(error.message())))?;
        for change in changes.iter().map(AsRef::as_ref) {
            self.change(&mut document, change, format!("--set {change}"))?;
        }
        self.effective = document.to_string();
        Ok(())
    }

    /// Makes one change `path=value`; errors name it `written`, the option of the change.
    ///
    /// # Errors
    /// When no value is at the path.
    pub fn set_option(&mut self, change: &str, written: &str) -> Result<(), ScenarioError> {
        let parsed: Result<DocumentMut, _> = self.effective.parse();
        let mut document = parsed.map_err(|error| self.error(&[], with_hint(error.message())))?;
        self.change(&mut document, change, written.to_owned())?;
        self.effective = document.to_string();
        Ok(())
    }

    fn change(
        &mut self,
        document: &mut DocumentMut,
        change: &str,
        written: String,
    ) -> Result<(), ScenarioError> {
        let path = make(document.as_table_mut(), change).map_err(|(key, message)| {
            let origin = Origin::Override(written.clone());
            ScenarioError { origin, key, message }
        })?;
        self.overrides.push(Override { path, written });
        Ok(())
    }

    /// The text as a value; errors name line and key.
    pub fn deserialize<T: DeserializeOwned>(&self) -> Result<T, ScenarioError> {
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
    pub fn error(&self, path: &[String], message: String) -> ScenarioError {
        let origin = match self.overrides.iter().rfind(|change| self.concerns(change, path)) {
            Some(change) => Origin::Override(change.written.clone()),
            None => Origin::File { name: self.name.clone(), line: self.line_of(path) },
        };
        ScenarioError { origin, key: path.join("."), message }
    }

    /// `true` if `change` wrote the value at `path` or the whole table around it, or created the table at
    /// `path`.
    fn concerns(&self, change: &Override, path: &[String]) -> bool {
        let is_new = || item_at(self.original.as_table(), path).is_none();
        let inside = path.starts_with(&change.path);
        !path.is_empty() && (inside || (change.path.starts_with(path) && is_new()))
    }

    /// `true` if the text has a value or table at `path`.
    pub fn contains(&self, path: &[String]) -> bool {
        Document::parse(self.effective.as_str())
            .is_ok_and(|document| item_at(document.as_table(), path).is_some())
    }

    /// `true` if the text has a value at `path`; for a path that ends in indices, the array.
    pub fn has(&self, path: &str) -> bool {
        steps(path).is_some_and(|steps| self.contains(&keys(&steps)))
    }

    /// The line on which the key at `path`, or the nearest table above it, was written.
    fn line_of(&self, path: &[String]) -> Option<usize> {
        let mut table: &dyn TableLike = self.original.as_table();
        let mut start = None;
        for name in path {
            let (name, index) = name_and_index(name);
            let Some((key, item)) = table.get_key_value(name) else { break };
            start = key.span().map(|span| span.start).or(start);
            let element = item.as_array_of_tables().zip(index).and_then(|(it, i)| it.get(i));
            start = element.and_then(|table| table.span()).map(|span| span.start).or(start);
            let element = element.map(|table| table as &dyn TableLike);
            let Some(inner) = element.or(item.as_table_like()) else { break };
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

/// Makes one change; the keys of its path, or the key at fault and what is wrong.
fn make(table: &mut dyn TableLike, change: &str) -> Result<Vec<String>, (String, String)> {
    let fault = |key: &str, message: &str| (key.to_owned(), message.to_owned());
    let (key, value) = change.split_once('=').ok_or_else(|| fault("", "expected path=value"))?;
    let (key, value) = (key.trim(), value.trim());
    let steps = steps(key).ok_or_else(|| {
        fault(key, "expected keys separated by single dots, as in table.key or table.array[0]")
    })?;
    let value = value.parse::<Value>().unwrap_or_else(|_| Value::from(value));
    replace(table, &steps, value).map_err(|message| fault(key, &message))?;
    Ok(keys(&steps))
}

/// The keys down to the value, or to the array that holds it.
fn keys(steps: &[Step]) -> Vec<String> {
    steps.iter().map_while(Step::key).map(str::to_owned).collect()
}

/// A step from a table or an array to what it holds.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Step {
    Key(String),
    Index(usize),
}

impl Step {
    fn key(&self) -> Option<&str> {
        match self {
            Self::Key(name) => Some(name),
            Self::Index(_) => None,
        }
    }
}

/// The steps of a path such as `vehicle.inertia[0]`; none if it is not written like that.
fn steps(path: &str) -> Option<Vec<Step>> {
    let mut steps = Vec::new();
    for part in path.split('.') {
        let mut pieces = part.split('[');
        let name = pieces.next().filter(|name| !name.is_empty())?;
        steps.push(Step::Key(name.to_owned()));
        for index in pieces {
            steps.push(Step::Index(index.strip_suffix(']')?.parse().ok()?));
        }
    }
    Some(steps)
}

/// Puts `value` where `steps` lead, in a new table where there is none.
fn replace(table: &mut dyn TableLike, steps: &[Step], value: Value) -> Result<(), String> {
    let Some((Step::Key(name), rest)) = steps.split_first() else { return Ok(()) };
    match rest.first() {
        None => {
            if table.get(name).is_some_and(|old| old.is_table() || old.is_array_of_tables()) {
                return Err("is a table, not a value".to_owned());
            }
            table.insert(name, Item::Value(value));
            Ok(())
        }
        Some(Step::Key(_)) => {
            let inner = table.entry(name).or_insert_with(toml_edit::table);
            match inner.as_table_like_mut() {
                Some(inner) => replace(inner, rest, value),
                None => Err(format!("`{name}` is a value, not a table")),
            }
        }
        Some(Step::Index(_)) => match table.get_mut(name).and_then(Item::as_value_mut) {
            Some(inner) => replace_inside(name, inner, rest, value),
            None => Err(format!("`{name}` is not an array")),
        },
    }
}

/// Puts `value` where `steps` lead from `old`, the value or element called `name`.
fn replace_inside(name: &str, old: &mut Value, steps: &[Step], value: Value) -> Result<(), String> {
    match steps.split_first() {
        None => {
            *old = value;
            Ok(())
        }
        Some((Step::Index(index), rest)) => {
            let array = old.as_array_mut().ok_or_else(|| format!("`{name}` is not an array"))?;
            let length = array.len();
            match array.get_mut(*index) {
                Some(element) => replace_inside(&format!("{name}[{index}]"), element, rest, value),
                None => Err(format!("`{name}` has {length} elements, the first is [0]")),
            }
        }
        Some((Step::Key(_), _)) => match old.as_inline_table_mut() {
            Some(inner) => replace(inner, steps, value),
            None => Err(format!("`{name}` is a value, not a table")),
        },
    }
}

/// `name[index]` of an element of an array of tables in its parts.
fn name_and_index(step: &str) -> (&str, Option<usize>) {
    let parts = step.split_once('[').and_then(|(name, index)| {
        let index = index.strip_suffix(']')?.parse().ok()?;
        Some((name, Some(index)))
    });
    parts.unwrap_or((step, None))
}

/// The innermost key whose name or value covers the start of `span`; an element of an array of
/// tables is called `name[index]`.
fn path_at(table: &dyn TableLike, span: &Range<usize>) -> Option<Vec<String>> {
    let covers = |outer: Option<Range<usize>>| outer.is_some_and(|o| o.contains(&span.start));
    for (name, item) in table.iter() {
        let inner = match item {
            Item::ArrayOfTables(array) => array.iter().enumerate().find_map(|(index, table)| {
                let inside = covers(table.span()).then(Vec::new);
                Some((format!("{name}[{index}]"), path_at(table, span).or(inside)?))
            }),
            _ => {
                let inner = item.as_table_like().and_then(|table| path_at(table, span));
                inner.map(|inner| (name.to_owned(), inner))
            }
        };
        if let Some((name, inner)) = inner {
            return Some([vec![name], inner].concat());
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
