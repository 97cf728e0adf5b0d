//! Choice of a trajectory at run time, by a scenario file or a message.

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use super::{
    CheckedPath, Circle, CircleConfig, Hover, HoverConfig, Lemniscate, LemniscateConfig,
    RisingCircle, RisingCircleConfig, Trajectory, WaypointPath, WaypointPathConfig,
};
use crate::error::ConfigError;
use crate::reference::Reference;

/// The configuration of one trajectory of any kind.
///
/// In text the kind is the key and its fields the value, so that a file's reader can point at a
/// wrong field; in TOML:
///
/// ```toml
/// [trajectory.rising_circle]
/// radius = 100.0       # [m]
/// angular_rate = 0.05  # [rad/s]
/// height = 10.0        # [m]
/// rise_rate = 0.1      # [1/s]
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[allow(clippy::large_enum_variant, reason = "there is no heap to put the path on")]
pub enum TrajectoryConfig {
    /// Standing still.
    Hover(HoverConfig),
    /// The paper's trajectory.
    RisingCircle(RisingCircleConfig),
    /// A horizontal circle.
    Circle(CircleConfig),
    /// A horizontal figure of eight.
    Lemniscate(LemniscateConfig),
    /// Legs through waypoints.
    WaypointPath(WaypointPathConfig),
}

impl TrajectoryConfig {
    /// The trajectory, sampled every `step_period` (s).
    ///
    /// # Errors
    /// That of the kind's constructor: the field or product, its value and the bound.
    pub fn build(&self, step_period: f32) -> Result<AnyTrajectory, ConfigError> {
        Ok(self.check(step_period)?.build())
    }

    /// Checks the trajectory for flight, sampled every `step_period` (s), without building a path.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    pub fn check(&self, step_period: f32) -> Result<CheckedTrajectory<'_>, ConfigError> {
        Ok(match self {
            Self::Hover(config) => CheckedTrajectory::Hover(Hover::new(config, step_period)?),
            Self::RisingCircle(config) => {
                CheckedTrajectory::RisingCircle(RisingCircle::new(config, step_period)?)
            }
            Self::Circle(config) => CheckedTrajectory::Circle(Circle::new(config, step_period)?),
            Self::Lemniscate(config) => {
                CheckedTrajectory::Lemniscate(Lemniscate::new(config, step_period)?)
            }
            Self::WaypointPath(config) => {
                CheckedTrajectory::WaypointPath(config.check(step_period)?)
            }
        })
    }
}

/// A trajectory configuration that has passed every check; a path is not built yet.
///
/// A built path takes kilobytes. With this value a controller can judge the trajectory first, and
/// [`CheckedPath::build_into`] then writes a path into the memory that it is flown from.
#[derive(Clone, Debug)]
pub enum CheckedTrajectory<'a> {
    /// Standing still.
    Hover(Hover),
    /// The paper's trajectory.
    RisingCircle(RisingCircle),
    /// A horizontal circle.
    Circle(Circle),
    /// A horizontal figure of eight.
    Lemniscate(Lemniscate),
    /// Legs through waypoints.
    WaypointPath(CheckedPath<'a>),
}

/// Evaluates the expression for whichever kind was checked.
macro_rules! of_checked {
    ($checked:expr, $trajectory:ident => $value:expr) => {
        match $checked {
            CheckedTrajectory::Hover($trajectory) => $value,
            CheckedTrajectory::RisingCircle($trajectory) => $value,
            CheckedTrajectory::Circle($trajectory) => $value,
            CheckedTrajectory::Lemniscate($trajectory) => $value,
            CheckedTrajectory::WaypointPath($trajectory) => $value,
        }
    };
}

impl CheckedTrajectory<'_> {
    /// Upper bound of the magnitude of each component of the acceleration, over all time (m/s^2).
    #[must_use]
    pub fn acceleration_bound(&self) -> f32 {
        of_checked!(self, trajectory => trajectory.acceleration_bound())
    }

    /// Time between two ticks (s).
    #[must_use]
    pub fn step_period(&self) -> f32 {
        of_checked!(self, trajectory => trajectory.step_period())
    }

    /// The trajectory by value.
    #[must_use]
    pub fn build(&self) -> AnyTrajectory {
        match self {
            Self::Hover(trajectory) => AnyTrajectory::Hover(*trajectory),
            Self::RisingCircle(trajectory) => AnyTrajectory::RisingCircle(*trajectory),
            Self::Circle(trajectory) => AnyTrajectory::Circle(*trajectory),
            Self::Lemniscate(trajectory) => AnyTrajectory::Lemniscate(*trajectory),
            Self::WaypointPath(checked) => AnyTrajectory::WaypointPath(checked.build()),
        }
    }
}

