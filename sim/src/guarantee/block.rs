//! Consecutive ticks in SIMD lanes: what the monitors that work on several ticks at once need of each.

use core::array::from_fn;

use ctrl_core::controller::{Estimates, Intermediates, LastingEstimates, StepStatus};
use ctrl_core::vehicle::Wrench;
use glam::{DVec3, Vec3};

use crate::lanes::{LANES, Quaternions, Scalars, Vectors};
use crate::tick::Tick;

/// Up to [`LANES`] ticks in a row; symbols as in the theory. Lanes without a tick repeat the last one.
#[derive(Clone, Debug, Default)]
pub struct Block {
    count: usize,
    pub(crate) ticks: [u64; LANES],
    pub(crate) time: [f64; LANES],
    pub(crate) status: [StepStatus; LANES],
    pub(crate) command: [Wrench; LANES],
    pub(crate) position: Vectors,
    pub(crate) velocity: Vectors,
    pub(crate) attitude: Quaternions,
    pub(crate) rate: Vectors,
    pub(crate) reference: ReferenceLanes,
    pub(crate) disturbance_acceleration: Vectors,
    pub(crate) disturbance_torque: Vectors,
    /// Commanded wrench, and the one that acts at the tick's instant.
    pub(crate) thrust: Scalars,
    pub(crate) torque: Vectors,
    pub(crate) applied_thrust: Scalars,
    pub(crate) applied_torque: Vectors,
    pub(crate) law: LawLanes,
}

/// The reference of each tick.
#[derive(Clone, Debug, Default)]
pub(crate) struct ReferenceLanes {
    pub position: Vectors,
    pub velocity: Vectors,
    pub acceleration: Vectors,
    pub jerk: Vectors,
    /// `p_d'' + g e3`.
    pub specific_force: Vectors,
    /// `b2d`.
    pub left: Vectors,
}

/// Quantities of a law of the paper.
#[derive(Clone, Debug, Default)]
pub(crate) struct LawLanes {
    /// `q_a`, `w_a`.
    pub auxiliary_attitude: Quaternions,
    pub auxiliary_rate: Vectors,
    /// `q_e` as the law chose its sign.
    pub attitude_error: Quaternions,
    pub desired_rate: Vectors,
    pub mu: Vectors,
    pub mu_dot: Vectors,
    /// `mu' + w_a'`, which the regressor of controller 1 has behind rotors that it models.
    pub regressor_rate: Vectors,
    /// Change of `mu` since the tick before, in the law's `f32`.
    pub mu_change: Vectors,
    /// Torque that the law takes to act over the tick: the commanded one without a model of the rotors.
    pub torque: Vectors,
    pub torque_demand: Vectors,
    /// That torque less the demand, in the law's `f32`.
    pub torque_excess: Vectors,
    pub inverse_mass: Scalars,
    pub inertia: Vectors,
    pub inverse_inertia: Vectors,
    pub gyroscopic_ratio: Vectors,
    pub lasting_acceleration: Vectors,
    pub lasting_torque: Vectors,
    pub lasting_angular_acceleration: Vectors,
}

impl Block {
    /// Takes one to [`LANES`] ticks, which follow one with the virtual rate `latest_mu` (rad/s).
    pub fn gather(&mut self, ticks: &[Tick], latest_mu: Vec3) {
        let count = ticks.len().min(LANES);
        let last = count.saturating_sub(1);
        let t: [&Tick; LANES] = from_fn(|lane| &ticks[lane.min(last)]);
        self.count = count;
        self.ticks = t.map(|it| it.tick);
        self.time = t.map(|it| it.time);
        self.status = t.map(|it| it.output.status);
        self.command = t.map(|it| it.output.wrench);
        self.position = vectors(t, |it| it.truth.position_world);
        self.velocity = vectors(t, |it| it.truth.velocity_world);
        self.attitude = Quaternions::of(t.map(|it| it.truth.attitude));
        self.rate = vectors(t, |it| it.truth.rate_body);
        self.reference = ReferenceLanes::new(t);
        self.disturbance_acceleration = vectors(t, |it| it.disturbance.acceleration_world);
        self.disturbance_torque = vectors(t, |it| it.disturbance.torque_body);
        self.thrust = singles(t, |it| it.output.wrench.thrust);
        self.torque = vectors(t, |it| it.output.wrench.torque_body.as_dvec3());
        self.applied_thrust = Scalars::new(t.map(|it| it.applied.thrust));
        self.applied_torque = vectors(t, |it| it.applied.torque_body);
        if t[0].law {
            self.law = LawLanes::new(t);
            let mu = t.map(|it| it.intermediates.mu);
            let change = [mu[0] - latest_mu, mu[1] - mu[0], mu[2] - mu[1], mu[3] - mu[2]];
            self.law.mu_change = Vectors::of(change.map(Vec3::as_dvec3));
        }
    }

