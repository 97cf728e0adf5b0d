//! Correction by one measurement: one number after the other, each through the gate.

use glam::{Mat3, Quat, Vec2, Vec3};

use super::covariance::{Projection, Row, STATES};
use super::history::Motion;
use super::measurement::{Measurement, Source, Verdict};
use super::state::EstimatorState;
use super::{Estimator, Restart};
use crate::rotation::{renormalised, rotate, vector_part};
use crate::sqrt::sqrt;

/// Largest magnitude of a measured number.
const NUMBER_MAX: f32 = 1e7;
/// Largest attitude correction about one axis at once (rad).
const TURN_MAX: f32 = 0.5;
/// Smallest cosine of the tilt at which the ground is seen.
const COSINE_MIN: f32 = 0.5;
/// Smallest distance at which the ground's flow is used (m).
const DISTANCE_MIN: f32 = 0.05;
/// Smallest horizontal part of the magnetic field that still is a heading, of its length.
const HORIZONTAL_MIN: f32 = 0.05;

/// Correction of all states, gathered over the numbers of one measurement.
struct Gathered {
    correction: [f32; STATES],
    normalised: f32,
    components: u8,
}

impl Estimator {
    /// Takes a measurement in, unless its sensor is at fault or it lies outside the gate.
    #[inline(always)]
    pub fn correct(&self, state: &mut EstimatorState, measurement: &Measurement) -> Verdict {
        let source = measurement.source();
        let numbers = measurement.numbers();
        let (step, limits) = (state.step, &self.config.faults);
        let health = &mut state.sources[source as usize];
        let stuck = health.is_stuck(&numbers, limits.repetitions);
        if !numbers.iter().all(|x| x.abs() <= NUMBER_MAX) {
            health.refuse();
            return Verdict::Unusable;
        }
        if stuck {
            return Verdict::Stuck;
        }
        let verdict = self.take(state, measurement, source);
        let health = &mut state.sources[source as usize];
        match verdict {
            Verdict::Accepted { .. } => health.accept(step),
            Verdict::Rejected => {
                health.reject();
                return self.after_rejection(state, measurement, source);
            }
            Verdict::Inapplicable => {}
            _ => health.refuse(),
        }
        verdict
    }

    /// Compares the measurement with the state at its own time.
    #[inline(always)]
    fn take(
        &self,
        state: &mut EstimatorState,
        measurement: &Measurement,
        source: Source,
    ) -> Verdict {
        let config = self.config.source(source);
        let steps = config.delay / self.config.step_period;
        let motion = state.history.motion(steps, self.slot_spacing);
        let (r, rz) = (
            config.deviation * config.deviation,
            config.deviation_vertical * config.deviation_vertical,
        );
        let noise = [r, r, rz];
        match *measurement {
            Measurement::Barometer(height) => {
                let past = state.position_world.z - motion.displacement.z + state.barometer_bias;
                let bias = if self.config.barometer_bias.deviation > 0.0 { 1.0 } else { 0.0 };
                let row = Row::Barometer { bias, rate: -config.delay };
                self.apply(state, [height - past], [row], [r])
            }
            Measurement::GnssPosition(position) | Measurement::CapturePosition(position) => {
                let innovation = position - (state.position_world - motion.displacement);
                // p(t - d) = p - d v; what the errors of tilt and bias add, of second order in d, is left out.
                let rows = [0, 1, 2].map(|axis| Row::Position { axis, rate: -config.delay });
                self.apply(state, innovation.to_array(), rows, noise)
            }
            Measurement::GnssVelocity(velocity) => {
                let innovation = velocity - (state.velocity_world - motion.gained_velocity);
                let rows = past_velocity(state, config.delay);
                self.apply(state, innovation.to_array(), rows, noise)
            }
            Measurement::CaptureAttitude(attitude) => {
                let Some(innovation) = turned_from(state, attitude, &motion) else {
                    return Verdict::Unusable;
                };
                self.apply(state, innovation.to_array(), Vec3::AXES.map(Row::Attitude), noise)
            }
            Measurement::Magnetometer(field) => match self.heading(state, field, &motion) {
                Some((innovation, row)) => self.apply(state, [innovation], [row], [r]),
                None => Verdict::Unusable,
            },
            Measurement::Rangefinder(distance) => match Ground::seen(state, &motion) {
                Some(ground) => {
                    let (innovation, row) = ground.range(distance, -config.delay);
                    self.apply(state, [innovation], [row], [r * ground.cosine * ground.cosine])
                }
                None => Verdict::Inapplicable,
            },
            Measurement::OpticalFlow(flow) => match Ground::seen(state, &motion) {
                Some(ground) if ground.distance() >= DISTANCE_MIN => {
                    let d = ground.distance();
                    let (innovations, rows) = ground.flow(state, flow, &motion);
                    self.apply(state, innovations, rows, [r * d * d; 2])
                }
                _ => Verdict::Inapplicable,
            },
        }
    }

