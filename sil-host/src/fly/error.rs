//! Causes of a session of flights that could not go on.

use std::fmt;
use std::io;
use std::path::PathBuf;

use ctrl_core::error::ConfigError;
use sim::scenario::ScenarioError;

use crate::pil::PilError;

/// Cause of an end of the session.
#[derive(Debug)]
pub enum FlyError {
    /// The scenario cannot be read or flown.
    Scenario(ScenarioError),
    /// The scenario cannot be flown under commands.
    Refused(ConfigError),
    /// The frame of the scenario has not as many rotors as the firmware's vehicle.
    Frame {
        /// Rotors of the scenario's frame.
        given: usize,
        /// Rotors of `firmware/vehicle.toml`.
        needed: usize,
    },
    /// A port cannot be opened.
    Port(io::Error),
    /// Results cannot be written: path and reason.
    Output(PathBuf, io::Error),
    /// A signing key cannot be read: path and reason.
    Key(PathBuf, String),
    /// The emulator or the image in it.
    Image(PilError),
    /// The control group computed something else than the law.
    Differs,
}

impl fmt::Display for FlyError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scenario(error) => error.fmt(out),
            Self::Refused(error) => {
                write!(out, "the scenario cannot be flown by commands: {error}")
            }
            Self::Frame { given, needed } => {
                write!(out, "rotors.frame: {given} rotors, but firmware/vehicle.toml has {needed}")
            }
            Self::Port(error) => write!(out, "no port: {error}"),
            Self::Output(path, error) => write!(out, "{}: {error}", path.display()),
            Self::Key(path, reason) => write!(out, "{}: {reason}", path.display()),
            Self::Image(error) => error.fmt(out),
            Self::Differs => out.write_str("the control group differs from the law on the host"),
        }
    }
}

impl std::error::Error for FlyError {}

impl From<ConfigError> for FlyError {
    fn from(error: ConfigError) -> Self {
        Self::Refused(error)
    }
}

impl From<ScenarioError> for FlyError {
    fn from(error: ScenarioError) -> Self {
        Self::Scenario(error)
    }
}

impl From<PilError> for FlyError {
    fn from(error: PilError) -> Self {
        Self::Image(error)
    }
}
