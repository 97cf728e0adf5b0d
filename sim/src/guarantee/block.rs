//! Consecutive ticks in SIMD lanes: what the monitors that work on several ticks at once need of each.

use ctrl_core::controller::StepStatus;
use ctrl_core::vehicle::Wrench;
use glam::Vec3;

use crate::lanes::{LANES, Quaternions, Scalars, Vectors};
use crate::tick::Tick;

/// Up to [`LANES`] ticks in a row; symbols as in the theory. Lanes without a tick hold numbers of no meaning.
#[derive(Clone, Debug, Default)]
pub struct Block {
    count: usize,
    /// `mu` of the tick before the next one.
    latest_mu: Vec3,
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
    /// Begins anew.
    #[inline]
    pub(crate) fn begin_anew(&mut self) {
        self.count = 0;
    }

    /// Begins anew, after the ticks of `before`.
    #[inline]
    pub(crate) fn begin(&mut self, before: &Self) {
        self.begin_anew();
        self.latest_mu = before.latest_mu;
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

    /// `true` if every lane has a tick.
    #[inline]
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.count == LANES
    }

    /// Adds the next tick to a block that is not full.
    #[inline]
    pub fn push(&mut self, tick: &Tick) {
        let lane = self.count;
        let (truth, output) = (&tick.truth, &tick.output);
        self.ticks[lane] = tick.tick;
        self.time[lane] = tick.time;
        self.status[lane] = output.status;
        self.command[lane] = output.wrench;
        self.position.set(lane, truth.position_world);
        self.velocity.set(lane, truth.velocity_world);
        self.attitude.set(lane, truth.attitude);
        self.rate.set(lane, truth.rate_body);
        self.reference.set(lane, tick);
        self.disturbance_acceleration.set(lane, tick.disturbance.acceleration_world);
        self.disturbance_torque.set(lane, tick.disturbance.torque_body);
        self.thrust.as_mut_array()[lane] = output.wrench.thrust.into();
        self.torque.set(lane, output.wrench.torque_body.as_dvec3());
        self.applied_thrust.as_mut_array()[lane] = tick.applied.thrust;
        self.applied_torque.set(lane, tick.applied.torque_body);
        if tick.law {
            self.law.set(lane, tick, self.latest_mu);
            self.latest_mu = tick.intermediates.mu;
        }
        self.count += 1;
    }
}

impl ReferenceLanes {
    #[inline(always)]
    fn set(&mut self, lane: usize, tick: &Tick) {
        let reference = &tick.reference;
        self.position.set(lane, reference.position_world.as_dvec3());
        self.velocity.set(lane, reference.velocity_world.as_dvec3());
        self.acceleration.set(lane, reference.acceleration_world.as_dvec3());
        self.jerk.set(lane, reference.jerk_world.as_dvec3());
        self.specific_force.set(lane, reference.specific_force().value.as_dvec3());
        self.left.set(lane, reference.left_world.as_dvec3());
    }
}

impl LawLanes {
    #[inline(always)]
    fn set(&mut self, lane: usize, tick: &Tick, latest_mu: Vec3) {
        let Tick { output, intermediates, estimates, auxiliary, lasting, .. } = tick;
        self.auxiliary_attitude.set(lane, auxiliary.attitude.as_dquat());
        self.auxiliary_rate.set(lane, auxiliary.rate.as_dvec3());
        self.attitude_error.set(lane, intermediates.attitude_error.as_dquat());
        self.desired_rate.set(lane, intermediates.desired_rate.as_dvec3());
        self.mu.set(lane, intermediates.mu.as_dvec3());
        self.mu_dot.set(lane, intermediates.mu_dot.as_dvec3());
        let regressor_rate = intermediates.mu_dot + intermediates.auxiliary_rate_dot;
        self.regressor_rate.set(lane, regressor_rate.as_dvec3());
        self.mu_change.set(lane, (intermediates.mu - latest_mu).as_dvec3());
        let modelled = intermediates.acting_torque_body - intermediates.torque_body;
        let (torque, demand) = (output.wrench.torque_body + modelled, output.torque_demand_body);
        self.torque.set(lane, torque.as_dvec3());
        self.torque_demand.set(lane, demand.as_dvec3());
        self.torque_excess.set(lane, (torque - demand).as_dvec3());
        self.inverse_mass.as_mut_array()[lane] = estimates.inverse_mass.into();
        self.inertia.set(lane, estimates.inertia.as_dvec3());
        self.inverse_inertia.set(lane, estimates.inverse_inertia.as_dvec3());
        self.gyroscopic_ratio.set(lane, estimates.gyroscopic_ratio.as_dvec3());
        self.lasting_acceleration.set(lane, lasting.acceleration_world.as_dvec3());
        self.lasting_torque.set(lane, lasting.torque_body.as_dvec3());
        self.lasting_angular_acceleration.set(lane, lasting.angular_acceleration_body.as_dvec3());
    }
}
