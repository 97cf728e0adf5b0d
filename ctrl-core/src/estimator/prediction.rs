//! Prediction: strapdown integration of one inertial sample, and the covariance beside it.

use glam::{Mat3, Quat, Vec3};

use super::covariance::{ACCELEROMETER_BIAS, ATTITUDE, GYRO_BIAS, Jacobian, VELOCITY};
use super::measurement::InertialSample;
use super::state::EstimatorState;
use super::{Estimator, Restart};
use crate::rotation::renormalised;
use crate::vehicle::GRAVITY;

/// Predictions after which each bias state has had its noise.
pub const TURNS: u8 = 6;
/// Largest rate that a sample may have (rad/s).
pub const RATE_MAX: f32 = 200.0;
/// Largest specific force that a sample may have (m/s^2).
const FORCE_MAX: f32 = 2_000.0;
/// Largest distance and speed that an estimate may have (m, m/s).
pub const STATE_MAX: f32 = 1e7;
/// Factor of the noise while samples are held.
const HELD: f32 = 1e4;

impl Estimator {
    /// Moves on by one step period. A sample that is not finite, out of range or stuck is replaced by the
    /// last good one, with ten thousand times the noise variance.
    #[inline(always)]
    pub fn predict(&self, state: &mut EstimatorState, sample: &InertialSample) {
        state.step = state.step.wrapping_add(1);
        let usable = self.usable(state, sample);
        if usable {
            state.held = *sample;
        }
        let dt = self.config.step_period;
        let rate = state.held.rate_body - state.gyro_bias;
        let force = state.held.specific_force_body - state.accelerometer_bias;
        let turn = step_rotation(dt * rate);
        // Half of the rotation, to second order: the attitude amid the step turns the force.
        let half = Quat::from_xyzw(0.5 * turn.x, 0.5 * turn.y, 0.5 * turn.z, 0.5 + 0.5 * turn.w);
        let middle = renormalised(state.attitude * half).unwrap_or(state.attitude);
        let to_world = Mat3::from_quat(middle);
        let gain_world = dt * (to_world * force);
        let gained = gain_world - Vec3::new(0.0, 0.0, dt * GRAVITY);
        let displacement = dt * (state.velocity_world + 0.5 * gained);
        state.position_world += displacement;
        state.velocity_world += gained;
        state.attitude = renormalised(state.attitude * turn).unwrap_or(Quat::IDENTITY);
        state.rate_body = rate;
        state.history.advance(displacement, gained, turn, self.slot_spacing);
        let jacobian = Jacobian { step_period: dt, gain_world, bias: to_world * -dt };
        state.covariance.propagate(&jacobian);
        // Slow motion, in which distortion adds up: what is faster averages out.
        let [turning, pushed] = &mut state.motion;
        *turning += self.motion_share * (rate - *turning);
        *pushed += self.motion_share * (force - GRAVITY * Vec3::Z - *pushed);
        let moving = [turning.length_squared(), pushed.length_squared()];
        self.add_noise(state, if usable { 1.0 } else { HELD }, moving);
        self.keep_sound(state);
    }

    /// Judges a sample.
    #[inline(always)]
    fn usable(&self, state: &mut EstimatorState, sample: &InertialSample) -> bool {
        let InertialSample { rate_body: w, specific_force_body: a } = sample;
        let numbers = [w.x, w.y, w.z, a.x, a.y, a.z];
        let stuck = state.inertial.is_stuck(&numbers, self.config.faults.repetitions);
        // Comparisons with NaN are false.
        // wcet: at most 3 iterations
        let in_range = numbers[..3].iter().all(|x| x.abs() <= RATE_MAX)
            && numbers[3..].iter().all(|x| x.abs() <= FORCE_MAX);
        if !in_range {
            state.inertial.refuse();
        } else if !stuck {
            state.inertial.accept(state.step);
        }
        in_range && !stuck
    }