    /// All numbers of a measurement, or none of them if one lies outside the gate.
    #[inline(never)]
    fn apply<const N: usize>(
        &self,
        state: &mut EstimatorState,
        innovations: [f32; N],
        rows: [Row; N],
        noises: [f32; N],
    ) -> Verdict {
        let gate = self.config.faults.gate;
        let inside = |projection: &Projection, innovation: f32| {
            innovation * innovation <= gate * projection.variance
        };
        for ((innovation, row), noise) in innovations.iter().zip(&rows).zip(&noises).skip(1) {
            if !inside(&state.covariance.project(row, *noise), *innovation) {
                return Verdict::Rejected;
            }
        }
        let mut gathered = Gathered { correction: [0.0; STATES], normalised: 0.0, components: 0 };
        for ((innovation, row), noise) in innovations.iter().zip(&rows).zip(&noises) {
            let projection = state.covariance.project(row, *noise);
            let rest = innovation - row.of(&gathered.correction);
            if gathered.components == 0 && !inside(&projection, rest) {
                return Verdict::Rejected;
            }
            let gain = state.covariance.correct(&projection);
            for (correction, k) in gathered.correction.iter_mut().zip(&gain) {
                *correction += k * rest;
            }
            gathered.normalised += rest * rest / projection.variance;
            gathered.components += 1;
        }
        shift(state, &gathered.correction);
        Verdict::Accepted { normalised: gathered.normalised, components: gathered.components }
    }

    /// Innovation of the heading, and its row: `-theta_z + (m_z/m_h) (n . theta)` is the angle by which the
    /// field, turned by the estimate, misses its known direction `n`. The row holds the known field's
    /// inclination, not the measured one: rows that differ by noise would claim to tell tilt from heading.
    fn heading(
        &self,
        state: &EstimatorState,
        field_body: Vec3,
        motion: &Motion,
    ) -> Option<(f32, Row)> {
        let then = renormalised(state.attitude * motion.rotation)?;
        let field = rotate(then, field_body);
        let square = field.x * field.x + field.y * field.y;
        let whole = square + field.z * field.z;
        // All are finite: the numbers have passed their range.
        if square <= HORIZONTAL_MIN * HORIZONTAL_MIN * whole {
            return None;
        }
        let horizontal = sqrt(square);
        let north = self.north;
        let sine = (field.x * north.y - field.y * north.x) / horizontal;
        let cosine = field.x * north.x + field.y * north.y;
        // Beyond a right angle the sine would fall again.
        let innovation = if cosine >= 0.0 { sine } else { 1.0f32.copysign(sine) };
        let dip = self.dip;
        let row = Vec3::new(-dip * north.x, -dip * north.y, 1.0);
        Some((innovation, Row::Attitude(row)))
    }

    /// A position source that keeps disagreeing is believed when no other position has been accepted
    /// within its timeout: the vehicle is where it measured, and what it has moved since.
    #[inline(never)]
    fn after_rejection(
        &self,
        state: &mut EstimatorState,
        measurement: &Measurement,
        source: Source,
    ) -> Verdict {
        let position = match *measurement {
            Measurement::GnssPosition(position) | Measurement::CapturePosition(position) => {
                position
            }
            _ => return Verdict::Rejected,
        };
        let recent = |source: Source| {
            let timeout = self.config.source(source).timeout / self.config.step_period;
            let age = state.sources[source as usize].age(state.step);
            age.is_some_and(|age| age as f32 <= timeout)
        };
        let rejections = state.sources[source as usize].rejections();
        if recent(Source::GnssPosition)
            || recent(Source::CapturePosition)
            || rejections < self.config.faults.rejections
        {
            return Verdict::Rejected;
        }
        let steps = self.config.source(source).delay / self.config.step_period;
        let position = position + state.history.motion(steps, self.slot_spacing).displacement;
        let count = state.restart.count.wrapping_add(1);
        let shift = position - state.position_world;
        state.restart = Restart { count, position_shift_world: shift };
        state.position_world = position;
        let (position, velocity) = self.config.restart_variances(source);
        state.covariance.restart(position, velocity);
        state.sources[source as usize].accept(state.step);
        Verdict::Restarted
    }
}

