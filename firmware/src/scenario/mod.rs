//! The scenarios of `scenarios`, carried in the image: each number has one source.
//!
//! `build.rs` turns each TOML file into postcard bytes; [`Scenario::load`] reads them back.

mod document;

pub use document::{BuiltInMission, Document, Tuning};

#[allow(unused_imports, reason = "another scenario has another trajectory")]
use crate::literal::{Vec3, list};
use ctrl_core::config::{CascadeGains, IntegralAction, RobustAdaptiveConfig, SaturatedConfig};
use ctrl_core::rotors::RotorModel;
#[allow(unused_imports, reason = "as above")]
use ctrl_core::trajectory::{
    CircleConfig, Heading, HoverConfig, Leg, LemniscateConfig, RisingCircleConfig,
    TrajectoryConfig, WaypointPathConfig,
};
use ctrl_core::vehicle::{InitialEstimate, Interval, Uncertainty, VectorInterval};
use link::ControllerKind;

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

/// The mission that this image flies unless the host selects another; `build.rs` has checked it.
pub static BUILT_IN_MISSION: BuiltInMission = {
    #[allow(unused_imports, reason = "another scenario has another trajectory")]
    use {ControllerKind::*, Heading::*, TrajectoryConfig::*};
    include!(concat!(env!("OUT_DIR"), "/built_in_mission.rs"))
};

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
        let mission = &BUILT_IN_MISSION;
        let document = Scenario::named(BUILT_IN).unwrap().load().unwrap();
        assert_eq!(mission.trajectory, document.trajectory);
        assert_eq!(mission.tuning.controller(), document.controller.build());
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