/// One trajectory of any kind, validated.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to put the path on")]
pub enum AnyTrajectory {
    /// Standing still.
    Hover(Hover),
    /// The paper's trajectory.
    RisingCircle(RisingCircle),
    /// A horizontal circle.
    Circle(Circle),
    /// A horizontal figure of eight.
    Lemniscate(Lemniscate),
    /// Legs through waypoints.
    WaypointPath(WaypointPath),
}

/// Evaluates the expression for whichever kind it is.
macro_rules! of_any {
    ($any:expr, $trajectory:ident => $value:expr) => {
        match $any {
            AnyTrajectory::Hover($trajectory) => $value,
            AnyTrajectory::RisingCircle($trajectory) => $value,
            AnyTrajectory::Circle($trajectory) => $value,
            AnyTrajectory::Lemniscate($trajectory) => $value,
            AnyTrajectory::WaypointPath($trajectory) => $value,
        }
    };
}

impl Trajectory for AnyTrajectory {
    fn reference(&self, tick: u64) -> Reference {
        of_any!(self, trajectory => trajectory.reference(tick))
    }

    fn acceleration_bound(&self) -> f32 {
        of_any!(self, trajectory => trajectory.acceleration_bound())
    }

    fn step_period(&self) -> f32 {
        of_any!(self, trajectory => trajectory.step_period())
    }
}

#[cfg(all(test, feature = "serde"))]
mod tests {
    use super::super::Heading;
    use super::*;
    use crate::trajectory::Leg;
    use glam::Vec3;
    use std::string::ToString;

    fn read(text: &str) -> Result<TrajectoryConfig, serde_json::Error> {
        serde_json::from_str(text)
    }

    #[test]
    fn each_kind_is_read_from_text_and_built() {
        let hover = r#"{"hover": {"position_world": [1, 2, 3], "yaw": 0}}"#;
        let rising = r#"{"rising_circle":
            {"radius": 100, "angular_rate": 0.05, "height": 10, "rise_rate": 0.1}}"#;
        let circle = r#"{"circle": {"centre_world": [0, 0, 3], "radius": 2, "angular_rate": 1,
            "heading": "tangent"}}"#;
        let eight = r#"{"lemniscate": {"centre_world": [0, 0, 3], "amplitude_x": 2,
            "amplitude_y": 1, "angular_rate": 0.5, "yaw": 0}}"#;
        let path = r#"{"waypoint_path": {"start_world": [0, 0, 1], "yaw": 0,
            "legs": [{"duration": 4, "position_world": [1, 0, 1]}]}}"#;
        for (text, bound) in
            [(hover, 0.0), (rising, 0.25), (circle, 2.0), (eight, 1.0), (path, 0.59)]
        {
            let trajectory = read(text).unwrap().build(1e-3).unwrap();
            assert!((trajectory.acceleration_bound() - bound).abs() < 0.01, "{text}");
            assert_eq!(trajectory.step_period(), 1e-3);
            assert!(trajectory.reference(1234).position_world.is_finite());
        }
    }

    #[test]
    fn the_chosen_trajectory_flies_as_the_kind_itself() {
        let config = CircleConfig {
            centre_world: Vec3::Z,
            radius: 1.0,
            angular_rate: 1.0,
            heading: Heading::Yaw(0.5),
        };
        let chosen = TrajectoryConfig::Circle(config).build(2e-3).unwrap();
        let circle = Circle::new(&config, 2e-3).unwrap();
        assert_eq!(chosen.reference(777), circle.reference(777));
    }

    #[test]
    fn unknown_kinds_and_fields_are_refused() {
        assert!(read(r#"{"spiral": {}}"#).unwrap_err().to_string().contains("spiral"));
        let text = r#"{"hover": {"position_world": [1, 2, 3], "yaw": 0, "speed": 1}}"#;
        assert!(read(text).unwrap_err().to_string().contains("speed"));
        let leg = Leg { duration: -1.0, ..Leg::to(Vec3::X, 1.0) };
        let legs = crate::list::List::from_slice(&[leg]).unwrap();
        let config = WaypointPathConfig { start_world: Vec3::ZERO, yaw: 0.0, legs };
        let error = TrajectoryConfig::WaypointPath(config).build(1e-3).unwrap_err();
        assert_eq!(error.parameter, "waypoint_path.legs.duration");
    }
}
