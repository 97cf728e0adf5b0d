//! The estimator in `f64` with full matrices, written from `docs/estimator.md` without a look at the core's
//! factors: `P = F P F^T + Q`, corrections in Joseph's form, the whole past instead of slots.

use ctrl_core::estimator::{EstimatorConfig, InertialSample, Measurement};
use ctrl_core::vehicle::{GRAVITY, VehicleState};
use glam::{DMat3, DQuat, DVec3};

/// Error states.
pub const STATES: usize = 16;
/// A full matrix, row by row.
pub type Matrix = [[f64; STATES]; STATES];

/// The filter and its state.
#[derive(Clone, Debug)]
pub struct Transcription {
    config: EstimatorConfig,
    /// Position (m).
    pub position: DVec3,
    /// Velocity (m/s).
    pub velocity: DVec3,
    /// Attitude, body to world.
    pub attitude: DQuat,
    /// Bias of the gyro (rad/s).
    pub gyro_bias: DVec3,
    /// Bias of the accelerometer (m/s^2).
    pub accelerometer_bias: DVec3,
    /// Bias of the barometer (m).
    pub barometer_bias: f64,
    /// Covariance.
    pub covariance: Matrix,
    force_body: DVec3,
    turning: DVec3,
    pushed: DVec3,
    /// Displacement, gained velocity and rotation of every step, the newest last.
    past: Vec<(DVec3, DVec3, DQuat)>,
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let mut sum = [[0.0; STATES]; STATES];
    for i in 0..STATES {
        for k in 0..STATES {
            for j in 0..STATES {
                sum[i][j] += a[i][k] * b[k][j];
            }
        }
    }
    sum
}

fn transposed(a: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

fn identity() -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))))
}

fn put(matrix: &mut Matrix, row: usize, column: usize, block: DMat3) {
    for i in 0..3 {
        for j in 0..3 {
            matrix[row + i][column + j] = block.col(j)[i];
        }
    }
}

/// `[x]×`.
fn cross_matrix(x: DVec3) -> DMat3 {
    DMat3::from_cols(x.cross(DVec3::X), x.cross(DVec3::Y), x.cross(DVec3::Z))
}

impl Transcription {
    /// The filter at its start.
    #[must_use]
    pub fn new(config: &EstimatorConfig, vehicle: &VehicleState) -> Self {
        let s = &config.initial;
        let deviations = [
            [s.position; 3],
            [s.velocity; 3],
            [s.tilt, s.tilt, s.heading],
            [s.gyro_bias; 3],
            [s.accelerometer_bias; 3],
        ];
        let mut covariance = [[0.0; STATES]; STATES];
        covariance[0][0] = f64::from(config.barometer_bias.deviation).powi(2);
        for (k, deviation) in deviations.as_flattened().iter().enumerate() {
            covariance[1 + k][1 + k] = f64::from(*deviation).powi(2);
        }
        Self {
            config: *config,
            position: vehicle.position_world.as_dvec3(),
            velocity: vehicle.velocity_world.as_dvec3(),
            attitude: vehicle.attitude.as_dquat().normalize(),
            gyro_bias: DVec3::ZERO,
            accelerometer_bias: DVec3::ZERO,
            barometer_bias: 0.0,
            covariance,
            force_body: DVec3::ZERO,
            turning: DVec3::ZERO,
            pushed: DVec3::ZERO,
            past: Vec::new(),
        }
    }

