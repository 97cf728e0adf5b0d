//! Rows of the measurements: derivative of one measured number by the error states.

use glam::{Vec2, Vec3};

use super::{ACCELEROMETER_BIAS, ATTITUDE, BAROMETER_BIAS, GYRO_BIAS, POSITION, STATES, VELOCITY};

/// Derivative of one measured number by the error states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Row {
    /// Height and the barometer's bias, and `rate` of the vertical velocity.
    Barometer {
        /// Derivative by the bias: one, or zero for a barometer without one.
        bias: f32,
        /// Derivative by the vertical velocity (s).
        rate: f32,
    },
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
    /// Height over ground along the body's axis.
    Range {
        /// Derivative by the vertical velocity (s).
        rate: f32,
        /// Derivative by the attitude errors about x and y (m).
        attitude: Vec2,
    },
    /// Velocity along a body axis from the flow of the ground.
    Flow {
        /// Derivative by the height (1/s).
        height: f32,
        /// Derivative by the velocity: the body axis.
        velocity: Vec3,
        /// Derivative by the attitude errors (m/s).
        attitude: Vec3,
        /// Derivative by the gyro's bias about x and y (m).
        bias: Vec2,
    },
}

impl Row {
    /// Product with a vector of states.
    #[inline(always)]
    #[must_use]
    pub fn of(&self, x: &[f32; STATES]) -> f32 {
        match *self {
            Self::Barometer { bias, rate } => barometer(x, bias, rate),
            Self::Position { axis, rate } => position(x, axis, rate),
            Self::Velocity(axis) => x[axis.min(2) + VELOCITY],
            Self::PastVelocity { axis, attitude, bias } => {
                x[axis.min(2) + VELOCITY]
                    + three(x, ATTITUDE, attitude)
                    + three(x, ACCELEROMETER_BIAS, bias)
            }
            Self::Attitude(h) => three(x, ATTITUDE, h),
            Self::Range { rate, attitude } => range(x, rate, attitude),
            Self::Flow { height, velocity, attitude, bias } => {
                height * x[POSITION + 2]
                    + three(x, VELOCITY, velocity)
                    + three(x, ATTITUDE, attitude)
                    + two(x, GYRO_BIAS, bias)
            }
        }
    }

    /// Product with column `j` of `U`, without its zeros below the diagonal.
    #[inline(always)]
    pub(super) fn of_column(&self, j: usize, x: &[f32; STATES]) -> f32 {
        match *self {
            Self::PastVelocity { axis, attitude, bias } => {
                let mut sum = x[axis.min(2) + VELOCITY];
                if j >= ATTITUDE {
                    sum += three(x, ATTITUDE, attitude);
                }
                if j >= ACCELEROMETER_BIAS {
                    sum += three(x, ACCELEROMETER_BIAS, bias);
                }
                sum
            }
            Self::Attitude(h) => {
                if j >= ATTITUDE {
                    three(x, ATTITUDE, h)
                } else {
                    0.0
                }
            }
            Self::Flow { height, velocity, attitude, bias } => {
                let mut sum = height * x[POSITION + 2];
                if j >= VELOCITY {
                    sum += three(x, VELOCITY, velocity);
                }
                if j >= ATTITUDE {
                    sum += three(x, ATTITUDE, attitude);
                }
                if j >= GYRO_BIAS {
                    sum += two(x, GYRO_BIAS, bias);
                }
                sum
            }
            _ => self.of(x),
        }
    }
}

#[inline(always)]
fn barometer(x: &[f32; STATES], bias: f32, rate: f32) -> f32 {
    bias * x[BAROMETER_BIAS] + (x[POSITION + 2] + rate * x[VELOCITY + 2])
}

#[inline(always)]
fn position(x: &[f32; STATES], axis: usize, rate: f32) -> f32 {
    let axis = axis.min(2);
    x[axis + POSITION] + rate * x[axis + VELOCITY]
}

#[inline(always)]
fn range(x: &[f32; STATES], rate: f32, attitude: Vec2) -> f32 {
    (x[POSITION + 2] + rate * x[VELOCITY + 2]) + two(x, ATTITUDE, attitude)
}

/// Product with the three states from `first` on.
#[inline(always)]
fn three(x: &[f32; STATES], first: usize, h: Vec3) -> f32 {
    h.x * x[first] + h.y * x[first + 1] + h.z * x[first + 2]
}

/// Product with the two states from `first` on.
#[inline(always)]
fn two(x: &[f32; STATES], first: usize, h: Vec2) -> f32 {
    h.x * x[first] + h.y * x[first + 1]
}
