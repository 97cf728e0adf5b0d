//! Measures of a flight beside its guarantees: peaks, ends, times and effort, from the
//! plant's truth.

use core::f64::consts::PI;

use ctrl_core::controller::StepStatus;
use glam::DVec3;

use sim::guarantee::angle::Angle;
use sim::guarantee::tracking::{heading, tilt};
use sim::norm::Norm;
use sim::observer::Observer;
use sim::scenario::Scenario;
use sim::tick::Tick;

/// A column of the results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Measure {
    /// Name of the column.
    pub key: &'static str,
    /// Unit of its values.
    pub unit: &'static str,
    /// Short description.
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
    /// Of position (m), tilt and heading.
    bounds: (f64, Angle, Angle),
    step_period: f64,
    true_mass: f64,
    ticks: u64,
    /// Distance from the reference (m), tilt and heading error.
    errors: (f64, Angle, Angle),
    /// From when on each of them has been within its bound (s); none while it is outside.
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

impl Measures {
    /// For a flight of `scenario`, which has not begun.
    #[must_use]
    pub fn new(scenario: &Scenario) -> Self {
        let bounds = &scenario.guarantees;
        Self {
            bounds: (
                bounds.position_error_max,
                Angle::of(bounds.tilt_error_max.min(PI)),
                Angle::of(bounds.heading_error_max.min(PI)),
            ),
            step_period: f64::from(scenario.controller.step_period()),
            true_mass: scenario.vehicle.mass,
            ticks: 0,
            errors: (0.0, Angle::default(), Angle::default()),
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

    fn observe_errors(&mut self, tick: &Tick) {
        let attitude = tick.truth.attitude;
        let position = tick.evaluation.position_error.norm();
        let reference = &tick.reference;
        let (tilt, heading) = (tilt(attitude, reference), heading(attitude, reference));
        self.errors = (position, tilt, heading);
        self.position_peak = self.position_peak.max(position);
        self.position_square_sum += position * position;
        let (position_max, tilt_max, heading_max) = self.bounds;
        let within =
            [position <= position_max, tilt.is_within(tilt_max), heading.is_within(heading_max)];
        for (settled, within) in self.settled.iter_mut().zip(within) {
            *settled = within.then(|| settled.unwrap_or(tick.time));
        }
    }

    fn observe_motion(&mut self, tick: &Tick) {
        let truth = &tick.truth;
        let up = truth.attitude * DVec3::Z;
        if up.z < self.steepest.z {
            self.steepest = up;
        }
        self.rate_square_peak = self.rate_square_peak.max(truth.rate_body.length_squared());
        self.speed_square_peak = self.speed_square_peak.max(truth.velocity_world.length_squared());
        self.lowest_height = self.lowest_height.min(truth.position_world.z);
    }

    fn observe_command(&mut self, tick: &Tick) {
        let output = &tick.output;
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
        let (position, tilt, heading) = self.errors;
        let [position_settled, tilt_settled, heading_settled] = self.settled;
        let horizontal =
            (self.steepest.x * self.steepest.x + self.steepest.y * self.steepest.y).sqrt();
        let [thrust_lowest, thrust_highest] = self.thrust.map(f64::from);
        let columns: [Option<f64>; MEASURES.len()] = [
            Some(self.position_peak),
            Some(rms(self.position_square_sum)),
            Some(position),
            position_settled,
            Some(tilt.radians()),
            tilt_settled,
            Some(heading.radians()),
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

impl Observer for Measures {
    fn observe(&mut self, tick: &Tick) {
        self.ticks += 1;
        self.observe_errors(tick);
        self.observe_motion(tick);
        self.observe_command(tick);
        self.mass_estimate = f64::from(tick.estimates.inverse_mass).recip();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::guarantee::tracking::tilt_error;
    use sim::scenario::LoadedScenario;

    /// The flight itself.
    struct Ticks(Vec<Tick>);

    impl Observer for Ticks {
        fn observe(&mut self, tick: &Tick) {
            self.0.push(*tick);
        }
    }

    #[test]
    fn the_documented_measures_are_the_written_ones() {
        let document = include_str!("../../../docs/campaign.md");
        let row = |it: &Measure| format!("| `{}` | {} | {} |", it.key, it.unit, it.label);
        let missing: Vec<_> =
            MEASURES.iter().map(row).filter(|it| !document.contains(it)).collect();
        assert!(missing.is_empty(), "{missing:?}");
    }

    #[test]
    fn they_are_what_the_samples_say() {
        let changes = ["guarantees.tilt_error_max=1.5".to_owned()];
        let loaded = LoadedScenario::open("tilt-recovery", &changes).unwrap();
        let scenario = loaded.scenario();
        let mut both = (Measures::new(scenario), Ticks(Vec::new()));
        assert!(both.0.values().iter().all(Option::is_none), "nothing was flown");
        loaded.flight().unwrap().observe(12_000, &mut both);

        let (values, samples) = (both.0.values(), both.1.0);
        let of = |key: &str| values[MEASURES.iter().position(|it| it.key == key).unwrap()];
        let close = |key: &str, expected: f64| {
            let found = of(key).unwrap_or_else(|| panic!("{key}"));
            assert!((found - expected).abs() < 1e-6 * expected.abs().max(1e-3), "{key} {found}");
        };
        let most = |value: &dyn Fn(&Tick) -> f64| {
            samples.iter().map(value).fold(f64::NEG_INFINITY, f64::max)
        };
        let error =
            |it: &Tick| (it.truth.position_world - it.reference.position_world.as_dvec3()).length();
        let last = samples.last().unwrap();
        close("position_error_peak", most(&error));
        close("position_error_final", error(last));
        let squares: f64 = samples.iter().map(|it| error(it).powi(2)).sum();
        close("position_error_rms", (squares / samples.len() as f64).sqrt());
        close("height_lost", most(&|it| -it.truth.position_world.z));
        close("rate_peak", most(&|it| it.truth.rate_body.length()));
        close("speed_peak", most(&|it| it.truth.velocity_world.length()));
        close("tilt_peak", most(&|it| (it.truth.attitude * DVec3::Z).angle_between(DVec3::Z)));
        close("thrust_highest", most(&|it| it.output.wrench.thrust.into()));
        close("torque_peak", 0.05f32.into());
        close("tilt_error_final", tilt_error(last.truth.attitude, &last.reference));
        close("mass_error_final", f64::from(last.estimates.inverse_mass).recip() - 0.85);
        let saturated = |it: &&Tick| it.output.status.contains(StepStatus::TORQUE_SATURATED);
        close("torque_saturated", samples.iter().filter(saturated).count() as f64 * 1e-3);

        // Turned upright within the flight, and not back at its place.
        let outside =
            samples.iter().rposition(|it| tilt_error(it.truth.attitude, &it.reference) > 1.5);
        close("tilt_settled", samples[outside.unwrap() + 1].time);
        assert_eq!(of("position_settled"), None);
    }
}
