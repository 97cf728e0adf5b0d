//! Errors of the state that the controller received, of the force that acted, and the ultimate bound that follows.
//!
//! The hypotheses of `docs/guarantees.md#with-an-estimate` are judged on the truth at every tick after settling: the
//! error of the received position and velocity, and the force per mass less what the law asks for. While
//! they hold, the position error of the true vehicle must keep the bound derived from them.

use ctrl_core::controller::ControllerConfig;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::ultimate::{Axis, StateErrorBounds};
use super::verdict::{Extreme, Requirement, Verdict};
use super::{GuaranteeConfig, Monitor};
use crate::observer::Observer;
use crate::plant::PlantParameters;
use crate::tick::Tick;

/// `[guarantees.state_error]` of a scenario: hypotheses of the ultimate bound, each axis, after settling.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StateErrorConfig {
    /// Error of the position that the controller receives (m).
    pub position: f64,
    /// Error of the velocity that the controller receives (m/s).
    pub velocity: f64,
    /// Force per mass that acts, less what the law asks for: attitude, mass estimate, rotors (m/s^2).
    pub force: f64,
}

/// The monitor.
#[derive(Clone, Copy, Debug)]
pub struct StateError {
    config: StateErrorConfig,
    settle_time: f64,
    mass: f64,
    /// The derived bound; none where the hypotheses give none.
    bound: Option<f64>,
    position: Extreme,
    velocity: Extreme,
    force: Extreme,
    tracking: Extreme,
}

impl StateError {
    /// The monitor for `law` on a vehicle with `parameters`.
    #[must_use]
    pub fn new(
        hypotheses: &StateErrorConfig,
        config: &GuaranteeConfig,
        law: &ControllerConfig,
        parameters: &PlantParameters,
    ) -> Self {
        Self {
            config: *hypotheses,
            settle_time: config.settle_time,
            mass: parameters.mass,
            bound: position_bound(hypotheses, config.settle_time, law),
            position: Extreme::default(),
            velocity: Extreme::default(),
            force: Extreme::default(),
            tracking: Extreme::default(),
        }
    }
}

/// The bound of the position error along each axis after `settle_time` (s) that follows from `hypotheses` (m); none if what they add
/// is not below `M1` and `M2`.
#[must_use]
pub fn position_bound(
    hypotheses: &StateErrorConfig,
    settle_time: f64,
    law: &ControllerConfig,
) -> Option<f64> {
    let StateErrorConfig { position, velocity, force } = *hypotheses;
    let (gains, integral) = (law.cascade(), law.integral());
    let sign = f64::from(law.uncertainty().disturbance_acceleration);
    // (17) at the settling time; it only falls.
    let decay = libm::exp(-2.0 * f64::from(gains.delta_1) * settle_time);
    let delta = (decay + f64::from(gains.delta_min_translation).powi(2)).sqrt();
    // An estimate of the integral action is off by twice its bound at most.
    let force = force + 2.0 * f64::from(integral.acceleration_max);
    Axis::new(gains, sign, delta).position_bound(&StateErrorBounds { position, velocity, force })
}

/// Errors of the received position and velocity, and of the force per mass, at one tick.
fn errors(tick: &Tick, mass: f64) -> [DVec3; 3] {
    let Tick { truth, reference, intermediates, .. } = tick;
    let velocity_error = truth.velocity_world - reference.velocity_world.as_dvec3();
    let asked = f64::from(tick.estimates.inverse_mass) * intermediates.alpha.as_dvec3();
    [
        tick.position_error() - intermediates.position_error_world.as_dvec3(),
        velocity_error - intermediates.velocity_error_world.as_dvec3(),
        truth.attitude * DVec3::Z * (tick.applied.thrust / mass) - asked,
    ]
}

impl Observer for StateError {
    fn observe(&mut self, tick: &Tick) {
        // The intermediate quantities of a step that held its output are zero.
        if tick.time < self.settle_time || tick.intermediates.thrust == 0.0 {
            return;
        }
        let [position, velocity, force] = errors(tick, self.mass);
        self.position.highest(position.abs().max_element(), tick.time);
        self.velocity.highest(velocity.abs().max_element(), tick.time);
        self.force.highest(force.abs().max_element(), tick.time);
        self.tracking.highest(tick.position_error().abs().max_element(), tick.time);
    }
}

impl Monitor for StateError {
    fn verdicts(&self) -> Vec<Verdict> {
        const PLACE: &str = "guarantees.md";
        let row = |name, unit, bound, extreme| {
            Verdict::new((name, PLACE, unit), Requirement::AtMost(bound), extreme)
        };
        let StateErrorConfig { position, velocity, force } = self.config;
        vec![
            row("error of the received position, each axis", "m", position, self.position),
            row("error of the received velocity, each axis", "m/s", velocity, self.velocity),
            row("error of the force per mass, each axis", "m/s^2", force, self.force),
            row(
                "position error, each axis, derived bound",
                "m",
                self.bound.unwrap_or(f64::NAN),
                self.tracking,
            ),
        ]
    }
}
