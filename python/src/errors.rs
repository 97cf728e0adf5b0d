//! Exceptions of `gyrfalcon.errors` from the errors of the libraries.

use ctrl_core::error::ConfigError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sim::scenario::{Origin, ScenarioError};

/// An exception of `gyrfalcon.errors` with a message and attributes.
pub fn raise(py: Python<'_>, class: &str, message: &str, attributes: &Bound<'_, PyDict>) -> PyErr {
    let made = py
        .import("gyrfalcon.errors")
        .and_then(|module| module.getattr(class))
        .and_then(|class| class.call((message,), Some(attributes)));
    made.map_or_else(|error| error, PyErr::from_value)
}

/// `ScenarioError` with file, line, key, change and bound.
pub fn scenario(py: Python<'_>, error: &ScenarioError) -> PyErr {
    let attributes = PyDict::new(py);
    let (mut place, mut change) = (error.origin.to_string(), None);
    let (mut file, mut line) = (None, None);
    match &error.origin {
        Origin::File { name, line: number } => (file, line) = (Some(name.as_str()), *number),
        Origin::Override(option) => {
            // The program's option; from Python it is a change by `set`.
            let written = option.strip_prefix("--set ").unwrap_or(option);
            change = Some(written);
            place = format!("change {written}");
        }
    }
    let key = (!error.key.is_empty()).then_some(error.key.as_str());
    let filled =
        [("file", file), ("key", key), ("change", change), ("bound", bound(&error.message))]
            .into_iter()
            .try_for_each(|(name, value)| attributes.set_item(name, value))
            .and_then(|()| attributes.set_item("line", line));
    if let Err(error) = filled {
        return error;
    }
    let message = match key {
        Some(key) => format!("{place}: {key}: {}", error.message),
        None => format!("{place}: {}", error.message),
    };
    raise(py, "ScenarioError", &message, &attributes)
}

/// `ConfigError` with parameter, value, bound and source.
pub fn config(py: Python<'_>, error: &ConfigError) -> PyErr {
    let attributes = PyDict::new(py);
    let filled = attributes
        .set_item("parameter", error.parameter)
        .and_then(|()| attributes.set_item("value", error.value))
        .and_then(|()| attributes.set_item("bound", error.bound.to_string()))
        .and_then(|()| attributes.set_item("source", error.source));
    match filled {
        Ok(()) => raise(py, "ConfigError", &error.to_string(), &attributes),
        Err(error) => error,
    }
}

/// The bound in a message `VALUE must be BOUND (SOURCE)`, without its source.
fn bound(message: &str) -> Option<&str> {
    let (_, bound) = message.split_once(" must be ")?;
    Some(bound.split_once(" (").map_or(bound, |(bound, _)| bound))
}