/// Rows of the velocity `d` ago, `v(t - d) = v - d (theta × R a - R b_a)`: the effects of tilt and bias nearly
/// cancel, so that one of them without the other would be worse than neither.
fn past_velocity(state: &EstimatorState, d: f32) -> [Row; 3] {
    if d <= 0.0 {
        return [0, 1, 2].map(Row::Velocity);
    }
    let to_world = Mat3::from_quat(state.attitude);
    let a = d * (to_world * (state.held.specific_force_body - state.accelerometer_bias));
    let bias = (to_world * d).transpose();
    [
        Row::PastVelocity { axis: 0, attitude: Vec3::new(0.0, -a.z, a.y), bias: bias.x_axis },
        Row::PastVelocity { axis: 1, attitude: Vec3::new(a.z, 0.0, -a.x), bias: bias.y_axis },
        Row::PastVelocity { axis: 2, attitude: Vec3::new(-a.y, a.x, 0.0), bias: bias.z_axis },
    ]
}

/// Flat ground at height zero as the body saw it.
struct Ground {
    height: f32,
    /// Body axes in world axes.
    axes: Mat3,
    /// Cosine of the tilt.
    cosine: f32,
}

impl Ground {
    /// None when the body's axis is tilted too far.
    fn seen(state: &EstimatorState, motion: &Motion) -> Option<Self> {
        let then = renormalised(state.attitude * motion.rotation)?;
        let axes = Mat3::from_quat(then);
        let cosine = axes.z_axis.z;
        let height = state.position_world.z - motion.displacement.z;
        (cosine >= COSINE_MIN).then_some(Self { height, axes, cosine })
    }

    /// Along the body's -z axis (m).
    fn distance(&self) -> f32 {
        self.height / self.cosine
    }

    /// Derivative of the cosine by the attitude errors about x and y: `e3 . (theta × b3)`.
    fn cosine_by_attitude(&self) -> Vec2 {
        Vec2::new(self.axes.z_axis.y, -self.axes.z_axis.x)
    }

    /// `r c - h`, a height, and its row `dh - (h/c) dc`.
    fn range(&self, distance: f32, rate: f32) -> (f32, Row) {
        let attitude = -self.distance() * self.cosine_by_attitude();
        (distance * self.cosine - self.height, Row::Range { rate, attitude })
    }

    /// `d (flow + bias) - v . b_k` for the body axes `b_1` and `b_2`, velocities, and their rows.
    fn flow(&self, state: &EstimatorState, flow: Vec2, motion: &Motion) -> ([f32; 2], [Row; 2]) {
        let (d, bias) = (self.distance(), state.gyro_bias);
        let velocity = state.velocity_world - motion.gained_velocity;
        let seen = d * (flow - Vec2::new(bias.y, -bias.x));
        let along = |axis: Vec3| velocity.dot(axis);
        let Self { axes, cosine, .. } = self;
        let row = |axis: Vec3, bias: Vec2| {
            let per_height = along(axis) / cosine;
            // A longer way along the tilted axis: the same flow is more velocity.
            let longer = (per_height * self.cosine_by_attitude()).extend(0.0);
            let attitude = axis.cross(velocity) + longer;
            Row::Flow { height: -per_height / d, velocity: axis, attitude, bias }
        };
        let innovations = [seen.x - along(axes.x_axis), seen.y - along(axes.y_axis)];
        (innovations, [row(axes.x_axis, d * Vec2::Y), row(axes.y_axis, -d * Vec2::X)])
    }
}

/// Rotation vector in world axes from the estimated to the measured attitude; none if the measurement is
/// no quaternion of unit length.
fn turned_from(state: &EstimatorState, measured: Quat, motion: &Motion) -> Option<Vec3> {
    let then = renormalised(state.attitude * motion.rotation)?;
    let error = renormalised(measured)? * then.conjugate();
    let sign = if error.w < 0.0 { -2.0 } else { 2.0 };
    Some(sign * vector_part(error))
}

/// Shifts the state by a correction of its error.
#[inline(always)]
fn shift(state: &mut EstimatorState, correction: &[f32; STATES]) {
    let [b, p0, p1, p2, v0, v1, v2, t0, t1, t2, g0, g1, g2, a0, a1, a2] = *correction;
    state.position_world += Vec3::new(p0, p1, p2);
    state.velocity_world += Vec3::new(v0, v1, v2);
    let limit = Vec3::splat(TURN_MAX);
    let half = 0.5 * Vec3::new(t0, t1, t2).max(-limit).min(limit);
    let turn = Quat::from_xyzw(half.x, half.y, half.z, 1.0 - 0.5 * half.length_squared());
    state.attitude = renormalised(renormalised(turn).unwrap_or(Quat::IDENTITY) * state.attitude)
        .unwrap_or(state.attitude);
    let gyro_bias = Vec3::new(g0, g1, g2);
    state.gyro_bias += gyro_bias;
    state.rate_body -= gyro_bias;
    state.accelerometer_bias += Vec3::new(a0, a1, a2);
    state.barometer_bias += b;
}