    /// One step.
    pub fn predict(&mut self, sample: &InertialSample) {
        let dt = f64::from(self.config.step_period);
        let rate = sample.rate_body.as_dvec3() - self.gyro_bias;
        let force = sample.specific_force_body.as_dvec3() - self.accelerometer_bias;
        let middle = self.attitude * DQuat::from_scaled_axis(0.5 * dt * rate);
        let force_world = middle * force;
        self.force_body = sample.specific_force_body.as_dvec3();
        let gained = dt * (force_world - DVec3::Z * f64::from(GRAVITY));
        let displacement = dt * (self.velocity + 0.5 * gained);
        let turn = DQuat::from_scaled_axis(dt * rate);
        self.position += displacement;
        self.velocity += gained;
        self.attitude = (self.attitude * turn).normalize();
        self.past.push((displacement, gained, turn));
        let mut f = identity();
        let (force_cross, to_world) = (cross_matrix(force_world), DMat3::from_quat(middle));
        put(&mut f, 1, 4, DMat3::IDENTITY * dt);
        put(&mut f, 1, 7, -force_cross * (0.5 * dt * dt));
        put(&mut f, 1, 13, -to_world * (0.5 * dt * dt));
        put(&mut f, 4, 7, -force_cross * dt);
        put(&mut f, 4, 13, -to_world * dt);
        put(&mut f, 7, 10, -to_world * dt);
        self.covariance = product(&product(&f, &self.covariance), &transposed(&f));
        let noise = &self.config.inertial;
        let densities =
            [0.0, noise.accelerometer, noise.gyro, noise.gyro_bias, noise.accelerometer_bias];
        // The spectral density at zero of an error `s x` that is correlated over `T` to either side: 2 T s^2 x^2,
        // with `x` without what is faster than `T`.
        let time = f64::from(noise.motion_time);
        let per_square = 2.0 * time * f64::from(noise.distortion).powi(2);
        let beside = force - DVec3::Z * f64::from(GRAVITY);
        self.turning += dt / (dt + time) * (rate - self.turning);
        self.pushed += dt / (dt + time) * (beside - self.pushed);
        let moving = [0.0, self.pushed.length_squared(), self.turning.length_squared(), 0.0, 0.0];
        for k in 0..15 {
            let density = f64::from(densities[k / 3]).powi(2) + per_square * moving[k / 3];
            self.covariance[1 + k][1 + k] += dt * density;
        }
        self.covariance[0][0] += dt * f64::from(self.config.barometer_bias.walk).powi(2);
    }

    /// Displacement, gained velocity and the rotation back over the last `delay` (s).
    #[must_use]
    pub fn motion(&self, delay: f32) -> (DVec3, DVec3, DQuat) {
        let steps = (f64::from(delay) / f64::from(self.config.step_period)).round() as usize;
        let mut sum = (DVec3::ZERO, DVec3::ZERO, DQuat::IDENTITY);
        for (displacement, gained, turn) in self.past.iter().rev().take(steps) {
            sum = (sum.0 + *displacement, sum.1 + *gained, *turn * sum.2);
        }
        (sum.0, sum.1, sum.2.inverse())
    }

