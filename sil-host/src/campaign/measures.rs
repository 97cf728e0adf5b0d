//! What a flight is measured by, beside its guarantees: peaks, ends, times and effort, from the
//! plant's truth.

use ctrl_core::controller::StepStatus;
use glam::DVec3;

use crate::guarantee::lyapunov::Evaluation;
use crate::guarantee::tracking::{heading_error, tilt_error};
use crate::sample::Sample;
use crate::scenario::Scenario;

/// A column of the results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Measure {
    /// Name of the column.
    pub key: &'static str,
    /// Unit of its values.
    pub unit: &'static str,
    /// What it is, in a few words.
    pub label: &'static str,
}

macro_rules! measures {
    ($($key:literal, $unit:literal, $label:literal;)*) => {
        [$(Measure { key: $key, unit: $unit, label: $label }),*]
    };
}

/// Every measure, in the order of the columns. "Settled" is from when on an error stays within its
/// bound of the scenario's `[guarantees]`; there is none if it is outside at the end.
pub const MEASURES: [Measure; 19] = measures![
    "position_error_peak", "m", "largest distance from the reference";
    "position_error_rms", "m", "root mean square of the distance from the reference";
    "position_error_final", "m", "distance from the reference at the end";
    "position_settled", "s", "since when the position error is within its bound";
    "tilt_error_final", "rad", "angle between body z and b3d at the end";
    "tilt_settled", "s", "since when the tilt error is within its bound";
    "heading_error_final", "rad", "angle between body y and b2d at the end";
    "heading_settled", "s", "since when the heading error is within its bound";
    "tilt_peak", "rad", "largest angle between body z and the vertical";
    "rate_peak", "rad/s", "largest angular rate";
    "speed_peak", "m/s", "largest speed";
    "height_lost", "m", "from the start down to the lowest point";
    "thrust_lowest", "N", "smallest commanded thrust";
    "thrust_highest", "N", "largest commanded thrust";
    "torque_peak", "N m", "largest commanded torque component";
    "torque_rms", "N m", "root mean square of the commanded torque";
    "torque_demand_peak", "N m", "largest torque component before saturation";
    "torque_saturated", "s", "time with a torque component in saturation";
    "mass_error_final", "kg", "mass estimate less true mass at the end";
];

/// Measures of a flight in progress.
#[derive(Clone, Debug)]
pub struct Measures {
    bounds: Errors,
    step_period: f64,
    true_mass: f64,
    ticks: u64,
    errors: Errors,
    /// From when on each error has been within its bound [s]; none while it is outside.
    settled: [Option<f64>; 3],
    position_peak: f64,
    position_square_sum: f64,
    /// Body z where its angle from the vertical was largest.
    steepest: DVec3,
    rate_square_peak: f64,
    speed_square_peak: f64,
    start_height: f64,
    lowest_height: f64,
    thrust: [f32; 2],
    torque_peak: f32,
    torque_square_sum: f64,
    demand_peak: f32,
    saturated_ticks: u64,
    mass_estimate: f64,
}

/// Distance from the reference [m], tilt error [rad] and heading error [rad].
type Errors = [f64; 3];

impl Measures {
    /// For a flight of `scenario`, which has not begun.
    #[must_use]
    pub fn new(scenario: &Scenario) -> Self {
        let bounds = &scenario.guarantees;
        Self {
            bounds: [bounds.position_error_max, bounds.tilt_error_max, bounds.heading_error_max],
            step_period: f64::from(scenario.controller.step_period()),
            true_mass: scenario.vehicle.mass,
            ticks: 0,
            errors: [0.0; 3],
            settled: [Some(0.0); 3],
            position_peak: 0.0,
            position_square_sum: 0.0,
            steepest: DVec3::Z,
            rate_square_peak: 0.0,
            speed_square_peak: 0.0,
            start_height: scenario.initial.position.z,
            lowest_height: f64::INFINITY,
            thrust: [f32::INFINITY, f32::NEG_INFINITY],
            torque_peak: 0.0,
            torque_square_sum: 0.0,
            demand_peak: 0.0,
            saturated_ticks: 0,
            mass_estimate: 0.0,
        }
    }

    /// Takes in one tick.
    pub fn observe(&mut self, sample: &Sample, evaluation: &Evaluation) {
        self.ticks += 1;
        self.observe_errors(sample, evaluation);
        self.observe_motion(sample);
        self.observe_command(sample);
        self.mass_estimate = f64::from(sample.estimates.inverse_mass).recip();
    }

    fn observe_errors(&mut self, sample: &Sample, evaluation: &Evaluation) {
        let attitude = sample.truth.attitude;
        let position = evaluation.position_error.length();
        self.errors = [
            position,
            tilt_error(attitude, &sample.reference),
            heading_error(attitude, &sample.reference),
        ];
        self.position_peak = self.position_peak.max(position);
        self.position_square_sum += position * position;
        for ((settled, error), bound) in self.settled.iter_mut().zip(self.errors).zip(self.bounds) {
            *settled = (error <= bound).then(|| settled.unwrap_or(sample.time));
        }
    }

    fn observe_motion(&mut self, sample: &Sample) {
        let truth = &sample.truth;
        let up = truth.attitude * DVec3::Z;
        if up.z < self.steepest.z {
            self.steepest = up;
        }
        self.rate_square_peak = self.rate_square_peak.max(truth.rate_body.length_squared());
        self.speed_square_peak = self.speed_square_peak.max(truth.velocity_world.length_squared());
        self.lowest_height = self.lowest_height.min(truth.position_world.z);
    }

    fn observe_command(&mut self, sample: &Sample) {
        let output = &sample.output;
        let thrust = output.wrench.thrust;
        self.thrust = [self.thrust[0].min(thrust), self.thrust[1].max(thrust)];
        let torque = output.wrench.torque_body;
        self.torque_peak = self.torque_peak.max(torque.abs().max_element());
        self.torque_square_sum += torque.as_dvec3().length_squared();
        self.demand_peak = self.demand_peak.max(output.torque_demand_body.abs().max_element());
        let saturated = output.status.contains(StepStatus::TORQUE_SATURATED);
        self.saturated_ticks += u64::from(saturated);
    }

    /// One value a column of [`MEASURES`]; all are absent when nothing was flown.
    #[must_use]
    pub fn values(&self) -> Vec<Option<f64>> {
        if self.ticks == 0 {
            return vec![None; MEASURES.len()];
        }
        let rms = |sum: f64| (sum / self.ticks as f64).sqrt();
        let [position, tilt, heading] = self.errors;
        let [position_settled, tilt_settled, heading_settled] = self.settled;
        let horizontal = self.steepest.truncate().length();
        let [thrust_lowest, thrust_highest] = self.thrust.map(f64::from);
        let columns: [Option<f64>; MEASURES.len()] = [
            Some(self.position_peak),
            Some(rms(self.position_square_sum)),
            Some(position),
            position_settled,
            Some(tilt),
            tilt_settled,
            Some(heading),
            heading_settled,
            Some(libm::atan2(horizontal, self.steepest.z)),
            Some(self.rate_square_peak.sqrt()),
            Some(self.speed_square_peak.sqrt()),
            Some(self.start_height - self.lowest_height),
            Some(thrust_lowest),
            Some(thrust_highest),
            Some(self.torque_peak.into()),
            Some(rms(self.torque_square_sum)),
            Some(self.demand_peak.into()),
            Some(self.saturated_ticks as f64 * self.step_period),
            Some(self.mass_estimate - self.true_mass),
        ];
        columns.to_vec()
    }
}
