//! The numbers of one row.

use ctrl_core::controller::Estimates;
use glam::{DQuat, DVec3, Vec3};

use super::COLUMNS;
use sim::tick::Tick;

/// How many columns are `f32`: all but tick, time, V, its part and the status.
pub(super) const SINGLES: usize = COLUMNS.len() - 5;

/// One row; the numbers in the order of their columns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub tick: u64,
    pub time: f64,
    pub singles: [f32; SINGLES],
    pub lyapunov: [f64; 2],
    pub status: u16,
}

impl Row {
    /// The tick's row.
    pub fn new(tick: &Tick) -> Self {
        Self {
            tick: tick.tick,
            time: tick.time,
            singles: singles(tick),
            lyapunov: [tick.evaluation.value, tick.evaluation.parameter_part],
            status: tick.output.status.bits(),
        }
    }
}

fn singles(tick: &Tick) -> [f32; SINGLES] {
    let Tick { truth, reference, output, applied, estimates, auxiliary, evaluation, .. } = tick;
    let mut singles = Singles { numbers: [0.0; SINGLES], count: 0 };
    singles.vector(truth.position_world.as_vec3());
    singles.vector(truth.velocity_world.as_vec3());
    singles.quaternion(truth.attitude);
    singles.vector(truth.rate_body.as_vec3());
    singles.vector(reference.position_world);
    singles.vector(reference.velocity_world);
    singles.vector(reference.acceleration_world);
    singles.vector(reference.left_world);
    singles.vector(evaluation.position_error.as_vec3());
    singles.quaternion(evaluation.attitude_error);
    singles.append([output.wrench.thrust]);
    singles.vector(output.torque_demand_body);
    singles.vector(output.wrench.torque_body);
    singles.append([applied.thrust as f32]);
    singles.vector(applied.torque_body.as_vec3());
    singles.append([1.0 / estimates.inverse_mass]);
    singles.vector(inertia_estimate(estimates).as_vec3());
    singles.vector(estimates.gyroscopic_ratio);
    singles.quaternion(auxiliary.attitude.as_dquat());
    singles.vector(auxiliary.rate);
    debug_assert_eq!(singles.count, SINGLES);
    singles.numbers
}

/// Numbers being put together.
struct Singles {
    numbers: [f32; SINGLES],
    count: usize,
}

impl Singles {
    #[inline(always)]
    fn append<const N: usize>(&mut self, numbers: [f32; N]) {
        self.numbers[self.count..self.count + N].copy_from_slice(&numbers);
        self.count += N;
    }

    #[inline(always)]
    fn vector(&mut self, v: Vec3) {
        self.append(v.to_array());
    }

    /// Scalar first.
    #[inline(always)]
    fn quaternion(&mut self, q: DQuat) {
        self.append([q.w, q.x, q.y, q.z].map(|component| component as f32));
    }
}

/// `a_hat` or `1/theta_hat` (kg m^2), whichever the controller estimates.
#[must_use]
pub fn inertia_estimate(estimates: &Estimates) -> DVec3 {
    if estimates.inverse_inertia == Vec3::ZERO {
        estimates.inertia.as_dvec3()
    } else {
        estimates.inverse_inertia.as_dvec3().recip()
    }
}
