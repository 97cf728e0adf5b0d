//! Covariance of the error state as `P = U D U^T`: `U` unit upper triangular, `D` diagonal and positive.
//!
//! Whatever is stored, `P` is symmetric, and positive as long as every `D` is: no rounding can make it
//! otherwise. Three operations change it.
//!
//! - [`propagate`](Covariance::propagate): `F` is unit upper triangular in the order of the states, so
//!   `F U` is the new `U` and `D` stays.
//! - [`add_noise`](Covariance::add_noise): rank one, `P + q e_j e_j^T`, by Agee and Turner.
//! - [`correct`](Covariance::correct): one scalar measurement, by Bierman.
//!
//! Loops run over arrays of fixed size; none depends on a value.

mod correction;
mod row;

pub use correction::Projection;
pub use row::Row;

use glam::{Mat3, Vec3};

/// Error states: barometer bias, position, velocity, attitude (world axes), gyro bias, accelerometer bias.
pub const STATES: usize = 16;
/// Index of the barometer's bias.
///
/// The first state: nothing is added to it in `F`, so its row of `U` and its `D` are all that a prediction
/// would have to touch.
pub const BAROMETER_BIAS: usize = 0;
/// First index of the position.
pub const POSITION: usize = 1;
/// First index of the velocity.
pub const VELOCITY: usize = 4;
/// First index of the attitude error.
pub const ATTITUDE: usize = 7;
/// First index of the gyro bias.
pub const GYRO_BIAS: usize = 10;
/// First index of the accelerometer bias.
pub const ACCELEROMETER_BIAS: usize = 13;

/// Smallest `D`, far below any variance in use and far above the smallest normal number.
const FLOOR: f32 = 1e-24;
/// Columns that three predictions pass at most when they add noise; a loop's bound, which a test derives.
#[cfg(test)]
pub const NOISE_COLUMNS: usize = 114;
/// Elements above the diagonals of these columns.
#[cfg(test)]
pub const NOISE_ELEMENTS: usize = 544;
/// Variance beyond which the covariance has lost its meaning.
const CEILING: f32 = 1e12;

/// Jacobian of one prediction, less the identity.
#[derive(Clone, Copy, Debug)]
pub struct Jacobian {
    /// Step period (s).
    pub step_period: f32,
    /// `dt R a`: velocity gained from the specific force, world axes (m/s).
    pub gain_world: Vec3,
    /// `-dt R`: effect of both biases.
    pub bias: Mat3,
}

/// `P` in factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covariance {
    /// Columns of `U`, ones on the diagonal and zeros below included.
    u: [[f32; STATES]; STATES],
    d: [f32; STATES],
}

impl Covariance {
    /// All zero: no covariance before it is set.
    pub(super) const BLANK: Self = Self { u: [[0.0; STATES]; STATES], d: [0.0; STATES] };

    /// Diagonal, with these variances; what is no positive number becomes the smallest one.
    #[must_use]
    pub fn diagonal(variances: &[f32; STATES]) -> Self {
        let mut new = Self::BLANK;
        new.set_diagonal(variances);
        new
    }

    /// Becomes [`diagonal`](Self::diagonal), in place.
    #[inline(never)]
    pub fn set_diagonal(&mut self, variances: &[f32; STATES]) {
        self.u = Self::BLANK.u;
        for (j, column) in self.u.iter_mut().enumerate() {
            column[j] = 1.0;
        }
        for (d, variance) in self.d.iter_mut().zip(variances) {
            *d = floored(*variance);
        }
    }

    /// `P = F P F^T`.
    #[inline(always)]
    pub fn propagate(&mut self, jacobian: &Jacobian) {
        self.propagate_block::<VELOCITY>(jacobian);
        self.propagate_block::<ATTITUDE>(jacobian);
        self.propagate_block::<GYRO_BIAS>(jacobian);
        self.propagate_block::<ACCELEROMETER_BIAS>(jacobian);
    }

