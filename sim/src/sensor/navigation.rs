//! Flight by sensors: they see the plant, the estimator sees them, and the controller gets its estimate.

use std::sync::mpsc::Sender;

use crate::norm::{Norm, rotation_about};
use ctrl_core::error::ConfigError;
use ctrl_core::estimator::covariance::STATES;
use ctrl_core::estimator::{
    Estimator, EstimatorState, InertialSample, Measurement, SOURCES, Source, Verdict,
};
use ctrl_core::vehicle::VehicleState;
use glam::DVec3;

use super::barometer::Barometer;
use super::capture::Capture;
use super::config::SensorsConfig;
use super::fault::Faults;
use super::flow::Flow;
use super::gnss::Gnss;
use super::imu::Imu;
use super::magnetometer::Magnetometer;
use super::random::Normal;
use super::rangefinder::Rangefinder;
use super::vibration::Vibration;
use crate::plant::PlantState;

/// Sums of the normalised squared innovations (NIS) of accepted measurements.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Innovations {
    /// Sum; chi-square distributed with `components` degrees of freedom if the filter is consistent.
    pub sum: f64,
    /// Numbers taken in.
    pub components: u64,
    /// Measurements that were not taken in.
    pub refused: u64,
}

impl Innovations {
    /// The sums of both.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            sum: self.sum + other.sum,
            components: self.components + other.components,
            refused: self.refused + other.refused,
        }
    }
}

/// What the sensors gave at one tick, as the estimator took it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensorSamples {
    /// State at which the estimate begins: at the first tick.
    pub start: Option<VehicleState>,
    /// Inertial sample.
    pub inertial: Option<InertialSample>,
    /// Measurements, in their order.
    pub measurements: Vec<Measurement>,
}

/// Errors of an estimate, truth less estimate, in the order of the estimator's states.
pub type ErrorState = [f64; STATES];

/// Sensors and estimator in flight.
#[derive(Clone, Debug)]
pub struct Navigation {
    estimator: Estimator,
    state: EstimatorState,
    imu: Imu,
    barometer: Option<Barometer>,
    magnetometer: Option<Magnetometer>,
    gnss: Option<Gnss>,
    capture: Option<Capture>,
    rangefinder: Option<Rangefinder>,
    flow: Option<Flow>,
    faults: Faults,
    /// State at which the estimate began.
    start: VehicleState,
    /// Receives the samples of every tick.
    samples: Option<Sender<SensorSamples>>,
    /// Last inertial sample.
    inertial: InertialSample,
    period: f64,
    tick: u64,
    before: PlantState,
    innovations: [Innovations; SOURCES.len()],
}

impl Navigation {
    /// At the start of a flight from `truth`, with an estimate that differs from it by the initial deviations.
    ///
    /// # Errors
    /// The parameter that the estimator refuses.
    pub fn new(
        config: &SensorsConfig,
        seed: u64,
        tick: f64,
        truth: &PlantState,
    ) -> Result<Self, ConfigError> {
        let estimator = Estimator::new(&config.estimator(tick))?;
        let start = started(&estimator, truth, seed);
        let state = estimator.start(&start);
        let imu = Imu::new(&config.imu(), seed, tick);
        Ok(Self {
            estimator,
            state,
            imu: match &config.vibration {
                Some(it) => imu.shaken(Vibration::new(it, Normal::new(seed, 60))),
                None => imu,
            },
            barometer: config.barometer().map(|it| Barometer::new(&it, seed, tick)),
            magnetometer: config.magnetometer().map(|it| Magnetometer::new(&it, seed, tick)),
            gnss: config.gnss().map(|it| Gnss::new(&it, seed, tick)),
            capture: config.capture().map(|it| Capture::new(&it, seed, tick)),
            rangefinder: config.rangefinder().map(|it| Rangefinder::new(&it, seed, tick)),
            flow: config.flow().map(|it| Flow::new(&it, seed, tick)),
            faults: Faults::new(&config.faults),
            start,
            samples: None,
            inertial: InertialSample::default(),
            period: tick,
            tick: 0,
            before: *truth,
            innovations: Default::default(),
        })
    }

    /// Takes what the sensors give at this tick; returns what the controller gets. Called once per tick.
    pub fn measure(&mut self, truth: &PlantState) -> VehicleState {
        let mut samples = SensorSamples::default();
        if self.tick > 0 {
            samples.inertial = self.imu.advance(&self.before, truth);
            if let Some(sample) = samples.inertial {
                self.estimator.predict(&mut self.state, &sample);
                self.inertial = sample;
            }
            self.correct(truth, &mut samples.measurements);
        } else {
            samples.start = Some(self.start);
        }
        if let Some(receiver) = &self.samples {
            // Nobody may listen any more.
            let _ = receiver.send(samples);
        }
        self.before = *truth;
        self.tick += 1;
        self.state.vehicle()
    }

