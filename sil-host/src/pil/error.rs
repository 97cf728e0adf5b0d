//! Failure of a flight with the vehicle in the loop.

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use ctrl_core::mode::{Cause, Mode, Refusal};
use link::Rejection;

use crate::run::RunError;
use sim::scenario::ScenarioError;

/// Command that builds the image.
const BUILD_IMAGE: &str =
    "cargo build --release -p firmware --target thumbv7em-none-eabihf --features emulator";

/// See the module's documentation.
#[derive(Clone, Debug)]
pub enum PilError {
    /// A scenario cannot be read or flown, or results cannot be written.
    Run(RunError),
    /// The emulator cannot be started: its program, and the reason.
    Emulator(PathBuf, String),
    /// There is no image at the path.
    ImageMissing(PathBuf),
    /// FIFOs or serial port of the link failed: its path, and the reason.
    Line(PathBuf, String),
    /// A recording cannot be read: its path, and the reason.
    Recording(PathBuf, String),
    /// The emulator has ended: its exit status.
    Ended(String),
    /// The vehicle was silent for this time.
    Silent(Duration),
    /// The vehicle's answer is not one that the message allows: the request, and the answer.
    Answer(String, String),
    /// The vehicle refused a request.
    Refused(String, Rejection),
    /// The image's control period is another than the scenario's (s).
    StepPeriod {
        /// Of the image.
        image: f32,
        /// Of the scenario.
        scenario: f32,
    },
    /// The inertial samples are rarer than the control ticks: the image takes one in each.
    SlowSensors,
    /// The scenario's rotors tell the law what they make of its command, and the image's do not.
    TellsLaw,
    /// The vehicle stopped flying.
    NotFlying {
        /// Control ticks since the start.
        tick: u64,
        /// Its mode.
        mode: Mode,
        /// Cause of the end of flight.
        cause: Option<Cause>,
    },
}

impl fmt::Display for PilError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Run(error) => error.fmt(out),
            Self::Emulator(program, error) => {
                write!(out, "{}: {error}; --qemu PATH names the emulator", program.display())
            }
            Self::ImageMissing(image) => write!(
                out,
                "{}: no such image; build it with `{BUILD_IMAGE}` or name another with --image",
                image.display()
            ),
            Self::Line(path, error) | Self::Recording(path, error) => {
                write!(out, "{}: {error}", path.display())
            }
            Self::Ended(status) => write!(out, "the emulator has ended: {status}"),
            Self::Silent(time) => write!(
                out,
                "the vehicle sent nothing for {time:?}; check cable, port and baud rate, or the emulator's image"
            ),
            Self::Answer(asked, came) => write!(out, "{asked}: the vehicle answered {came}"),
            Self::Refused(asked, Rejection::Mode(Refusal::Tilted)) => {
                write!(
                    out,
                    "the vehicle refused {asked}: {}; --lock-step allows any attitude",
                    Refusal::Tilted
                )
            }
            Self::Refused(asked, Rejection::Mode(refusal)) => {
                write!(out, "the vehicle refused {asked}: {refusal}")
            }
            Self::Refused(asked, rejection) => {
                write!(out, "the vehicle refused {asked}: {rejection:?}")
            }
            Self::StepPeriod { image, scenario } => write!(
                out,
                "the image steps every {image} s, the scenario every {scenario} s; build the image \
                 with GYRFALCON_CONTROL_RATE={}",
                (1.0 / scenario).round()
            ),
            Self::SlowSensors => out.write_str(
                "sensors.imu: its samples are rarer than the control ticks, and the image takes one in each; \
                 choose a rate of the control loop's or above",
            ),
            Self::TellsLaw => out.write_str(
                "rotors.tells_law: the image's law is not told what the rotors make of its command",
            ),
            Self::NotFlying { tick, mode, cause } => {
                write!(out, "the vehicle is {mode:?} at tick {tick}, cause {cause:?}")
            }
        }
    }
}

impl std::error::Error for PilError {}

impl From<RunError> for PilError {
    fn from(error: RunError) -> Self {
        Self::Run(error)
    }
}

impl From<ScenarioError> for PilError {
    fn from(error: ScenarioError) -> Self {
        Self::Run(error.into())
    }
}
