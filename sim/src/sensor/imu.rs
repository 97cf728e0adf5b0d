//! Inertial sensors: means over the sample period, distorted, with bias and noise, saturated and rounded.

use crate::norm::Norm;
use core::f64::consts::PI;

use ctrl_core::estimator::InertialSample;
use ctrl_core::vehicle::GRAVITY;
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::bias::Bias;
use super::converter::Converter;
use super::distortion::Distortion;
use super::filter::LowPass;
use super::noise::WhiteNoise;
use super::random::Normal;
use super::vibration::Vibration;
use crate::plant::PlantState;

/// Standard gravity, the unit of data sheets (m/s^2).
const G: f64 = 9.806_65;
/// One degree (rad).
const DEGREE: f64 = PI / 180.0;

/// Parameters of an inertial measurement unit, in the units of data sheets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImuParameters {
    /// Rate of the samples (Hz): a multiple of the control rate, or an integer part of it. The estimator gets the mean
    /// over a control tick of samples that are faster.
    pub rate: f64,
    /// Cut-off of the anti-alias filter before the converter, Butterworth of second order (Hz); zero: none.
    #[serde(default)]
    pub filter_cutoff: f64,
    /// Noise density of the gyro (deg/s/√Hz).
    pub gyro_noise_density: f64,
    /// Random walk of the gyro's bias (deg/s/√s).
    pub gyro_bias_walk: f64,
    /// Standard deviation of the gyro's bias at the start, after calibration (deg/s).
    pub gyro_offset: f64,
    /// Full scale of the gyro (deg/s).
    pub gyro_range: f64,
    /// Sensitivity of the gyro (LSB/(deg/s)).
    pub gyro_sensitivity: f64,
    /// Noise density of the accelerometer (µg/√Hz).
    pub accelerometer_noise_density: f64,
    /// Random walk of the accelerometer's bias (µg/√s).
    pub accelerometer_bias_walk: f64,
    /// Standard deviation of the accelerometer's bias at the start, after calibration (mg).
    pub accelerometer_offset: f64,
    /// Full scale of the accelerometer (g).
    pub accelerometer_range: f64,
    /// Sensitivity of the accelerometer (LSB/g).
    pub accelerometer_sensitivity: f64,
    /// Standard deviation of each axis' scale error after calibration (%).
    pub scale_error: f64,
    /// Standard deviation of each coupling between two axes after calibration (%).
    pub misalignment: f64,
}

impl ImuParameters {
    /// Bosch BMI088. Data sheet: noise densities 0.014 deg/s/√Hz and 175 µg/√Hz (x, y), ranges 2000 deg/s and
    /// 24 g with 16.384 LSB/(deg/s) and 1365 LSB/g. Bias walks, and what calibration leaves of offset, scale
    /// and alignment, are in no data sheet: assumed, of the order that Allan variances of such parts show.
    pub const BMI088: Self = Self {
        rate: 1000.0,
        filter_cutoff: 0.0,
        gyro_noise_density: 0.014,
        gyro_bias_walk: 5e-4,
        gyro_offset: 0.1,
        gyro_range: 2000.0,
        gyro_sensitivity: 16.384,
        accelerometer_noise_density: 175.0,
        accelerometer_bias_walk: 20.0,
        accelerometer_offset: 3.0,
        accelerometer_range: 24.0,
        accelerometer_sensitivity: 1365.0,
        scale_error: 0.05,
        misalignment: 0.05,
    };

    /// TDK ICM-42688-P. Data sheet: noise densities 2.8 mdeg/s/√Hz and 70 µg/√Hz, ranges 2000 deg/s and 16 g
    /// with 16.4 LSB/(deg/s) and 2048 LSB/g. The rest is assumed, as for the BMI088.
    pub const ICM_42688_P: Self = Self {
        gyro_noise_density: 0.0028,
        gyro_bias_walk: 3e-4,
        gyro_sensitivity: 16.4,
        accelerometer_noise_density: 70.0,
        accelerometer_bias_walk: 10.0,
        accelerometer_range: 16.0,
        accelerometer_sensitivity: 2048.0,
        ..Self::BMI088
    };