    /// The three columns from `FIRST` on.
    #[inline(always)]
    fn propagate_block<const FIRST: usize>(&mut self, jacobian: &Jacobian) {
        let Jacobian { step_period, gain_world, bias } = jacobian;
        let half = 0.5 * step_period;
        // wcet: at most 3 iterations
        for column in self.u.iter_mut().skip(FIRST).take(3) {
            let [_, p0, p1, p2, v0, v1, v2, t0, t1, t2, g0, g1, g2, a0, a1, a2] = column;
            let old = Vec3::new(*v0, *v1, *v2);
            let mut velocity = old;
            if FIRST >= ATTITUDE {
                let attitude = Vec3::new(*t0, *t1, *t2);
                velocity += attitude.cross(*gain_world);
                if FIRST >= GYRO_BIAS {
                    let new = attitude + *bias * Vec3::new(*g0, *g1, *g2);
                    (*t0, *t1, *t2) = (new.x, new.y, new.z);
                }
                if FIRST >= ACCELEROMETER_BIAS {
                    velocity += *bias * Vec3::new(*a0, *a1, *a2);
                }
                (*v0, *v1, *v2) = (velocity.x, velocity.y, velocity.z);
            }
            let step = half * (old + velocity);
            *p0 += step.x;
            *p1 += step.y;
            *p2 += step.z;
        }
    }

    /// `P + q e_j e_j^T` for a `q` that is not negative; nothing for an index that no state has.
    #[inline(never)]
    pub fn add_noise(&mut self, j: usize, q: f32) {
        let mut a = [0.0; STATES];
        let mut c = q;
        if let Some(a) = a.get_mut(j) {
            *a = 1.0;
        }
        let columns = self.u.iter_mut().zip(self.d.iter_mut()).enumerate().rev();
        // wcet: at most NOISE_COLUMNS iterations in all
        for (k, (column, d)) in columns.skip(STATES - 1 - j.min(STATES - 1)) {
            let Some(&s) = a.get(k) else { break };
            let new = floored(*d + c * s * s);
            let b = c / new;
            c = b * *d;
            *d = new;
            let gain = b * s;
            // wcet: at most NOISE_ELEMENTS iterations in all
            for (a, u) in a.iter_mut().zip(column).take(k) {
                *a -= s * *u;
                *u += gain * *a;
            }
        }
    }

    /// [`add_noise`](Self::add_noise) of the barometer's bias, to which no earlier state belongs.
    #[inline(always)]
    pub fn add_barometer_noise(&mut self, q: f32) {
        let [d, ..] = &mut self.d;
        *d = floored(*d + q);
    }

    /// `P_ij`; zero for indices that no state has.
    #[must_use]
    pub fn element(&self, i: usize, j: usize) -> f32 {
        let mut sum = 0.0;
        // wcet: at most 16 iterations
        for (column, d) in self.u.iter().zip(&self.d) {
            if let (Some(a), Some(b)) = (column.get(i), column.get(j)) {
                sum += a * b * d;
            }
        }
        sum
    }

    /// Variances of the three states from `first` on.
    #[must_use]
    pub fn variances(&self, first: usize) -> Vec3 {
        let at = |k| self.element(first + k, first + k);
        Vec3::new(at(0), at(1), at(2))
    }

    /// Forgets position and velocity: both uncorrelated, with new variances. The other states keep theirs.
    pub fn restart(&mut self, position: Vec3, velocity: Vec3) {
        let mut bias = 0.0;
        // wcet: at most 16 iterations
        for (j, (column, d)) in self.u.iter_mut().zip(&self.d).enumerate() {
            let [first, rest @ ..] = column;
            if (POSITION..ATTITUDE).contains(&j) {
                // What these columns held of the barometer's variance goes to its own `D`.
                bias += *first * *first * d;
                *first = 0.0;
            }
            // wcet: at most 6 iterations
            for (i, u) in rest[..ATTITUDE - POSITION].iter_mut().enumerate() {
                *u = if i + POSITION == j { 1.0 } else { 0.0 };
            }
        }
        let [b, p0, p1, p2, v0, v1, v2, ..] = &mut self.d;
        *b = floored(*b + bias);
        (*p0, *p1, *p2) = (floored(position.x), floored(position.y), floored(position.z));
        (*v0, *v1, *v2) = (floored(velocity.x), floored(velocity.y), floored(velocity.z));
    }

    /// `true` if every `D` is a positive number within what variances can mean.
    #[inline(always)]
    #[must_use]
    pub fn is_sound(&self) -> bool {
        // wcet: at most 16 iterations
        self.d.iter().all(|d| (FLOOR..=CEILING).contains(d))
    }
}

/// `x`, at least [`FLOOR`]; the floor for NaN.
#[inline(always)]
fn floored(x: f32) -> f32 {
    if x > FLOOR { x } else { FLOOR }
}