    /// Ticks in the block.
    #[inline]
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// The lanes that have a tick, a bit each.
    #[inline]
    pub(super) fn lanes(&self) -> u32 {
        (1 << self.count) - 1
    }
}

/// A vector of each tick.
#[inline(always)]
fn vectors(ticks: [&Tick; LANES], of: impl Fn(&Tick) -> DVec3) -> Vectors {
    Vectors::of(ticks.map(of))
}

/// A number of the law's of each tick.
#[inline(always)]
fn singles(ticks: [&Tick; LANES], of: impl Fn(&Tick) -> f32) -> Scalars {
    Scalars::new(ticks.map(|it| of(it).into()))
}

impl ReferenceLanes {
    #[inline(always)]
    fn new(t: [&Tick; LANES]) -> Self {
        Self {
            position: vectors(t, |it| it.reference.position_world.as_dvec3()),
            velocity: vectors(t, |it| it.reference.velocity_world.as_dvec3()),
            acceleration: vectors(t, |it| it.reference.acceleration_world.as_dvec3()),
            jerk: vectors(t, |it| it.reference.jerk_world.as_dvec3()),
            specific_force: vectors(t, |it| it.reference.specific_force().value.as_dvec3()),
            left: vectors(t, |it| it.reference.left_world.as_dvec3()),
        }
    }
}

impl LawLanes {
    /// All but the change of `mu`.
    #[inline(always)]
    fn new(t: [&Tick; LANES]) -> Self {
        let seen =
            |of: fn(&Intermediates) -> Vec3| vectors(t, move |it| of(&it.intermediates).as_dvec3());
        let estimated =
            |of: fn(&Estimates) -> Vec3| vectors(t, move |it| of(&it.estimates).as_dvec3());
        let lasting =
            |of: fn(&LastingEstimates) -> Vec3| vectors(t, move |it| of(&it.lasting).as_dvec3());
        // The commanded torque, and what a model of the rotors makes of it.
        let torque = t.map(|it| {
            let Intermediates { acting_torque_body, torque_body, .. } = it.intermediates;
            it.output.wrench.torque_body + (acting_torque_body - torque_body)
        });
        let demand = t.map(|it| it.output.torque_demand_body);
        Self {
            auxiliary_attitude: Quaternions::of(t.map(|it| it.auxiliary.attitude.as_dquat())),
            auxiliary_rate: vectors(t, |it| it.auxiliary.rate.as_dvec3()),
            attitude_error: Quaternions::of(t.map(|it| it.intermediates.attitude_error.as_dquat())),
            desired_rate: seen(|it| it.desired_rate),
            mu: seen(|it| it.mu),
            mu_dot: seen(|it| it.mu_dot),
            regressor_rate: seen(|it| it.mu_dot + it.auxiliary_rate_dot),
            mu_change: Vectors::default(),
            torque: Vectors::of(torque.map(Vec3::as_dvec3)),
            torque_demand: Vectors::of(demand.map(Vec3::as_dvec3)),
            torque_excess: Vectors::of(from_fn(|lane| (torque[lane] - demand[lane]).as_dvec3())),
            inverse_mass: singles(t, |it| it.estimates.inverse_mass),
            inertia: estimated(|it| it.inertia),
            inverse_inertia: estimated(|it| it.inverse_inertia),
            gyroscopic_ratio: estimated(|it| it.gyroscopic_ratio),
            lasting_acceleration: lasting(|it| it.acceleration_world),
            lasting_torque: lasting(|it| it.torque_body),
            lasting_angular_acceleration: lasting(|it| it.angular_acceleration_body),
        }
    }
}