    /// Standard deviation of a gyro sample from its converter's steps (rad/s).
    fn gyro_step(&self) -> f64 {
        DEGREE / self.gyro_sensitivity
    }

    /// One step of the accelerometer's converter (m/s^2).
    fn accelerometer_step(&self) -> f64 {
        G / self.accelerometer_sensitivity
    }

    /// Noise densities that an estimator should assume: the parts' and the rounding's, for samples each
    /// [`sample_period`](Self::sample_period) (s); gyro (rad/s/√Hz), accelerometer (m/s^2/√Hz).
    #[must_use]
    pub fn densities(&self, period: f64) -> (f64, f64) {
        let with_rounding =
            |density: f64, step: f64| (density * density + step * step / 12.0 * period).sqrt();
        (
            with_rounding(self.gyro_noise_density * DEGREE, self.gyro_step()),
            with_rounding(self.accelerometer_noise_density * 1e-6 * G, self.accelerometer_step()),
        )
    }

    /// Walks of the biases: gyro (rad/s/√s), accelerometer (m/s^2/√s).
    #[must_use]
    pub fn walks(&self) -> (f64, f64) {
        (self.gyro_bias_walk * DEGREE, self.accelerometer_bias_walk * 1e-6 * G)
    }

    /// Standard deviations of the biases at the start: gyro (rad/s), accelerometer (m/s^2).
    #[must_use]
    pub fn offsets(&self) -> (f64, f64) {
        (self.gyro_offset * DEGREE, self.accelerometer_offset * 1e-3 * G)
    }

    /// Standard deviation of what the accelerometer shows too much at hover, its bias and a part of gravity by
    /// scale or misalignment (m/s^2).
    #[must_use]
    pub fn hover_deviation(&self) -> f64 {
        let (_, offset) = self.offsets();
        let distortion = self.distortion() * f64::from(GRAVITY);
        (offset * offset + distortion * distortion).sqrt()
    }

    /// Standard deviation of scale errors and couplings (1).
    #[must_use]
    pub fn distortion(&self) -> f64 {
        self.scale_error.max(self.misalignment) / 100.0
    }

    /// Samples per tick of `tick` (s) of a unit that is faster than the control loop; else one.
    #[must_use]
    pub fn samples_per_tick(&self, tick: f64) -> u32 {
        (self.rate * tick).round().max(1.0) as u32
    }

    /// Time between two samples, in ticks of `tick` (s).
    #[must_use]
    pub fn sample_period(&self, tick: f64) -> f64 {
        f64::from(self.ticks_per_sample(tick)) * tick / f64::from(self.samples_per_tick(tick))
    }

    /// Delay of the anti-alias filter, in ticks of `tick` (s).
    #[must_use]
    pub fn filter_delay(&self, tick: f64) -> f64 {
        LowPass::delay(self.filter_cutoff, self.sample_period(tick))
    }

    /// Ticks of `tick` (s) per sample given to the estimator.
    #[must_use]
    pub fn ticks_per_sample(&self, tick: f64) -> u32 {
        (1.0 / (self.rate * tick)).round().max(1.0) as u32
    }
}

/// One kind of sensor of the unit.
#[derive(Clone, Debug)]
struct Axes {
    distortion: Distortion,
    bias: Bias,
    noise: WhiteNoise,
    filter: LowPass,
    converter: Converter,
    /// Input of a vehicle that hovers level.
    hover: DVec3,
}

impl Axes {
    fn sample(&mut self, x: DVec3) -> DVec3 {
        let seen = self.distortion.apply(x) + self.bias.advance() + self.noise.advance();
        self.converter.convert_each(self.filter.advance(seen))
    }

