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

use glam::{Mat3, Vec3};

/// Error states: position, velocity, attitude (world axes), gyro bias, accelerometer bias.
pub const STATES: usize = 15;
/// First index of the position.
pub const POSITION: usize = 0;
/// First index of the velocity.
pub const VELOCITY: usize = 3;
/// First index of the attitude error.
pub const ATTITUDE: usize = 6;
/// First index of the gyro bias.
pub const GYRO_BIAS: usize = 9;
/// First index of the accelerometer bias.
pub const ACCELEROMETER_BIAS: usize = 12;

/// Smallest `D`, far below any variance in use and far above the smallest normal number.
const FLOOR: f32 = 1e-24;
/// Variance beyond which the covariance has lost its meaning.
const CEILING: f32 = 1e12;

/// Derivative of one measured number by the error states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Row {
    /// Component `axis` (0 to 2) of the position, and `rate` of the same component of the velocity.
    Position {
        /// Component.
        axis: usize,
        /// Derivative by the velocity (s).
        rate: f32,
    },
    /// Component (0 to 2) of the velocity.
    Velocity(usize),
    /// Component `axis` (0 to 2) of a past velocity.
    PastVelocity {
        /// Component.
        axis: usize,
        /// Derivative by the attitude errors (m/s).
        attitude: Vec3,
        /// Derivative by the accelerometer bias (s).
        bias: Vec3,
    },
    /// Combination of the attitude errors.
    Attitude(Vec3),
}

impl Row {
    /// Product with a vector of states.
    #[inline(always)]
    #[must_use]
    pub fn of(&self, x: &[f32; STATES]) -> f32 {
        match *self {
            Self::Position { axis, rate } => x[axis.min(2)] + rate * x[axis.min(2) + VELOCITY],
            Self::Velocity(axis) => x[axis.min(2) + VELOCITY],
            Self::PastVelocity { axis, attitude, bias } => {
                let [_, _, _, _, _, _, t0, t1, t2, _, _, _, a0, a1, a2] = *x;
                x[axis.min(2) + VELOCITY]
                    + (attitude.x * t0 + attitude.y * t1 + attitude.z * t2)
                    + (bias.x * a0 + bias.y * a1 + bias.z * a2)
            }
            Self::Attitude(h) => h.x * x[ATTITUDE] + h.y * x[ATTITUDE + 1] + h.z * x[ATTITUDE + 2],
        }
    }
}

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

/// The innovation's variance and what the update needs beside it.
#[derive(Clone, Copy, Debug)]
pub struct Projection {
    /// `U^T h`.
    f: [f32; STATES],
    /// `h P h^T + r`.
    pub variance: f32,
    /// `r`: variance of the measurement.
    noise: f32,
}

/// `P` in factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covariance {
    /// Columns of `U`, ones on the diagonal and zeros below included.
    u: [[f32; STATES]; STATES],
    d: [f32; STATES],
}

impl Covariance {
    /// Diagonal, with these variances; what is no positive number becomes the smallest one.
    #[must_use]
    pub fn diagonal(variances: &[f32; STATES]) -> Self {
        let mut new = Self { u: [[0.0; STATES]; STATES], d: [FLOOR; STATES] };
        for (j, column) in new.u.iter_mut().enumerate() {
            column[j] = 1.0;
        }
        for (d, variance) in new.d.iter_mut().zip(variances) {
            *d = floored(*variance);
        }
        new
    }

