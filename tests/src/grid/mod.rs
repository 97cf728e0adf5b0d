//! The verification grid: flights of the shipped scenarios on other vehicles, from other starts, under
//! other disturbances and at other step rates, and what their monitors say. `docs/verification.md`
//! describes the grid and what was measured over it.

mod bounds;
mod campaign;
mod corner;
mod disturbance;
mod flight;
mod inertia;
mod limits;
mod report;

pub use bounds::documented;
pub use campaign::campaign;
pub use corner::corners;
pub use disturbance::Kind;
pub use flight::{Errors, LAST_LEG, Outcome, fly_all};
pub use limits::Breach;
pub use report::check;

use ctrl_core::controller::ControllerConfig;
use sim::scenario::{LoadedScenario, Scenario};

/// Step periods of the grid (s): 500 Hz, 1 kHz, 2 kHz.
pub const STEP_PERIODS: [f32; 3] = [0.002, 0.001, 0.0005];

/// One flight of the grid.
#[derive(Clone, Debug)]
pub struct Case {
    /// Everything the flight depends on.
    pub scenario: Scenario,
    /// Kind of the disturbance.
    pub disturbance: Kind,
}

impl Case {
    /// The built-in scenario of that name, calm.
    ///
    /// # Panics
    /// When there is none.
    #[must_use]
    pub fn built_in(name: &str) -> Self {
        let loaded = LoadedScenario::open(name, &[]).unwrap_or_else(|error| panic!("{error}"));
        let scenario = loaded.scenario().clone();
        Self { scenario, disturbance: Kind::Calm }.disturbed(Kind::Calm, [1.0; 6], 0.0)
    }

    /// The same flight with another step of the controller and of the plant (s).
    #[must_use]
    pub fn stepped(mut self, step_period: f32) -> Self {
        match &mut self.scenario.controller {
            ControllerConfig::RobustAdaptive(config) => config.step_period = step_period,
            ControllerConfig::Saturated(config) => config.step_period = step_period,
        }
        self
    }
}

impl std::fmt::Display for Case {
    /// Everything that repeats the flight.
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Scenario { name, vehicle, initial, controller, seed, .. } = &self.scenario;
        write!(
            out,
            "{name} dt {} s seed {seed}, mass {:.4}, inertia {:.4}, tilt {:.1} to {:.1} heading {:.1} \
             deg, position {:.2}, velocity {:.2}, rate {:.2}, {:?} {:?}",
            controller.step_period(),
            vehicle.mass,
            vehicle.inertia,
            initial.tilt_deg,
            initial.tilt_direction_deg,
            initial.heading_deg,
            initial.position,
            initial.velocity,
            initial.rate_body,
            self.disturbance,
            self.scenario.disturbance,
        )
    }
}