    /// Bias, and what the distortion adds at hover.
    fn systematic(&self) -> DVec3 {
        self.bias.now() + self.distortion.apply(self.hover) - self.hover
    }
}

/// A unit in flight.
#[derive(Clone, Debug)]
pub struct Imu {
    gyro: Axes,
    accelerometer: Axes,
    vibration: Option<Vibration>,
    tick: f64,
    ticks_per_sample: u32,
    samples_per_tick: u32,
    taken: u32,
    rate_sum: DVec3,
    force_sum: DVec3,
}

impl Imu {
    /// Of a flight with `seed`, in ticks of `tick` (s).
    #[must_use]
    pub fn new(parameters: &ImuParameters, seed: u64, tick: f64) -> Self {
        let p = parameters;
        let ticks_per_sample = p.ticks_per_sample(tick);
        let samples_per_tick = p.samples_per_tick(tick);
        let period = p.sample_period(tick);
        let filter = LowPass::new(p.filter_cutoff, period);
        let normal = |effect| Normal::new(seed, effect);
        let distortion =
            |effect| Distortion::new(p.scale_error / 100.0, p.misalignment / 100.0, normal(effect));
        let ((gyro_walk, force_walk), (gyro_offset, force_offset)) = (p.walks(), p.offsets());
        Self {
            gyro: Axes {
                distortion: distortion(0),
                bias: Bias::new(gyro_offset, gyro_walk, period, normal(1)),
                noise: WhiteNoise::of_density(p.gyro_noise_density * DEGREE, period, normal(2)),
                filter: filter.clone(),
                converter: Converter::new(p.gyro_range * DEGREE, p.gyro_step()),
                hover: DVec3::ZERO,
            },
            accelerometer: Axes {
                distortion: distortion(3),
                bias: Bias::new(force_offset, force_walk, period, normal(4)),
                noise: WhiteNoise::of_density(
                    p.accelerometer_noise_density * 1e-6 * G,
                    period,
                    normal(5),
                ),
                filter,
                converter: Converter::new(p.accelerometer_range * G, p.accelerometer_step()),
                hover: DVec3::Z * f64::from(GRAVITY),
            },
            vibration: None,
            tick,
            ticks_per_sample,
            samples_per_tick,
            taken: 0,
            rate_sum: DVec3::ZERO,
            force_sum: DVec3::ZERO,
        }
    }

    /// Systematic errors at hover, by bias and distortion: gyro (rad/s), accelerometer (m/s^2). An estimator
    /// without states for scale and alignment finds these as its biases.
    #[must_use]
    pub fn biases(&self) -> (DVec3, DVec3) {
        (self.gyro.systematic(), self.accelerometer.systematic())
    }

    /// The motion of one tick; a sample when one is complete.
    pub fn advance(&mut self, before: &PlantState, now: &PlantState) -> Option<InertialSample> {
        let (rate, force) = means(before, now, self.tick);
        if self.samples_per_tick > 1 {
            return Some(self.several(rate, force, now.rate_body - before.rate_body));
        }
        let (shake_rate, shake_force) = self.shake(self.tick, force.z);
        self.rate_sum += rate + shake_rate;
        self.force_sum += force + shake_force;
        self.taken += 1;
        if self.taken < self.ticks_per_sample {
            return None;
        }
        let n = f64::from(self.taken);
        let rate = self.gyro.sample(self.rate_sum / n);
        let force = self.accelerometer.sample(self.force_sum / n);
        (self.taken, self.rate_sum, self.force_sum) = (0, DVec3::ZERO, DVec3::ZERO);
        Some(InertialSample { rate_body: rate.as_vec3(), specific_force_body: force.as_vec3() })
    }

