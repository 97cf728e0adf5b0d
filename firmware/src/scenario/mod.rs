//! The scenarios of `scenarios`, carried in the image: each number has one source.
//!
//! `build.rs` turns each TOML file into postcard bytes; [`Scenario::load`] reads them back.

mod document;

pub use document::{ControllerConfig, Document, Flown, Tuning};

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

/// What this image flies when no host says otherwise.
///
/// # Errors
/// Only if the image is damaged.
pub fn flown() -> Result<Flown, postcard::Error> {
    postcard::from_bytes(include_bytes!(concat!(env!("OUT_DIR"), "/flown.postcard")))
}

include!(concat!(env!("OUT_DIR"), "/scenarios.rs"));

#[cfg(test)]
mod tests {
    use super::*;
    use ctrl_core::controller::TrackingController;
    use ctrl_core::robust_adaptive::RobustAdaptive;
    use ctrl_core::saturated::Saturated;
    use link::ControllerKind;

    #[test]
    fn every_scenario_builds_a_controller_that_accepts_its_trajectory() {
        for scenario in SCENARIOS {
            let document = scenario.load().expect(scenario.name);
            let accepted = match &document.controller {
                ControllerConfig::RobustAdaptive(config) => RobustAdaptive::new(config)
                    .and_then(|c| c.accept(&document.trajectory.build(c.step_period())?)),
                ControllerConfig::Saturated(config) => Saturated::new(config)
                    .and_then(|c| c.accept(&document.trajectory.build(c.step_period())?)),
            };
            assert_eq!(accepted, Ok(()), "{}", scenario.name);
        }
    }

    #[test]
    fn the_flown_scenario_is_the_one_that_the_constants_name() {
        let flown = flown().unwrap();
        let document = Scenario::named(FLOWN).unwrap().load().unwrap();
        assert_eq!(flown.trajectory, document.trajectory);
        let period = match document.controller {
            ControllerConfig::RobustAdaptive(config) => {
                assert_eq!(
                    (flown.tuning.robust_adaptive, flown.tuning.kind),
                    (config, ControllerKind::RobustAdaptive)
                );
                config.step_period
            }
            ControllerConfig::Saturated(config) => {
                assert_eq!(
                    (flown.tuning.saturated, flown.tuning.kind),
                    (config, ControllerKind::Saturated)
                );
                config.step_period
            }
        };
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
