//! Optical flow: how fast the ground below moves through the image, over the period of a sample.
//!
//! A camera along the body's -z axis sees the ground move by `v/d` and by its own rotation. The driver takes the
//! rotation out by the gyro's samples over the same time, their bias and noise included.

use ctrl_core::estimator::InertialSample;
use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::random::Normal;
use super::rangefinder::distance;
use super::schedule::Schedule;
use crate::plant::PlantState;

/// Parameters of an optical-flow sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlowParameters {
    /// Rate of the samples (Hz).
    pub rate: f64,
    /// Age of a sample's end when it arrives (s).
    pub delay: f64,
    /// Noise of each axis, root mean square (rad/s).
    pub noise: f64,
    /// Largest flow of the image, rotation included (rad/s).
    pub range: f64,
    /// Nearest distance (m).
    pub nearest: f64,
    /// Farthest distance at which the ground has enough texture (m).
    pub farthest: f64,
    /// Share of samples that are lost.
    pub dropout: f64,
}

impl FlowParameters {
    /// PixArt PMW3901. Data sheet: 121 frames per second, from 80 mm on, up to 7.4 rad/s. It names no noise: 0.08 rad/s at
    /// 100 Hz is assumed, and that the ground has texture up to 4 m.
    pub const PMW3901: Self = Self {
        rate: 100.0,
        delay: 0.004,
        noise: 0.08,
        range: 7.4,
        nearest: 0.08,
        farthest: 4.0,
        dropout: 0.0,
    };

    /// Age of the flow when it arrives (s): it is a mean over the period before its end.
    #[must_use]
    pub fn age(&self) -> f64 {
        self.delay + 0.5 / self.rate
    }
}

/// Flow by translation, and of the whole image (rad/s); none where the ground is not seen.
fn flow(truth: &PlantState) -> Option<(DVec2, DVec2)> {
    let velocity = truth.attitude.inverse() * truth.velocity_world;
    let translation = velocity.truncate() / distance(truth)?;
    let rate = truth.rate_body;
    Some((translation, translation + DVec2::new(-rate.y, rate.x)))
}

/// A sensor in flight.
#[derive(Clone, Debug)]
pub struct Flow {
    parameters: FlowParameters,
    schedule: Schedule<Option<DVec2>>,
    normal: Normal,
    /// Sums over the period: image, gyro, ticks.
    image: DVec2,
    gyro: DVec2,
    ticks: f64,
    /// The ground was seen all the time.
    seen: bool,
}

impl Flow {
    /// Of a flight with `seed`, in ticks of `tick` (s).
    #[must_use]
    pub fn new(parameters: &FlowParameters, seed: u64, tick: f64) -> Self {
        let p = *parameters;
        Self {
            parameters: p,
            schedule: Schedule::new(p.rate, p.delay, p.dropout, tick, Normal::new(seed, 80)),
            normal: Normal::new(seed, 81),
            image: DVec2::ZERO,
            gyro: DVec2::ZERO,
            ticks: 0.0,
            seen: true,
        }
    }

    /// The motion of one tick and the gyro's sample of it; a flow without rotation when one arrives (rad/s).
    pub fn advance(
        &mut self,
        tick: u64,
        before: &PlantState,
        now: &PlantState,
        inertial: &InertialSample,
    ) -> Option<DVec2> {
        let p = self.parameters;
        match (flow(before), flow(now), distance(now)) {
            (Some((_, a)), Some((_, b)), Some(d)) if (p.nearest..=p.farthest).contains(&d) => {
                self.image += 0.5 * (a + b);
            }
            _ => self.seen = false,
        }
        let rate = inertial.rate_body.as_dvec3();
        self.gyro += DVec2::new(rate.y, -rate.x);
        self.ticks += 1.0;
        let Self { schedule, normal, image, gyro, ticks, seen, .. } = self;
        let arrived = schedule.advance(tick, || {
            let noise = p.noise * DVec2::new(normal.number(), normal.number());
            let seen_flow = *image / *ticks + noise;
            let usable = *seen && seen_flow.abs().max_element() <= p.range;
            let flow = usable.then_some(seen_flow + *gyro / *ticks);
            (*image, *gyro, *ticks, *seen) = (DVec2::ZERO, DVec2::ZERO, 0.0, true);
            flow
        });
        arrived.flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3};

    /// Turning about y and moving along x, 2 m above ground.
    fn at(time: f64) -> PlantState {
        PlantState {
            position_world: DVec3::new(0.6 * time, 0.0, 2.0),
            velocity_world: DVec3::new(0.6, 0.0, 0.0),
            attitude: DQuat::from_rotation_y(0.3 * time),
            rate_body: DVec3::new(0.0, 0.3, 0.0),
        }
    }

    #[test]
    fn rotation_is_taken_out_and_what_is_left_is_velocity_per_distance() {
        let mut sensor =
            Flow::new(&FlowParameters { noise: 0.0, ..FlowParameters::PMW3901 }, 1, 1e-3);
        let mut found = 0;
        for tick in 1..600 {
            let time = tick as f64 * 1e-3;
            let inertial = InertialSample {
                rate_body: at(time).rate_body.as_vec3(),
                ..InertialSample::default()
            };
            if let Some(seen) = sensor.advance(tick, &at(time - 1e-3), &at(time), &inertial) {
                let then = time - FlowParameters::PMW3901.age();
                // v_b/d with v_b = 0.6 cos(0.3 t) and d = 2/cos(0.3 t).
                let expected = 0.3 * libm::cos(0.3 * then).powi(2);
                assert!((seen - DVec2::new(expected, 0.0)).length() < 1e-4, "{seen}");
                found += 1;
            }
        }
        assert_eq!(found, 59);
    }

    #[test]
    fn flows_scatter_by_the_noise_and_stop_beyond_the_range() {
        let parameters = FlowParameters { rate: 1000.0, ..FlowParameters::PMW3901 };
        let still = PlantState { rate_body: DVec3::ZERO, velocity_world: DVec3::ZERO, ..at(0.0) };
        let flows = |state: PlantState| {
            let mut sensor = Flow::new(&parameters, 2, 1e-3);
            (1..20_000)
                .filter_map(|tick| sensor.advance(tick, &state, &state, &InertialSample::default()))
                .collect::<Vec<_>>()
        };
        let seen = flows(still);
        let square = seen.iter().map(|x| x.length_squared()).sum::<f64>() / 2.0 / seen.len() as f64;
        assert!((square.sqrt() / parameters.noise - 1.0).abs() < 0.02);
        assert!(flows(PlantState { velocity_world: 20.0 * DVec3::X, ..still }).is_empty());
        assert!(flows(PlantState { position_world: 5.0 * DVec3::Z, ..still }).is_empty());
    }
}
