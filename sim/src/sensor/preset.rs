//! Sets of sensors whose estimates are checked for consistency, each in the built-in flight that suits it.

use crate::scenario::{LoadedScenario, ScenarioError};

/// A built-in scenario with the sensors of one set.
#[derive(Clone, Copy, Debug)]
pub struct SensorPreset {
    /// Name on the command line.
    pub name: &'static str,
    /// Built-in scenario that it flies.
    pub scenario: &'static str,
    /// Changes of the scenario.
    pub changes: &'static [&'static str],
}

/// Every set: each inertial unit, by motion capture indoors and by GNSS, barometer and magnetometer outdoors; a barometer that
/// drifts; rangefinder and optical flow near the ground.
pub const PRESETS: &[SensorPreset] = &[
    SensorPreset {
        name: "bmi088-capture",
        scenario: "sensors-indoors",
        changes: &["sensors.imu=\"bmi088\""],
    },
    SensorPreset {
        name: "icm-42688-p-capture",
        scenario: "sensors-indoors",
        changes: &["sensors.imu=\"icm-42688-p\""],
    },
    SensorPreset {
        name: "bmi088-gnss",
        scenario: "sensors-outdoors",
        changes: &["sensors.imu=\"bmi088\""],
    },
    SensorPreset {
        name: "icm-42688-p-gnss",
        scenario: "sensors-outdoors",
        changes: &["sensors.imu=\"icm-42688-p\""],
    },
    SensorPreset {
        name: "bmi088-gnss-drift",
        scenario: "sensors-outdoors",
        changes: &["sensors.imu=\"bmi088\"", "sensors.barometer=\"bmp388-drifting\""],
    },
    SensorPreset {
        name: "icm-42688-p-flow",
        scenario: "sensors-near-ground",
        changes: &["sensors.imu=\"icm-42688-p\""],
    },
];

impl SensorPreset {
    /// The set of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        PRESETS.iter().find(|preset| preset.name == name)
    }

    /// Its scenario.
    ///
    /// # Errors
    /// Names file, line and key.
    pub fn open(&self) -> Result<LoadedScenario, ScenarioError> {
        self.open_with(&[])
    }

    /// Its scenario after further changes `path=value`.
    ///
    /// # Errors
    /// As [`open`](Self::open), or the change.
    pub fn open_with(&self, further: &[String]) -> Result<LoadedScenario, ScenarioError> {
        let own = self.changes.iter().map(|&change| change.to_owned());
        let changes: Vec<_> = own.chain(further.iter().cloned()).collect();
        Ok(LoadedScenario::open(self.scenario, &changes)?.renamed(self.name))
    }
}
