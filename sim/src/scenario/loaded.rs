//! A scenario together with its text, so that faults found later still name line and key.

use std::path::Path;

use ctrl_core::error::ConfigError;

use super::document::TomlText;
use super::error::{Origin, ScenarioError};
use super::name::not_found;
use super::{BUILT_IN, BuiltIn, Scenario, ScenarioFlight, validation};

/// A scenario that has been read and checked, and the text it came from.
#[derive(Clone, Debug)]
pub struct LoadedScenario {
    scenario: Scenario,
    text: TomlText,
}

impl LoadedScenario {
    /// Reads the built-in scenario or the file `name`, after the changes `path=value`.
    ///
    /// # Errors
    /// Names file, line and key of what cannot be read, is unknown or is out of its range.
    pub fn open(name: &str, changes: &[String]) -> Result<Self, ScenarioError> {
        if let Some(built_in) = BuiltIn::named(name) {
            return Self::parse(name, built_in.text, changes);
        }
        let text = std::fs::read_to_string(Path::new(name)).map_err(|error| {
            let known = BUILT_IN.iter().map(|scenario| scenario.name);
            let message = not_found(name, &error, "scenarios", known);
            let origin = Origin::File { name: name.to_owned(), line: None };
            ScenarioError { origin, key: String::new(), message }
        })?;
        Self::parse(name, &text, changes)
    }

    /// Reads a scenario from TOML; errors name it `name`.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn parse(name: &str, text: &str, changes: &[String]) -> Result<Self, ScenarioError> {
        let mut text = TomlText::parse(name, text)?;
        text.set(changes)?;
        let scenario: Scenario = text.deserialize()?;
        if let Some((path, message)) = validation::first_fault(&scenario) {
            return Err(
                text.error(&path.split('.').map(str::to_owned).collect::<Vec<_>>(), message)
            );
        }
        let loaded = Self { scenario, text };
        loaded.flight()?;
        Ok(loaded)
    }

    /// Checks that a scenario can be read after the changes: every field is known and of its type, but may
    /// be out of its range.
    ///
    /// # Errors
    /// Names file, line and key, or the change.
    pub fn check_fields(name: &str, text: &str, changes: &[String]) -> Result<(), ScenarioError> {
        let mut text = TomlText::parse(name, text)?;
        text.set(changes)?;
        text.deserialize::<Scenario>().map(drop)
    }

    /// The scenario.
    #[must_use]
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The same scenario under another name, after which its results are named.
    #[must_use]
    pub fn renamed(mut self, name: &str) -> Self {
        name.clone_into(&mut self.scenario.name);
        self
    }

    /// Its TOML after the changes.
    #[must_use]
    pub fn text(&self) -> &str {
        self.text.effective()
    }

    /// The vehicle at the first tick, ready to fly.
    ///
    /// # Errors
    /// Names the parameter that controller or trajectory refuse.
    pub fn flight(&self) -> Result<ScenarioFlight, ScenarioError> {
        self.scenario.flight().map_err(|error| self.refusal(&error))
    }

    /// The same with another seed.
    ///
    /// # Errors
    /// As [`flight`](Self::flight).
    pub fn flight_with_seed(&self, seed: u64) -> Result<ScenarioFlight, ScenarioError> {
        let scenario = Scenario { seed, ..self.scenario.clone() };
        scenario.flight().map_err(|error| self.refusal(&error))
    }

    /// Finds the key that a validating constructor refused: `parameter` is a path below the
    /// controller or the trajectory, or an expression of several.
    pub fn refusal(&self, error: &ConfigError) -> ScenarioError {
        let controller = keys("controller", self.scenario.controller.key());
        let terms = error.parameter.split_whitespace().filter_map(|term| term.split('[').next());
        let written = terms
            .flat_map(|term| [keys(&controller.join("."), term), keys("trajectory", term)])
            .find(|path| self.text.contains(path));
        let rotors = vec!["rotors".to_owned()];
        let rotors =
            Some(rotors).filter(|path| of_rotors(error.parameter) && self.text.contains(path));
        let sensors = error.parameter.split('.').next().and_then(sensor_of);
        let path = written
            .or(rotors)
            .or(sensors)
            .or_else(|| self.filter_key(error.parameter))
            .unwrap_or_else(|| match error.parameter.split('.').next() {
                Some("trajectory") => vec!["trajectory".to_owned()],
                _ => controller,
            });
        self.text.error(&path, error.to_string())
    }

    /// The key of a filter's parameter, or that of the array of notches that has it.
    fn filter_key(&self, parameter: &str) -> Option<Vec<String>> {
        let path: Vec<_> = parameter.split('.').map(str::to_owned).collect();
        let filter = path.first().is_some_and(|table| table == "rate_filter");
        let longest_first = (1..=path.len()).rev().map(|length| path[..length].to_vec());
        longest_first.filter(|_| filter).find(|path| self.text.contains(path))
    }
}

/// `true` for a parameter of allocation, thrust curve or battery compensation.
fn of_rotors(parameter: &str) -> bool {
    let first = parameter.split(['.', ' ']).next();
    matches!(first, Some("rotors" | "thrust_curve" | "battery"))
}

/// The sensor's key for a field of the estimator's configuration, which has no key of its own.
fn sensor_of(field: &str) -> Option<Vec<String>> {
    let sensor = match field {
        "inertial" => "imu",
        "barometer" | "magnetometer" => field,
        "gnss_position" | "gnss_velocity" => "gnss",
        "capture_position" | "capture_attitude" => "capture",
        _ => return None,
    };
    Some(vec!["sensors".to_owned(), sensor.to_owned()])
}

/// The keys of the dotted `path` below `parent`.
fn keys(parent: &str, path: &str) -> Vec<String> {
    parent.split('.').chain(path.split('.')).map(str::to_owned).collect()
}
