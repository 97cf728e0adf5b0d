//! Errors of the state that the controller received, of the force that acted, and the ultimate bound that follows.
//!
//! The hypotheses of `docs/guarantees.md#with-an-estimate` are judged on the truth at every tick after settling: the
//! error of the received position and velocity, and the force per mass less what the law asks for. While
//! they hold, the position error of the true vehicle must keep the bound derived from them. With the errors of attitude, rate and mass stated,
//! too, the bound of the force follows from the attitude loop (`#the-attitude-loop` there) and is judged in the same way.

use ctrl_core::controller::ControllerConfig;
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use super::attitude_loop::{Law, ReceivedErrors, ReferenceExtent, Region};
use super::ultimate::{Axis, StateErrorBounds};
use super::verdict::{Extreme, Requirement, Verdict};
use super::{GuaranteeConfig, Monitor};
use crate::norm::Norm;
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
    /// What else the law receives and estimates; from it a bound of the force follows.
    #[serde(default)]
    pub attitude_loop: Option<AttitudeLoopConfig>,
}

/// `[guarantees.state_error.attitude_loop]`: hypotheses of the ultimate bound of the attitude loop, after settling.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AttitudeLoopConfig {
    /// Angle of the error of the received attitude (rad).
    pub attitude: f64,
    /// Error of the received rate, each axis (rad/s).
    pub rate: f64,
    /// Error of the mass estimate, part of the mass.
    pub mass: f64,
}

/// Extremes of the attitude loop.
#[derive(Clone, Copy, Debug)]
struct AttitudeLoop {
    config: AttitudeLoopConfig,
    /// None where the theorem leaves the law out.
    law: Option<Law>,
    attitude: Extreme,
    rate: Extreme,
    mass: Extreme,
    reference: ReferenceExtent,
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
    attitude_loop: Option<AttitudeLoop>,
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
            attitude_loop: hypotheses.attitude_loop.map(|it| AttitudeLoop {
                config: it,
                law: Law::new(law, smoothing(config.settle_time, law)),
                attitude: Extreme::default(),
                rate: Extreme::default(),
                mass: Extreme::default(),
                reference: ReferenceExtent::default(),
            }),
        }
    }
}

/// Width (17) of the smooth sign at `settle_time` (s); it only falls.
fn smoothing(settle_time: f64, law: &ControllerConfig) -> f64 {
    let gains = law.cascade();
    let decay = libm::exp(-2.0 * f64::from(gains.delta_1) * settle_time);
    (decay + f64::from(gains.delta_min_translation).powi(2)).sqrt()
}

/// The bound of the position error along each axis after `settle_time` (s) that follows from `hypotheses` (m); none if what they add
/// is not below `M1` and `M2`.
#[must_use]
pub fn position_bound(
    hypotheses: &StateErrorConfig,
    settle_time: f64,
    law: &ControllerConfig,
) -> Option<f64> {
    let StateErrorConfig { position, velocity, force, .. } = *hypotheses;
    let (gains, integral) = (law.cascade(), law.integral());
    let sign = f64::from(law.uncertainty().disturbance_acceleration);
    let delta = smoothing(settle_time, law);
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
        if let Some(attitude_loop) = &mut self.attitude_loop {
            attitude_loop.observe(tick, self.mass);
        }
    }
}

impl AttitudeLoop {
    fn observe(&mut self, tick: &Tick, mass: f64) {
        let Tick { truth, reference, intermediates, auxiliary, estimates, time, .. } = tick;
        // What the law received, back from its errors: q = q_a q_d q_e with the axes of alpha and b2d.
        let thrust_axis = intermediates.alpha.as_dvec3().unit();
        let left = thrust_axis.cross(
            reference.left_world.as_dvec3().cross(reference.specific_force().value.as_dvec3()),
        );
        let left = left.unit();
        let desired = DMat3::from_cols(left.cross(thrust_axis), left, thrust_axis);
        let received = desired * DMat3::from_quat(intermediates.attitude_error.as_dquat());
        let between = received.transpose() * DMat3::from_quat(truth.attitude);
        self.attitude.highest(angle(&between), *time);
        let rate = intermediates.rate_error + intermediates.mu + auxiliary.rate;
        self.rate.highest((truth.rate_body - rate.as_dvec3()).abs().max_element(), *time);
        let part = 1.0 / (mass * f64::from(estimates.inverse_mass)) - 1.0;
        self.mass.highest(part.abs(), *time);
        self.reference.include(reference);
    }

    /// The region that follows from the hypotheses and the reference as it was.
    fn region(
        &self,
        StateErrorConfig { position, velocity, .. }: StateErrorConfig,
    ) -> Option<Region> {
        let AttitudeLoopConfig { attitude, rate, mass } = self.config;
        let errors = ReceivedErrors { position, velocity, attitude, rate, mass };
        self.law?.region(&errors, &self.reference)
    }

    fn verdicts(&self, of: &StateError) -> Vec<Verdict> {
        const PLACE: &str = "guarantees.md";
        let region = self.region(of.config);
        let row = |name, unit, bound: Option<f64>, extreme| {
            let requirement = bound.map_or(Requirement::Information, Requirement::AtMost);
            Verdict::new((name, PLACE, unit), requirement, extreme)
        };
        let AttitudeLoopConfig { attitude, rate, mass } = self.config;
        vec![
            row("error of the received attitude", "rad", Some(attitude), self.attitude),
            row("error of the received rate, each axis", "rad/s", Some(rate), self.rate),
            row("error of the mass estimate, part", "-", Some(mass), self.mass),
            row(
                "error of the force per mass, bound of the attitude loop",
                "m/s^2",
                region.map(|region| region.force),
                of.force,
            ),
            row(
                "position error, each axis, bound of the attitude loop",
                "m",
                region.map(|region| region.position),
                of.tracking,
            ),
        ]
    }
}

/// Angle of a rotation (rad).
fn angle(rotation: &DMat3) -> f64 {
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = *rotation;
    let sine = 0.5 * DVec3::new(y.z - z.y, z.x - x.z, x.y - y.x).norm();
    libm::atan2(sine, 0.5 * (x.x + y.y + z.z - 1.0))
}

impl Monitor for StateError {
    fn verdicts(&self) -> Vec<Verdict> {
        const PLACE: &str = "guarantees.md";
        let row = |name, unit, bound, extreme| {
            Verdict::new((name, PLACE, unit), Requirement::AtMost(bound), extreme)
        };
        let StateErrorConfig { position, velocity, force, .. } = self.config;
        let mut rows = vec![
            row("error of the received position, each axis", "m", position, self.position),
            row("error of the received velocity, each axis", "m/s", velocity, self.velocity),
            row("error of the force per mass, each axis", "m/s^2", force, self.force),
            row(
                "position error, each axis, derived bound",
                "m",
                self.bound.unwrap_or(f64::NAN),
                self.tracking,
            ),
        ];
        rows.extend(self.attitude_loop.iter().flat_map(|it| it.verdicts(self)));
        rows
    }
}