    /// The mean of a tick's samples, about the mean `rate`, which changes by `change` over the tick.
    fn several(&mut self, rate: DVec3, force: DVec3, change: DVec3) -> InertialSample {
        let n = f64::from(self.samples_per_tick);
        let (mut rates, mut forces) = (DVec3::ZERO, DVec3::ZERO);
        for k in 0..self.samples_per_tick {
            let (shake_rate, shake_force) = self.shake(self.tick / n, force.z);
            let place = (f64::from(k) + 0.5) / n - 0.5;
            rates += self.gyro.sample(rate + change * place + shake_rate) / n;
            forces += self.accelerometer.sample(force + shake_force) / n;
        }
        InertialSample { rate_body: rates.as_vec3(), specific_force_body: forces.as_vec3() }
    }

    /// Vibration over the next `period` (s): rate and specific force.
    fn shake(&mut self, period: f64, thrust: f64) -> (DVec3, DVec3) {
        let vibration = self.vibration.as_mut();
        vibration.map_or((DVec3::ZERO, DVec3::ZERO), |it| it.advance(period, thrust))
    }

    /// The same unit on a frame that vibrates.
    #[must_use]
    pub fn shaken(self, vibration: Vibration) -> Self {
        Self { vibration: Some(vibration), ..self }
    }
}