    /// Sends the samples of every tick from now on.
    pub fn send_samples(&mut self, receiver: Sender<SensorSamples>) {
        self.samples = Some(receiver);
    }

    fn correct(&mut self, truth: &PlantState, taken: &mut Vec<Measurement>) {
        let tick = self.tick;
        let height =
            self.barometer.as_mut().and_then(|it| it.advance(tick, truth.position_world.z));
        let field = self.magnetometer.as_mut().and_then(|it| it.advance(tick, truth.attitude));
        let solution = self.gnss.as_mut().and_then(|it| it.advance(tick, truth));
        let pose = self.capture.as_mut().and_then(|it| it.advance(tick, truth));
        let distance = self.rangefinder.as_mut().and_then(|it| it.advance(tick, truth));
        let (before, inertial) = (&self.before, &self.inertial);
        let flow = self.flow.as_mut().and_then(|it| it.advance(tick, before, truth, inertial));
        let measurements = [
            height.map(|height| Measurement::Barometer(height as f32)),
            field.map(|field| Measurement::Magnetometer(field.as_vec3())),
            solution.map(|solution| Measurement::GnssPosition(solution.position.as_vec3())),
            solution.map(|solution| Measurement::GnssVelocity(solution.velocity.as_vec3())),
            pose.map(|pose| Measurement::CapturePosition(pose.position.as_vec3())),
            pose.map(|pose| Measurement::CaptureAttitude(pose.attitude.as_quat())),
            distance.map(|distance| Measurement::Rangefinder(distance as f32)),
            flow.map(|flow| Measurement::OpticalFlow(flow.as_vec2())),
        ];
        let time = tick as f64 * self.period;
        for measurement in measurements.into_iter().flatten() {
            let Some(measurement) = self.faults.apply(time, measurement) else { continue };
            if self.samples.is_some() {
                taken.push(measurement);
            }
            let sums = &mut self.innovations[measurement.source() as usize];
            match self.estimator.correct(&mut self.state, &measurement) {
                Verdict::Accepted { normalised, components } => {
                    sums.sum += f64::from(normalised);
                    sums.components += u64::from(components);
                }
                _ => sums.refused += 1,
            }
        }
    }

    /// The estimator.
    #[must_use]
    pub fn estimator(&self) -> &Estimator {
        &self.estimator
    }

    /// Its state.
    #[must_use]
    pub fn state(&self) -> &EstimatorState {
        &self.state
    }

    /// Innovations so far.
    #[must_use]
    pub fn innovations(&self) -> Innovations {
        self.innovations.iter().fold(Innovations::default(), |sum, x| sum.plus(x))
    }

    /// Innovations of one source so far.
    #[must_use]
    pub fn innovations_of(&self, source: Source) -> Innovations {
        self.innovations[source as usize]
    }

    /// Errors of the estimate against `truth`, and the sensors' own biases.
    #[must_use]
    pub fn errors(&self, truth: &PlantState) -> ErrorState {
        let vehicle = self.state.vehicle();
        let turn = truth.attitude * vehicle.attitude.as_dquat().unit().inverse();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let (gyro, force) = self.imu.biases();
        let parts = [
            truth.position_world - vehicle.position_world.as_dvec3(),
            truth.velocity_world - vehicle.velocity_world.as_dvec3(),
            2.0 * DVec3::new(turn.x, turn.y, turn.z),
            gyro - self.state.gyro_bias().as_dvec3(),
            force - self.state.accelerometer_bias().as_dvec3(),
        ];
        let mut errors = [0.0; STATES];
        let barometer = self.barometer.as_ref().map_or(0.0, Barometer::bias);
        errors[0] = barometer - f64::from(self.state.barometer_bias());
        for (errors, part) in errors[1..].chunks_exact_mut(3).zip(parts) {
            errors.copy_from_slice(&part.to_array());
        }
        errors
    }
}

/// `truth` with errors of the estimator's initial deviations.
fn started(estimator: &Estimator, truth: &PlantState, seed: u64) -> VehicleState {
    let initial = &estimator.config().initial;
    let mut normal = Normal::new(seed, 50);
    let tilt = f64::from(initial.tilt);
    let turn = DVec3::new(tilt, tilt, initial.heading.into()) * normal.vector();
    let exact = truth.measured();
    let position = f64::from(initial.position) * normal.vector();
    let velocity = f64::from(initial.velocity) * normal.vector();
    VehicleState {
        position_world: exact.position_world + position.as_vec3(),
        velocity_world: exact.velocity_world + velocity.as_vec3(),
        attitude: (rotation_about(turn) * truth.attitude).as_quat(),
        rate_body: exact.rate_body,
    }
}