    /// In turn, the noise of velocity or attitude, each of two steps, and that of one bias state, of
    /// [`TURNS`] steps. The sensors' noise is the same along all axes, so it is in the world's too. `moving`: squares
    /// of slow rate and of slow specific force beside gravity.
    #[inline(always)]
    fn add_noise(&self, state: &mut EstimatorState, factor: f32, moving: [f32; 2]) {
        let [velocity, attitude, gyro_bias, accelerometer_bias, barometer_bias] = self.noise;
        let turn = usize::from(state.turn);
        let (first, noise) = if turn.is_multiple_of(2) {
            (ATTITUDE, attitude + self.distortion * moving[0])
        } else {
            (VELOCITY, velocity + self.distortion * moving[1])
        };
        state.covariance.add_barometer_noise(barometer_bias);
        // wcet: at most 3 iterations
        for k in 0..3 {
            state.covariance.add_noise(first + k, factor * noise);
        }
        if turn < 3 {
            state.covariance.add_noise(GYRO_BIAS + turn, gyro_bias);
        } else {
            state.covariance.add_noise(ACCELEROMETER_BIAS + turn - 3, accelerometer_bias);
        }
        state.turn = if state.turn + 1 < TURNS { state.turn + 1 } else { 0 };
    }

    /// Starts anew what has grown beyond meaning.
    #[inline(always)]
    fn keep_sound(&self, state: &mut EstimatorState) {
        if !state.covariance.is_sound() {
            self.restart_covariance(state);
        }
        // Comparisons with NaN are false.
        // wcet: at most 3 iterations
        let within = |x: Vec3| x.to_array().iter().all(|x| x.abs() <= STATE_MAX);
        if !(within(state.position_world) && within(state.velocity_world)) {
            restart_motion(state);
        }
    }

    /// The covariance of the start, which announces itself by its deviations.
    #[inline(never)]
    fn restart_covariance(&self, state: &mut EstimatorState) {
        state.covariance.set_diagonal(&self.config.initial_variances());
        state.covariance_restarts = state.covariance_restarts.saturating_add(1);
    }
}

/// Position and velocity zero, and as good as unknown.
#[inline(never)]
fn restart_motion(state: &mut EstimatorState) {
    state.position_world = Vec3::ZERO;
    state.velocity_world = Vec3::ZERO;
    let count = state.restart.count.wrapping_add(1);
    state.restart = Restart { count, position_shift_world: Vec3::ZERO };
    let variance = Vec3::splat(1e8);
    state.covariance.restart(variance, variance);
}

/// Quaternion of the rotation vector `turn`, to fourth order; the first steps of sine and cosine.
#[inline(always)]
fn step_rotation(turn: Vec3) -> Quat {
    let half = 0.5 * turn;
    let square = half.length_squared();
    let eps = half * (1.0 - square * (1.0 / 6.0));
    let q =
        Quat::from_xyzw(eps.x, eps.y, eps.z, 1.0 - 0.5 * square + square * square * (1.0 / 24.0));
    renormalised(q).unwrap_or(Quat::IDENTITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Columns, and elements above the diagonal, that [`Estimator::add_noise`] passes in each turn: `j + 1` and
    /// `j (j + 1)/2` for the state `j`.
    fn passed() -> Vec<[usize; 2]> {
        let states = |turn: usize| {
            let first = if turn.is_multiple_of(2) { ATTITUDE } else { VELOCITY };
            let bias = if turn < 3 { GYRO_BIAS + turn } else { ACCELEROMETER_BIAS + turn - 3 };
            [first, first + 1, first + 2, bias]
        };
        let sum = |of: fn(usize) -> usize, turn| states(turn).into_iter().map(of).sum::<usize>();
        let turns = 0..usize::from(TURNS);
        turns.map(|turn| [sum(|j| j + 1, turn), sum(|j| j * (j + 1) / 2, turn)]).collect()
    }

    /// What `cargo xtask wcet` takes for one prediction (`xtask/src/wcet/traffic.rs`) and for the three that a release
    /// makes at most.
    #[test]
    fn the_noise_passes_triangles() {
        use super::super::covariance::{NOISE_COLUMNS, NOISE_ELEMENTS};
        let (passed, turns) = (passed(), usize::from(TURNS));
        let most = |predictions: usize, of: usize| {
            let from = |turn: usize| (0..predictions).map(move |k| (turn + k) % turns);
            (0..turns).map(|turn| from(turn).map(|turn| passed[turn][of]).sum::<usize>()).max()
        };
        assert_eq!([most(1, 0), most(1, 1)], [Some(42), Some(214)]);
        assert_eq!([most(3, 0), most(3, 1)], [Some(NOISE_COLUMNS), Some(NOISE_ELEMENTS)]);
    }
}
