//! The guarantees of the two theorems, checked tick by tick against the plant's truth.
//!
//! A file a monitor. Each sees every [`Sample`] with its Lyapunov [`Evaluation`] and ends in rows
//! of the verdict table; `docs/guarantees.md` derives what each one may promise.

pub mod angle;
pub mod applied;
pub mod auxiliary;
pub mod estimates;
mod law;
pub mod lyapunov;
pub mod status;
pub mod tracking;
pub mod verdict;
pub mod wrench;

#[cfg(any(test, feature = "test-flight"))]
pub mod test_flight;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

use crate::plant::PlantParameters;
use crate::plant::actuation::ActuationConfig;
use crate::sample::Sample;
use crate::scenario::{ControllerConfig, Scenario};
use lyapunov::Evaluation;
pub use verdict::{Requirement, Verdict};

/// Relative difference that rounding to `f32` may make between a bound and what it bounds.
pub const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

/// `[guarantees]` of a scenario: what the flight must achieve beyond the theorems' own bounds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GuaranteeConfig {
    /// From when on the error bounds below hold; a flight that ends before fails them (s).
    pub settle_time: f64,
    /// Bound of the distance between vehicle and reference (m).
    pub position_error_max: f64,
    /// Bound of the angle of `q_e`, the attitude error of the law (rad).
    pub attitude_error_max: f64,
    /// Bound of the angle between body z and the reference's thrust direction `b3d` (rad).
    pub tilt_error_max: f64,
    /// Bound of the angle between body y and the reference's `b2d` (rad).
    pub heading_error_max: f64,
    /// Length of the windows over which V may not rise outside its ultimate set (s).
    pub lyapunov_window: f64,
}

/// Watches one guarantee.
pub trait Monitor {
    /// Called once a tick, in order.
    fn observe(&mut self, sample: &Sample, evaluation: &Evaluation);

    /// The rows of the table so far.
    fn verdicts(&self) -> Vec<Verdict>;
}

/// Every monitor of a flight.
#[derive(Clone, Debug)]
pub struct Guarantees {
    thrust: wrench::Thrust,
    torque: wrench::Torque,
    applied: applied::Applied,
    estimates: estimates::EstimateSets,
    tracking: tracking::Tracking,
    auxiliary: auxiliary::AuxiliaryRest,
    lyapunov: lyapunov::LyapunovMonitor,
    status: status::Faults,
}

impl Guarantees {
    /// The monitors of a flight of `scenario`.
    #[must_use]
    pub fn of(scenario: &Scenario) -> Self {
        let Scenario { guarantees, controller, vehicle, .. } = scenario;
        Self::new(guarantees, controller, &(*vehicle).into(), &scenario.effective_actuation())
    }

    /// The monitors that `law` calls for on a vehicle with `parameters` and `actuation`.
    #[must_use]
    pub fn new(
        config: &GuaranteeConfig,
        law: &ControllerConfig,
        parameters: &PlantParameters,
        actuation: &ActuationConfig,
    ) -> Self {
        Self {
            thrust: wrench::Thrust::new(law),
            torque: wrench::Torque::new(law),
            applied: applied::Applied::new(actuation),
            estimates: estimates::EstimateSets::new(law),
            tracking: tracking::Tracking::new(config),
            auxiliary: auxiliary::AuxiliaryRest::new(law),
            lyapunov: lyapunov::LyapunovMonitor::new(config, law, parameters, actuation),
            status: status::Faults::default(),
        }
    }

    /// Passes one tick to every monitor.
    pub fn observe(&mut self, sample: &Sample, evaluation: &Evaluation) {
        self.thrust.observe(sample, evaluation);
        self.torque.observe(sample, evaluation);
        self.applied.observe(sample, evaluation);
        self.estimates.observe(sample, evaluation);
        self.tracking.observe(sample, evaluation);
        self.auxiliary.observe(sample, evaluation);
        self.lyapunov.observe(sample, evaluation);
        self.status.observe(sample, evaluation);
    }

    /// The whole table.
    #[must_use]
    pub fn verdicts(&self) -> Vec<Verdict> {
        self.monitors().iter().flat_map(|monitor| monitor.verdicts()).collect()
    }

    fn monitors(&self) -> [&dyn Monitor; 8] {
        let Self { thrust, torque, applied, estimates, tracking, auxiliary, lyapunov, status } =
            self;
        [thrust, torque, applied, estimates, tracking, auxiliary, lyapunov, status]
    }
}
