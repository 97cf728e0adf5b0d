//! The guarantees of the two theorems, checked tick by tick against the plant's truth.
//!
//! One file per monitor. Each observes every [`Tick`] and ends in rows of the verdict table;
//! `docs/guarantees.md` derives the bounds.

pub mod activity;
pub mod angle;
pub mod applied;
mod attitude_loop;
pub mod auxiliary;
mod block;
mod blocks;
pub mod bounds;
mod difference;
pub mod estimates;
pub mod lyapunov;
pub mod state_error;
pub mod status;
pub mod tracking;
pub mod ultimate;
pub mod verdict;
pub mod wrench;

#[cfg(any(test, feature = "test-flight"))]
pub mod test_flight;
#[cfg(test)]
mod tests;

use std::fmt::Debug;

use ctrl_core::controller::ControllerConfig;
use serde::{Deserialize, Serialize};

use crate::observer::Observer;
use crate::plant::PlantParameters;
use crate::plant::actuation::ActuationConfig;
use crate::tick::Tick;
use blocks::BlockMonitors;
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
    /// Hypotheses on the state's error, from which a bound of the position error follows.
    #[serde(default)]
    pub state_error: Option<state_error::StateErrorConfig>,
}

/// The check of one guarantee: an observer that ends in rows of the table.
pub trait Monitor: Observer + Debug {
    /// The rows of the table so far.
    fn verdicts(&self) -> Vec<Verdict>;
}

/// Every monitor of a flight: the built-in ones, and any that the caller adds.
#[derive(Debug)]
pub struct Guarantees {
    applied: applied::Applied,
    activity: activity::TorqueActivity,
    blocks: BlockMonitors,
    status: status::Faults,
    law: Option<LawMonitors>,
    added: Vec<Box<dyn Monitor + Send>>,
}

/// Monitors of the theorems, for a law of the paper.
#[derive(Clone, Debug)]
struct LawMonitors {
    thrust: wrench::Thrust,
    torque: wrench::Torque,
    auxiliary: auxiliary::AuxiliaryRest,
    state_error: Option<state_error::StateError>,
}

impl Guarantees {
    /// The monitors that `law` calls for on a vehicle with `parameters` and `actuation`.
    #[must_use]
    pub fn new(
        config: &GuaranteeConfig,
        law: &ControllerConfig,
        parameters: &PlantParameters,
        actuation: &ActuationConfig,
    ) -> Self {
        let monitors = LawMonitors {
            thrust: wrench::Thrust::new(law),
            torque: wrench::Torque::new(law),
            auxiliary: auxiliary::AuxiliaryRest::new(law),
            state_error: config
                .state_error
                .map(|it| state_error::StateError::new(&it, config, law, parameters)),
        };
        let tracking = tracking::Tracking::new(config);
        let lyapunov = lyapunov::LyapunovMonitor::new(config, law, parameters, actuation);
        let estimates = estimates::EstimateSets::new(law);
        let blocks = BlockMonitors::new(tracking, Some((estimates, lyapunov)));
        Self { law: Some(monitors), blocks, ..Self::of_any_controller(config, actuation) }
    }

    /// The monitors that need no law of the paper: tracking errors, limits of the rotors, torque activity, faults.
    #[must_use]
    pub fn of_any_controller(config: &GuaranteeConfig, actuation: &ActuationConfig) -> Self {
        Self {
            applied: applied::Applied::new(actuation),
            activity: activity::TorqueActivity::default(),
            blocks: BlockMonitors::new(tracking::Tracking::of_any_controller(config), None),
            status: status::Faults::default(),
            law: None,
            added: Vec::new(),
        }
    }

    /// The monitors of a flight whose controller receives an estimate: nothing is guaranteed of V, which the
    /// monitors show as information; limits, sets and errors are judged as before.
    #[must_use]
    pub fn by_estimate(mut self) -> Self {
        if let Some(lyapunov) = self.blocks.lyapunov() {
            lyapunov.set_by_estimate();
        }
        self
    }

    /// The monitors of a flight by [rotors](crate::plant::rotors): as [`by_estimate`](Self::by_estimate), and what they
    /// make of the command is shown.
    #[must_use]
    pub fn by_rotors(mut self) -> Self {
        self.applied.show();
        self.by_estimate()
    }

    /// Adds a monitor of the caller's; its rows follow the built-in ones.
    #[must_use]
    pub fn with(mut self, monitor: impl Monitor + Send + 'static) -> Self {
        self.added.push(Box::new(monitor));
        self
    }

    /// The whole table.
    #[must_use]
    pub fn verdicts(&self) -> Vec<Verdict> {
        let Self { applied, activity, blocks, status, law, added } = self;
        let [estimates, tracking, lyapunov] = blocks.verdicts();
        let mut rows = Vec::new();
        if let Some(LawMonitors { thrust, torque, .. }) = law {
            rows.extend(thrust.verdicts());
            rows.extend(torque.verdicts());
        }
        rows.extend(applied.verdicts());
        rows.extend(activity.verdicts());
        rows.extend(estimates);
        rows.extend(tracking);
        if let Some(LawMonitors { auxiliary, state_error, .. }) = law {
            rows.extend(state_error.iter().flat_map(Monitor::verdicts));
            rows.extend(auxiliary.verdicts());
        }
        rows.extend(lyapunov);
        rows.extend(status.verdicts());
        rows.extend(added.iter().flat_map(|monitor| monitor.verdicts()));
        rows
    }
}

impl Guarantees {
    /// The monitors that work tick by tick.
    #[inline]
    fn observe_each(&mut self, tick: &Tick) {
        if let Some(law) = &mut self.law {
            law.thrust.observe(tick);
            law.torque.observe(tick);
            law.auxiliary.observe(tick);
            if let Some(state_error) = &mut law.state_error {
                state_error.observe(tick);
            }
        }
        self.applied.observe(tick);
        self.activity.observe(tick);
        self.status.observe(tick);
        self.added.iter_mut().for_each(|monitor| monitor.observe(tick));
    }
}

impl Observer for Guarantees {
    fn observe(&mut self, tick: &Tick) {
        self.observe_each(tick);
        self.blocks.observe(tick);
    }

    fn observe_ticks(&mut self, ticks: &[Tick]) {
        ticks.iter().for_each(|tick| self.observe_each(tick));
        self.blocks.observe_ticks(ticks);
    }
}