/// Mean rate and specific force over a tick in body axes: what a filter matched to the rate passes.
#[must_use]
pub fn means(before: &PlantState, now: &PlantState, tick: f64) -> (DVec3, DVec3) {
    let turn = before.attitude.inverse() * now.attitude;
    let turn = if turn.w < 0.0 { -turn } else { turn };
    let vector = DVec3::new(turn.x, turn.y, turn.z);
    let sine = vector.norm();
    let angle = 2.0 * libm::atan2(sine, turn.w);
    let rotation = if sine > 1e-9 { vector * (angle / sine) } else { 2.0 * vector };
    let middle: DQuat = (before.attitude + before.attitude * turn).unit();
    let gained = (now.velocity_world - before.velocity_world) / tick;
    let force = middle.inverse() * (gained + DVec3::Z * f64::from(GRAVITY));
    (rotation / tick, force)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(time: f64) -> PlantState {
        let rate = DVec3::new(0.4, -0.3, 0.8);
        PlantState {
            position_world: DVec3::ZERO,
            velocity_world: DVec3::new(2.0, 1.0, -1.0) * time,
            attitude: DQuat::from_scaled_axis(rate * time),
            rate_body: rate,
        }
    }

    /// A part without any error.
    const EXACT: ImuParameters = ImuParameters {
        gyro_noise_density: 0.0,
        gyro_bias_walk: 0.0,
        gyro_offset: 0.0,
        gyro_sensitivity: 1e9,
        accelerometer_noise_density: 0.0,
        accelerometer_bias_walk: 0.0,
        accelerometer_offset: 0.0,
        accelerometer_sensitivity: 1e9,
        scale_error: 0.0,
        misalignment: 0.0,
        ..ImuParameters::BMI088
    };

    #[test]
    fn without_errors_it_gives_rate_and_specific_force() {
        let mut imu = Imu::new(&EXACT, 1, 1e-3);
        let sample = imu.advance(&state(0.5), &state(0.501)).unwrap();
        assert!((sample.rate_body.as_dvec3() - state(0.0).rate_body).length() < 1e-6);
        let force = DVec3::new(2.0, 1.0, -1.0 + f64::from(GRAVITY));
        let expected = state(0.5005).attitude.inverse() * force;
        assert!((sample.specific_force_body.as_dvec3() - expected).length() < 1e-5);
    }

    #[test]
    fn it_saturates_at_full_scale() {
        let mut imu = Imu::new(&EXACT, 1, 1e-3);
        let fast = PlantState { velocity_world: DVec3::Z, ..state(0.0) };
        let sample = imu.advance(&state(0.0), &fast).unwrap();
        assert!((f64::from(sample.specific_force_body.z) - 24.0 * G).abs() < 1e-3);
    }

    #[test]
    fn a_fast_unit_gives_means_over_a_tick_with_the_same_density() {
        for rate in [1000.0, 4000.0, 8000.0] {
            let parameters =
                ImuParameters { rate, gyro_noise_density: 0.014, gyro_sensitivity: 1e9, ..EXACT };
            let mut imu = Imu::new(&parameters, 7, 1e-3);
            let mut square = 0.0;
            for k in 0..20_000 {
                let time = 1e-3 * f64::from(k);
                let sample = imu.advance(&state(time), &state(time + 1e-3)).unwrap();
                let error = sample.rate_body.as_dvec3() - state(0.0).rate_body;
                square += error.length_squared() / 3.0 / 20_000.0;
            }
            let density = (square * 1e-3).sqrt();
            assert!((density / (0.014 * DEGREE) - 1.0).abs() < 0.02, "{rate}: {density}");
        }
    }

    /// Amplitude of what the unit shows along x of a vibration at 180 Hz, against the true one.
    fn passed(rate: f64, filter_cutoff: f64) -> f64 {
        use super::super::vibration::VibrationParameters;
        let parameters = ImuParameters { rate, filter_cutoff, accelerometer_range: 1e3, ..EXACT };
        let shaking = VibrationParameters {
            rotors: 1,
            frequency: 180.0,
            spread: 0.0,
            acceleration: 5.0,
            rate: 0.0,
        };
        let vibration = Vibration::new(&shaking, Normal::new(1, 60));
        let mut imu = Imu::new(&parameters, 7, 1e-3).shaken(vibration);
        let rest = PlantState { velocity_world: DVec3::ZERO, rate_body: DVec3::ZERO, ..state(0.0) };
        let (mut re, mut im, n) = (0.0, 0.0, 5_000);
        for k in 0..n + 500 {
            let force = imu.advance(&rest, &rest).unwrap().specific_force_body.x;
            if k >= 500 {
                let angle = 2.0 * PI * 180.0 * 1e-3 * f64::from(k);
                re += f64::from(force) * libm::cos(angle) * 2.0 / f64::from(n) / 5.0;
                im += f64::from(force) * libm::sin(angle) * 2.0 / f64::from(n) / 5.0;
            }
        }
        re.hypot(im)
    }

    #[test]
    fn vibration_is_seen_as_the_filter_and_the_mean_let_it() {
        assert!((passed(1000.0, 0.0) - 1.0).abs() < 1e-3);
        // The mean of 8 samples over 1 ms: sin(pi f T)/(8 sin(pi f T/8)).
        let angle = PI * 180.0 * 1e-3;
        let mean = libm::sin(angle) / (8.0 * libm::sin(angle / 8.0));
        assert!((passed(8000.0, 0.0) / mean - 1.0).abs() < 1e-3);
        let ratio = libm::tan(PI * 180.0 / 8000.0) / libm::tan(PI * 90.0 / 8000.0);
        let expected = mean / (1.0 + ratio.powi(4)).sqrt();
        assert!((passed(8000.0, 90.0) / expected - 1.0).abs() < 2e-3);
    }

    #[test]
    fn samples_come_at_the_rate_and_the_noise_has_the_density() {
        for (parameters, rate) in
            [(ImuParameters::BMI088, 1000.0), (ImuParameters::ICM_42688_P, 500.0)]
        {
            let parameters =
                ImuParameters { rate, gyro_offset: 0.0, gyro_bias_walk: 0.0, ..parameters };
            let mut imu = Imu::new(&parameters, 7, 1e-3);
            let rest = PlantState { velocity_world: DVec3::ZERO, ..state(0.0) };
            let samples: Vec<_> = (0..40_000).filter_map(|_| imu.advance(&rest, &rest)).collect();
            assert_eq!(samples.len(), (40.0 * rate) as usize);
            let square: f64 =
                samples.iter().map(|sample| f64::from(sample.rate_body.length_squared())).sum();
            let density = (square / 3.0 / samples.len() as f64 / rate).sqrt();
            let (expected, _) = parameters.densities(1.0 / rate);
            assert!((density / expected - 1.0).abs() < 0.02, "{density} {expected}");
        }
    }
}
