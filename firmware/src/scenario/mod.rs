//! The scenarios of `scenarios`, carried in the image: each number has one source.
//!
//! `build.rs` turns each TOML file into postcard bytes; [`Scenario::load`] reads them back.

mod document;

pub use document::{BuiltInMission, Document, Tuning};

/// One scenario of the image.
#[derive(Clone, Copy, Debug)]
pub struct Scenario {
    /// Name of its file without the ending.
    pub name: &'static str,
    bytes: &'static [u8],
}

impl Scenario {
    /// Controller and trajectory.
    ///
    /// # Errors
    /// Only if the image is damaged: the bytes were written by the same code that reads them.
    pub fn load(&self) -> Result<Document, postcard::Error> {
        postcard::from_bytes(self.bytes)
    }

    /// The scenario of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        SCENARIOS.iter().find(|scenario| scenario.name == name)
    }
}

/// The mission that this image flies unless the host selects another.
///
/// # Errors
/// Only if the image is damaged.
pub fn built_in_mission() -> Result<BuiltInMission, postcard::Error> {
    postcard::from_bytes(include_bytes!(concat!(env!("OUT_DIR"), "/built_in_mission.postcard")))
}

include!(concat!(env!("OUT_DIR"), "/scenarios.rs"));

#[cfg(test)]
mod tests {
    use super::*;
    use ctrl_core::controller::{AdaptiveController, ControllerConfig, TrackingController};

    #[test]
    fn every_scenario_builds_a_controller_that_accepts_its_trajectory() {
        for scenario in SCENARIOS {
            let document = scenario.load().expect(scenario.name);
            let accepted = document.controller.build().and_then(|controller| {
                controller.accept(&document.trajectory.build(controller.step_period())?)
            });
            assert_eq!(accepted, Ok(()), "{}", scenario.name);
        }
    }

    #[test]
    fn the_built_in_mission_is_the_scenario_that_the_constants_name() {
        let mission = built_in_mission().unwrap();
        let document = Scenario::named(BUILT_IN).unwrap().load().unwrap();
        assert_eq!(mission.trajectory, document.trajectory);
        assert_eq!(mission.tuning.chosen(), document.controller);
        let period = document.controller.step_period();
        assert_eq!(CONTROL_RATE, (1.0 / period).round() as u32);
    }

    #[test]
    fn the_papers_scenarios_are_there_by_name() {
        for (name, robust) in [("paper-robust-adaptive", true), ("paper-saturated", false)] {
            let document = Scenario::named(name).unwrap().load().unwrap();
            let is_robust = matches!(document.controller, ControllerConfig::RobustAdaptive(_));
            assert_eq!(is_robust, robust, "{name}");
        }
        assert!(Scenario::named("no such scenario").is_none());
    }
}
