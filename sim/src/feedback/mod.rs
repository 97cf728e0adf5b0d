//! State feedback with noise and latency, in place of the true state.
//!
//! The controller receives, per quantity, the state of a whole number of ticks ago plus noise of now. Each part of the noise
//! draws from its own stream of the scenario's seed. This is a model of the knowledge of the state as such; sensors and an
//! estimator between vehicle and controller are in [`crate::sensor`], and a scenario has one or the other.

mod config;
pub mod noise;

pub use config::{BandLimitedNoise, QuantityFeedback, StateFeedbackConfig};

use std::collections::VecDeque;

use ctrl_core::vehicle::VehicleState;
use glam::DVec3;

use crate::norm::rotation_about;
use crate::plant::PlantState;
use crate::sensor::random::Normal;
use noise::BandLimitedProcess;

/// First stream of this module; sensors and wind end before. Two streams per quantity.
const FIRST_STREAM: u64 = 100;

/// State feedback in flight.
#[derive(Clone, Debug)]
pub struct StateFeedback {
    /// The truth of this tick and of those before it, as far back as the longest latency.
    history: VecDeque<PlantState>,
    position: Channel,
    velocity: Channel,
    attitude: Channel,
    rate_body: Channel,
}

impl StateFeedback {
    /// At the start of a flight from `start`, at which the vehicle is taken to have been before; `step_period` (s).
    #[must_use]
    pub fn new(
        config: &StateFeedbackConfig,
        seed: u64,
        step_period: f64,
        start: &PlantState,
    ) -> Self {
        let mut stream = FIRST_STREAM;
        let [position, velocity, attitude, rate_body] = config.quantities().map(|quantity| {
            let channel = Channel::new(&quantity, step_period, [stream, stream + 1], seed);
            stream += 2;
            channel
        });
        let channels = [&position, &velocity, &attitude, &rate_body];
        let longest = channels.iter().map(|channel| channel.latency).max().unwrap_or(0);
        let history = VecDeque::from(vec![*start; longest + 1]);
        Self { history, position, velocity, attitude, rate_body }
    }

    /// The state that the controller receives at this tick. Called once per tick.
    pub fn measure(&mut self, truth: &PlantState) -> VehicleState {
        self.history.pop_back();
        self.history.push_front(*truth);
        let past = |channel: &Channel| self.history[channel.latency];
        let mut seen = PlantState {
            position_world: past(&self.position).position_world,
            velocity_world: past(&self.velocity).velocity_world,
            attitude: past(&self.attitude).attitude,
            rate_body: past(&self.rate_body).rate_body,
        };
        if let Some(noise) = self.position.noise() {
            seen.position_world += noise;
        }
        if let Some(noise) = self.velocity.noise() {
            seen.velocity_world += noise;
        }
        if let Some(noise) = self.attitude.noise() {
            seen.attitude *= rotation_about(noise);
        }
        if let Some(noise) = self.rate_body.noise() {
            seen.rate_body += noise;
        }
        seen.measured()
    }
}

/// Noise and latency of one quantity in progress.
#[derive(Clone, Debug)]
struct Channel {
    white: Option<(f64, Normal)>,
    band: Option<BandLimitedProcess>,
    /// In ticks.
    latency: usize,
}

impl Channel {
    fn new(config: &QuantityFeedback, step_period: f64, streams: [u64; 2], seed: u64) -> Self {
        let [white, band] = streams.map(|stream| Normal::new(seed, stream));
        Self {
            white: config.white_noise.map(|deviation| (deviation, white)),
            band: config
                .band_limited_noise
                .map(|it| BandLimitedProcess::new(&it, step_period, band)),
            latency: (config.latency.unwrap_or_default() / step_period).round() as usize,
        }
    }