    /// One measurement; no gate.
    pub fn correct(&mut self, measurement: &Measurement) {
        let source = *self.config.source(measurement.source());
        let (displacement, gained, back) = self.motion(source.delay);
        let d = f64::from(source.delay);
        let to_world = DMat3::from_quat(self.attitude);
        let force_cross = cross_matrix(to_world * (self.force_body - self.accelerometer_bias));
        let (variance, vertical) =
            (f64::from(source.deviation).powi(2), f64::from(source.deviation_vertical).powi(2));
        let noise = [variance, variance, vertical];
        let axis = |first: usize, k: usize, velocity: f64| {
            let mut row = [0.0; STATES];
            row[first + k] = 1.0;
            if velocity != 0.0 {
                row[4 + k] = velocity;
            }
            row
        };
        let mut rows = Vec::new();
        match *measurement {
            Measurement::Barometer(height) => {
                let mut row = axis(1, 2, -d);
                row[0] = f64::from(u8::from(self.config.barometer_bias.deviation > 0.0));
                let past = self.position.z - displacement.z + self.barometer_bias;
                rows.push((f64::from(height) - past, row, variance));
            }
            Measurement::GnssPosition(x) | Measurement::CapturePosition(x) => {
                let innovation = x.as_dvec3() - (self.position - displacement);
                for (k, noise) in noise.into_iter().enumerate() {
                    rows.push((innovation[k], axis(1, k, -d), noise));
                }
            }
            Measurement::GnssVelocity(x) => {
                let innovation = x.as_dvec3() - (self.velocity - gained);
                for (k, noise) in noise.into_iter().enumerate() {
                    let mut row = axis(4, k, 0.0);
                    for j in 0..3 {
                        row[7 + j] = d * force_cross.col(j)[k];
                        row[13 + j] = d * to_world.col(j)[k];
                    }
                    rows.push((innovation[k], row, noise));
                }
            }
            Measurement::CaptureAttitude(q) => {
                let error = q.as_dquat().normalize() * (self.attitude * back).inverse();
                let error = if error.w < 0.0 { -error } else { error };
                for (k, noise) in noise.into_iter().enumerate() {
                    rows.push((2.0 * error.xyz()[k], axis(7, k, 0.0), noise));
                }
            }
            Measurement::Magnetometer(field) => {
                let field = (self.attitude * back) * field.as_dvec3();
                let known = self.config.magnetic_field_world.as_dvec3();
                let north = known.truncate().normalize();
                let seen = field.truncate();
                let mut row = [0.0; STATES];
                let dip = known.z / known.truncate().length();
                (row[7], row[8], row[9]) = (-dip * north.x, -dip * north.y, 1.0);
                let sine = seen.perp_dot(north) / seen.length();
                rows.push((sine, row, variance));
            }
            Measurement::Rangefinder(distance) => {
                let axes = DMat3::from_quat(self.attitude * back);
                let c = axes.z_axis.z;
                let height = self.position.z - displacement.z;
                let exact = |h: f64, turn: DVec3| {
                    h / (DMat3::from_quat(DQuat::from_scaled_axis(turn)) * axes).z_axis.z
                };
                let step = 1e-6;
                let slope = |h: f64, turn: DVec3| {
                    let to = |sign: f64| exact(height + sign * h, sign * turn);
                    (to(1.0) - to(-1.0)) / (2.0 * step) * c
                };
                let mut row = [0.0; STATES];
                row[3] = slope(step, DVec3::ZERO);
                row[6] = -d * row[3];
                (row[7], row[8]) = (slope(0.0, step * DVec3::X), slope(0.0, step * DVec3::Y));
                let innovation = f64::from(distance) - exact(height, DVec3::ZERO);
                rows.push((c * innovation, row, variance * c * c));
            }
            Measurement::OpticalFlow(flow) => {
                let axes = DMat3::from_quat(self.attitude * back);
                let velocity = self.velocity - gained;
                let height = self.position.z - displacement.z;
                let distance = height / axes.z_axis.z;
                let flow = [flow.x, flow.y].map(f64::from);
                let variance = variance * distance * distance;
                for (k, flow) in flow.into_iter().enumerate() {
                    let bias = [self.gyro_bias.y, -self.gyro_bias.x][k];
                    let exact = |h: f64, turn: DVec3, v: DVec3| {
                        let axes = DMat3::from_quat(DQuat::from_scaled_axis(turn)) * axes;
                        axes.col(k).dot(v) * axes.z_axis.z / h + bias
                    };
                    // Derivatives of the exact flow by differences.
                    let step = 1e-6;
                    let slope = |h: f64, turn: DVec3, v: DVec3| {
                        let to =
                            |sign: f64| exact(height + sign * h, sign * turn, velocity + sign * v);
                        (to(1.0) - to(-1.0)) / (2.0 * step) * distance
                    };
                    let mut row = [0.0; STATES];
                    row[3] = slope(step, DVec3::ZERO, DVec3::ZERO);
                    for (j, axis) in DVec3::AXES.into_iter().enumerate() {
                        row[4 + j] = slope(0.0, DVec3::ZERO, step * axis);
                        row[7 + j] = slope(0.0, step * axis, DVec3::ZERO);
                    }
                    (row[10], row[11]) = [(0.0, distance), (-distance, 0.0)][k];
                    let innovation = flow - exact(height, DVec3::ZERO, velocity);
                    rows.push((distance * innovation, row, variance));
                }
            }
        }
        self.apply(&rows);
    }

    fn apply(&mut self, rows: &[(f64, [f64; STATES], f64)]) {
        let mut correction = [0.0; STATES];
        for (innovation, row, noise) in rows {
            let p = &self.covariance;
            let ph: [f64; STATES] =
                std::array::from_fn(|i| (0..STATES).map(|j| p[i][j] * row[j]).sum());
            let variance = noise + (0..STATES).map(|i| row[i] * ph[i]).sum::<f64>();
            let rest = innovation - (0..STATES).map(|i| row[i] * correction[i]).sum::<f64>();
            let gain = ph.map(|x| x / variance);
            let mut shrink = identity();
            for i in 0..STATES {
                for j in 0..STATES {
                    shrink[i][j] -= gain[i] * row[j];
                }
            }
            let mut new = product(&product(&shrink, p), &transposed(&shrink));
            for i in 0..STATES {
                for j in 0..STATES {
                    new[i][j] += gain[i] * noise * gain[j];
                }
            }
            self.covariance = new;
            for i in 0..STATES {
                correction[i] += gain[i] * rest;
            }
        }
        let part = |first: usize| {
            DVec3::new(correction[first], correction[first + 1], correction[first + 2])
        };
        self.barometer_bias += correction[0];
        self.position += part(1);
        self.velocity += part(4);
        self.attitude = (DQuat::from_scaled_axis(part(7)) * self.attitude).normalize();
        self.gyro_bias += part(10);
        self.accelerometer_bias += part(13);
    }
}
