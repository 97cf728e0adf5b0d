//! Comparison of a tick on the vehicle with the same law on the host, bit for bit.

use std::fmt;

use ctrl_core::controller::{Auxiliary, Estimates, StepOutput};
use glam::Quat;
use link::Telemetry;

/// Names of the compared numbers, as in `docs/trace.md` where it has them.
const FIELDS: [&str; 29] = [
    "thrust",
    "torque_x",
    "torque_y",
    "torque_z",
    "torque_demand_x",
    "torque_demand_y",
    "torque_demand_z",
    "status",
    "inverse_mass_estimate",
    "inertia_estimate_x",
    "inertia_estimate_y",
    "inertia_estimate_z",
    "inverse_inertia_estimate_x",
    "inverse_inertia_estimate_y",
    "inverse_inertia_estimate_z",
    "gyroscopic_ratio_estimate_x",
    "gyroscopic_ratio_estimate_y",
    "gyroscopic_ratio_estimate_z",
    "attitude_error_x",
    "attitude_error_y",
    "attitude_error_z",
    "attitude_error_w",
    "auxiliary_attitude_x",
    "auxiliary_attitude_y",
    "auxiliary_attitude_z",
    "auxiliary_attitude_w",
    "auxiliary_rate_x",
    "auxiliary_rate_y",
    "auxiliary_rate_z",
];

/// Output and state of a law after a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Its return value.
    pub output: StepOutput,
    /// Its estimates after the step.
    pub estimates: Estimates,
    /// `q_e` of the step.
    pub attitude_error: Quat,
    /// Its auxiliary system after the step.
    pub auxiliary: Auxiliary,
}

impl From<&Telemetry> for Step {
    fn from(telemetry: &Telemetry) -> Self {
        let Telemetry { wrench, torque_demand_body, status, .. } = *telemetry;
        Self {
            output: StepOutput { wrench, torque_demand_body, status },
            estimates: telemetry.estimates,
            attitude_error: telemetry.attitude_error,
            auxiliary: telemetry.auxiliary,
        }
    }
}

impl Step {
    /// The numbers in the order of [`FIELDS`]; every status is exact as `f32`.
    fn numbers(&self) -> [f32; FIELDS.len()] {
        let Self { output, estimates, attitude_error, auxiliary } = self;
        let parts: [&[f32]; 10] = [
            &[output.wrench.thrust],
            &output.wrench.torque_body.to_array(),
            &output.torque_demand_body.to_array(),
            &[f32::from(output.status.bits()), estimates.inverse_mass],
            &estimates.inertia.to_array(),
            &estimates.inverse_inertia.to_array(),
            &estimates.gyroscopic_ratio.to_array(),
            &attitude_error.to_array(),
            &auxiliary.attitude.to_array(),
            &auxiliary.rate.to_array(),
        ];
        let mut numbers = [0.0; FIELDS.len()];
        for (number, part) in numbers.iter_mut().zip(parts.into_iter().flatten()) {
            *number = *part;
        }
        numbers
    }
}

/// The first number whose bits differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Control ticks since the start.
    pub tick: u64,
    /// Name of the number.
    pub field: &'static str,
    /// On the vehicle.
    pub vehicle: f32,
    /// On the host.
    pub host: f32,
}

impl fmt::Display for Difference {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tick, field, vehicle, host } = self;
        let bits = [vehicle, host].map(|number| number.to_bits());
        write!(out, "tick {tick}, {field}: {vehicle:?} ({:08x}) on the vehicle, ", bits[0])?;
        write!(out, "{host:?} ({:08x}) in SIL", bits[1])
    }
}

/// The first difference at `tick`, if there is one.
#[must_use]
pub fn first_difference(tick: u64, vehicle: &Step, host: &Step) -> Option<Difference> {
    let pairs = vehicle.numbers().into_iter().zip(host.numbers());
    FIELDS
        .iter()
        .zip(pairs)
        .find(|(_, (vehicle, host))| vehicle.to_bits() != host.to_bits())
        .map(|(field, (vehicle, host))| Difference { tick, field, vehicle, host })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ctrl_core::controller::StepStatus;
    use ctrl_core::mode::SAFE;
    use glam::Vec3;

    fn step() -> Step {
        let output = StepOutput {
            wrench: SAFE,
            torque_demand_body: Vec3::ZERO,
            status: StepStatus::empty(),
        };
        Step {
            output,
            estimates: Estimates {
                inverse_mass: 1.0,
                inertia: Vec3::ONE,
                inverse_inertia: Vec3::ONE,
                gyroscopic_ratio: Vec3::ONE,
            },
            attitude_error: Quat::IDENTITY,
            auxiliary: Auxiliary { attitude: Quat::IDENTITY, rate: Vec3::ZERO },
        }
    }

    #[test]
    fn equal_steps_have_no_difference_not_even_in_a_nan() {
        let mut nan = step();
        nan.output.wrench.thrust = f32::NAN;
        assert_eq!(first_difference(0, &step(), &step()), None);
        assert!(first_difference(0, &nan, &nan).is_none());
    }

    #[test]
    fn a_sign_of_zero_and_the_last_field_are_seen() {
        let mut other = step();
        other.output.torque_demand_body.y = -0.0;
        let found = first_difference(7, &other, &step()).unwrap();
        assert_eq!((found.tick, found.field), (7, "torque_demand_y"));
        let mut other = step();
        other.auxiliary.rate.z = f32::from_bits(1);
        let found = first_difference(8, &step(), &other).unwrap();
        assert_eq!(found.field, "auxiliary_rate_z");
        assert_eq!(
            found.to_string(),
            "tick 8, auxiliary_rate_z: 0.0 (00000000) on the vehicle, 1e-45 (00000001) in SIL"
        );
    }
}