    /// The noise of this tick, if there is any; moves on by one tick.
    fn noise(&mut self) -> Option<DVec3> {
        let white = self.white.as_mut().map(|(deviation, normal)| *deviation * normal.vector());
        let band = self.band.as_mut().map(BandLimitedProcess::advance);
        match (white, band) {
            (Some(white), Some(band)) => Some(white + band),
            (white, band) => white.or(band),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    const DT: f64 = 1e-3;

    fn truth(tick: u32) -> PlantState {
        let t = f64::from(tick) * DT;
        PlantState {
            position_world: DVec3::new(t, 1.0, -t),
            velocity_world: DVec3::new(1.0, t, -1.0),
            attitude: DQuat::from_rotation_x(0.2 * t),
            rate_body: DVec3::new(0.2, t * t, 0.0),
        }
    }

    fn feedback(config: &StateFeedbackConfig) -> StateFeedback {
        StateFeedback::new(config, 3, DT, &truth(0))
    }

    fn white(deviation: f64) -> Option<QuantityFeedback> {
        Some(QuantityFeedback { white_noise: Some(deviation), ..QuantityFeedback::default() })
    }

    #[test]
    fn without_noise_and_latency_it_is_the_truth_to_the_bit() {
        let mut exact = feedback(&StateFeedbackConfig::default());
        for tick in 0..100 {
            assert_eq!(exact.measure(&truth(tick)), truth(tick).measured());
        }
    }

    #[test]
    fn each_quantity_is_as_old_as_its_latency() {
        let late = |latency| {
            Some(QuantityFeedback { latency: Some(latency), ..QuantityFeedback::default() })
        };
        let config = StateFeedbackConfig {
            position: late(0.02),
            velocity: late(0.0),
            attitude: late(0.0074),
            rate_body: late(0.001),
        };
        let mut feedback = feedback(&config);
        for tick in 0..100u32 {
            let seen = feedback.measure(&truth(tick));
            let ago = |ticks: u32| truth(tick.saturating_sub(ticks)).measured();
            assert_eq!(seen.position_world, ago(20).position_world);
            assert_eq!(seen.velocity_world, ago(0).velocity_world);
            assert_eq!(seen.attitude, ago(7).attitude);
            assert_eq!(seen.rate_body, ago(1).rate_body);
        }
    }

    /// Mean square of the components of the four errors over `n` ticks.
    fn mean_squares(config: &StateFeedbackConfig, n: u32) -> [f64; 4] {
        let mut feedback = feedback(config);
        let mut sums = [0.0; 4];
        for tick in 0..n {
            let (truth, seen) = (truth(tick % 1000), feedback.measure(&truth(tick % 1000)));
            let turn = truth.attitude.inverse() * seen.attitude.as_dquat();
            let errors = [
                seen.position_world.as_dvec3() - truth.position_world,
                seen.velocity_world.as_dvec3() - truth.velocity_world,
                2.0 * turn.xyz() * turn.w.signum(),
                seen.rate_body.as_dvec3() - truth.rate_body,
            ];
            for (sum, error) in sums.iter_mut().zip(errors) {
                *sum += error.length_squared() / 3.0;
            }
        }
        sums.map(|sum| sum / f64::from(n))
    }

    #[test]
    fn each_quantity_has_the_deviation_that_it_is_given() {
        let config = StateFeedbackConfig {
            position: white(0.02),
            velocity: white(0.05),
            attitude: white(0.01),
            rate_body: Some(QuantityFeedback {
                band_limited_noise: Some(BandLimitedNoise {
                    deviation: 0.4,
                    center: 0.0,
                    bandwidth: 100.0,
                }),
                ..white(0.3).expect("noise")
            }),
        };
        let found = mean_squares(&config, 60_000);
        // White noise to 1 % (180,000 squares); the band is added to it, and its values are not independent.
        for (found, (deviation, tolerance)) in
            found.into_iter().zip([(0.02, 0.01), (0.05, 0.01), (0.01, 0.01), (0.5, 0.02)])
        {
            let ratio = found.sqrt() / deviation;
            assert!((ratio - 1.0f64).abs() < tolerance, "{deviation}: {ratio}");
        }
    }

    #[test]
    fn noise_of_one_quantity_does_not_change_that_of_another() {
        let seen = |config: &StateFeedbackConfig| {
            let mut feedback = feedback(config);
            [0, 1, 2].map(|tick| feedback.measure(&truth(tick)).rate_body)
        };
        let alone = StateFeedbackConfig { rate_body: white(0.1), ..StateFeedbackConfig::default() };
        let all = StateFeedbackConfig { position: white(0.2), attitude: white(0.1), ..alone };
        assert_eq!(seen(&alone), seen(&all));
        assert_ne!(seen(&alone), seen(&StateFeedbackConfig::default()));
    }
}
