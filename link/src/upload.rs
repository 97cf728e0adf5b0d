//! Puts an uploaded waypoint path together, leg by leg.

use core::fmt;

use glam::Vec3;

use super::message::Rejection;
use ctrl_core::error::ConfigError;
use ctrl_core::list::List;
use ctrl_core::trajectory::{CheckedPath, Leg, MAX_LEGS, WaypointPathConfig};

/// Reason for the refusal of a leg or a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum UploadError {
    /// More legs are announced than [`MAX_LEGS`], or none.
    Count(u8),
    /// The leg is neither the next one nor one that is there already.
    Order {
        /// Index of the leg that is expected next.
        expected: u8,
    },
    /// The path is not complete.
    Incomplete,
    /// The path cannot be flown.
    Invalid(ConfigError),
}

impl fmt::Display for UploadError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count(legs) => write!(out, "{legs} legs announced, 1 to {MAX_LEGS} allowed"),
            Self::Order { expected } => write!(out, "leg {expected} is expected"),
            Self::Incomplete => out.write_str("the path is not complete"),
            Self::Invalid(error) => error.fmt(out),
        }
    }
}

impl core::error::Error for UploadError {}

impl From<UploadError> for Rejection {
    fn from(error: UploadError) -> Self {
        match error {
            UploadError::Count(_) | UploadError::Incomplete => Self::NoPath,
            UploadError::Order { expected } => Self::LegOrder { expected },
            UploadError::Invalid(error) => error.into(),
        }
    }
}

/// The path as far as it has arrived.
#[derive(Clone, Debug, Default)]
pub struct PathUpload {
    announced: u8,
    path: Option<WaypointPathConfig>,
}

impl PathUpload {
    /// No path yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { announced: 0, path: None }
    }

    /// Begins a path of `legs` legs, at rest in `start_world` (m) and with heading `yaw` (rad);
    /// forgets what was there.
    ///
    /// # Errors
    /// When that many legs do not fit; no path is then begun.
    pub fn begin(&mut self, start_world: Vec3, yaw: f32, legs: u8) -> Result<(), UploadError> {
        *self = Self::new();
        if legs == 0 || usize::from(legs) > MAX_LEGS {
            return Err(UploadError::Count(legs));
        }
        self.path = Some(WaypointPathConfig { start_world, yaw, legs: List::new() });
        self.announced = legs;
        Ok(())
    }

    /// Adds the leg at `index`, or replaces it if it is there already.
    ///
    /// # Errors
    /// Says which leg is expected.
    pub fn leg(&mut self, index: u8, leg: Leg) -> Result<(), UploadError> {
        let expected = self.expected();
        let order = UploadError::Order { expected };
        let legs = &mut self.path.as_mut().ok_or(order)?.legs;
        if let Some(present) = legs.get_mut(usize::from(index)) {
            *present = leg;
            Ok(())
        } else if index == expected && index < self.announced {
            legs.push(leg).map_err(|_| order)
        } else {
            Err(order)
        }
    }

    /// Index of the leg that is expected next.
    fn expected(&self) -> u8 {
        self.path.as_ref().map_or(0, |path| path.legs.len() as u8)
    }

    /// The complete path, checked for flight every `step_period` (s).
    ///
    /// # Errors
    /// When legs are missing, or [`WaypointPathConfig::check`] refuses the path.
    pub fn finish(&self, step_period: f32) -> Result<CheckedPath<'_>, UploadError> {
        match &self.path {
            Some(path) if self.expected() == self.announced => {
                path.check(step_period).map_err(UploadError::Invalid)
            }
            _ => Err(UploadError::Incomplete),
        }
    }
}