    /// `P = F P F^T`.
    #[inline(always)]
    pub fn propagate(&mut self, jacobian: &Jacobian) {
        let Jacobian { step_period, gain_world, bias } = jacobian;
        let half = 0.5 * step_period;
        for (j, column) in self.u.iter_mut().enumerate().skip(VELOCITY) {
            let [p0, p1, p2, v0, v1, v2, t0, t1, t2, g0, g1, g2, a0, a1, a2] = column;
            let old = Vec3::new(*v0, *v1, *v2);
            let mut velocity = old;
            if j >= ATTITUDE {
                let attitude = Vec3::new(*t0, *t1, *t2);
                velocity += attitude.cross(*gain_world);
                if j >= GYRO_BIAS {
                    let new = attitude + *bias * Vec3::new(*g0, *g1, *g2);
                    (*t0, *t1, *t2) = (new.x, new.y, new.z);
                }
                if j >= ACCELEROMETER_BIAS {
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
        for (k, (column, d)) in columns.skip(STATES - 1 - j.min(STATES - 1)) {
            let Some(&s) = a.get(k) else { break };
            let new = floored(*d + c * s * s);
            let b = c / new;
            c = b * *d;
            *d = new;
            let gain = b * s;
            for (a, u) in a.iter_mut().zip(column).take(k) {
                *a -= s * *u;
                *u += gain * *a;
            }
        }
    }

    /// Innovation of a measurement `row` with variance `noise`.
    #[inline(never)]
    #[must_use]
    pub fn project(&self, row: &Row, noise: f32) -> Projection {
        let noise = floored(noise);
        match *row {
            Row::Position { axis, rate } => {
                let (p, v) = (axis.min(2), axis.min(2) + VELOCITY);
                self.projection(noise, |_, column| column[p] + rate * column[v])
            }
            Row::Velocity(axis) => {
                let v = axis.min(2) + VELOCITY;
                self.projection(noise, |_, column| column[v])
            }
            Row::PastVelocity { axis, attitude: h, bias: b } => {
                let v = axis.min(2) + VELOCITY;
                // Zeros below the diagonal are left out.
                self.projection(noise, |j, column| {
                    let [_, _, _, _, _, _, x, y, z, _, _, _, b0, b1, b2] = *column;
                    let mut sum = column[v];
                    if j >= ATTITUDE {
                        sum += h.x * x + h.y * y + h.z * z;
                    }
                    if j >= ACCELEROMETER_BIAS {
                        sum += b.x * b0 + b.y * b1 + b.z * b2;
                    }
                    sum
                })
            }
            Row::Attitude(h) => self.projection(noise, |_, column| {
                let [_, _, _, _, _, _, x, y, z, ..] = *column;
                h.x * x + h.y * y + h.z * z
            }),
        }
    }

    #[inline(always)]
    fn projection(&self, noise: f32, row: impl Fn(usize, &[f32; STATES]) -> f32) -> Projection {
        let mut projection = Projection { f: [0.0; STATES], variance: noise, noise };
        for (j, ((f, column), d)) in projection.f.iter_mut().zip(&self.u).zip(&self.d).enumerate() {
            *f = row(j, column);
            projection.variance += *f * *f * d;
        }
        projection
    }

    /// Takes the measurement in; returns the gain `K`.
    #[inline(never)]
    pub fn correct(&mut self, projection: &Projection) -> [f32; STATES] {
        let mut gain = [0.0; STATES];
        let (mut alpha, mut inverse) = (projection.noise, 1.0 / projection.noise);
        let columns = self.u.iter_mut().zip(self.d.iter_mut()).zip(&projection.f);
        for (j, ((column, d), f)) in columns.enumerate() {
            let g = *d * f;
            let lambda = -f * inverse;
            for (k, u) in gain[..j].iter_mut().zip(&mut column[..j]) {
                let old = *u;
                *u += lambda * *k;
                *k += g * old;
            }
            gain[j] = g;
            let next = alpha + f * g;
            inverse = 1.0 / next;
            *d = floored(*d * alpha * inverse);
            alpha = next;
        }
        gain.map(|k| k * inverse)
    }

    /// `P_ij`; zero for indices that no state has.
    #[must_use]
    pub fn element(&self, i: usize, j: usize) -> f32 {
        let mut sum = 0.0;
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

    /// Forgets position and velocity: both uncorrelated, with new variances.
    pub fn restart(&mut self, position: Vec3, velocity: Vec3) {
        for (j, column) in self.u.iter_mut().enumerate() {
            for (i, u) in column[..ATTITUDE].iter_mut().enumerate() {
                *u = if i == j { 1.0 } else { 0.0 };
            }
        }
        let [d0, d1, d2, d3, d4, d5, ..] = &mut self.d;
        (*d0, *d1, *d2) = (floored(position.x), floored(position.y), floored(position.z));
        (*d3, *d4, *d5) = (floored(velocity.x), floored(velocity.y), floored(velocity.z));
    }

    /// `true` if every `D` is a positive number within what variances can mean.
    #[inline(always)]
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.d.iter().all(|d| (FLOOR..=CEILING).contains(d))
    }
}

/// `x`, at least [`FLOOR`]; the floor for NaN.
#[inline(always)]
fn floored(x: f32) -> f32 {
    if x > FLOOR { x } else { FLOOR }
}
