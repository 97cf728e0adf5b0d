//! Comparison of a tick on the vehicle with the same law on the host, bit for bit.

use std::fmt;

use ctrl_core::controller::{
    AdaptiveController, Auxiliary, Estimates, LastingEstimates, StepOutput,
};
use glam::{Quat, Vec3};
use link::{Downlink, Telemetry};
use sim::quantity::table::{
    ATTITUDE_ERROR, AUXILIARY_ATTITUDE, AUXILIARY_RATE, GYROSCOPIC_RATIO_ESTIMATE,
    INERTIA_ESTIMATE, LASTING_ACCELERATION_ESTIMATE, STATUS, THRUST, TORQUE, TORQUE_DEMAND,
};

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
    /// The estimates of its integral action after the step.
    pub lasting: LastingEstimates,
}

/// The integral action's estimates of a tick that are among messages.
#[must_use]
pub fn lasting(received: &[Downlink], tick: u64) -> Option<LastingEstimates> {
    received.iter().find_map(|message| match message {
        Downlink::Lasting(lasting) if lasting.tick == tick => Some(lasting.estimates),
        _ => None,
    })
}

impl Step {
    /// The step that a vehicle tells of; without integral action it tells of no `lasting` estimates, which are then zero.
    #[must_use]
    pub fn told(telemetry: &Telemetry, lasting: Option<LastingEstimates>) -> Self {
        let Telemetry { wrench, torque_demand_body, status, .. } = *telemetry;
        Self {
            output: StepOutput { wrench, torque_demand_body, status },
            estimates: telemetry.estimates,
            attitude_error: telemetry.attitude_error,
            auxiliary: telemetry.auxiliary,
            lasting: lasting.unwrap_or_default(),
        }
    }

    /// The step of a law on the host, whose state is now `state`.
    pub fn made<C: AdaptiveController>(law: &C, output: StepOutput, state: &C::State) -> Self {
        Self {
            output,
            estimates: law.estimates(state),
            attitude_error: law.attitude_error(state),
            auxiliary: law.auxiliary(state),
            lasting: law.lasting(state),
        }
    }
}

impl Step {
    /// The compared quantities: name, and components in the order x, y, z, w. Every status is exact as
    /// `f32`; names are those of the table of quantities, except for the estimates that only a law has.
    fn quantities(&self) -> [(&'static str, Quat, usize); 14] {
        let Self { output, estimates, attitude_error, auxiliary, lasting } = self;
        let scalar = |name, x| (name, Quat::from_xyzw(x, 0.0, 0.0, 0.0), 1);
        let vector = |name, x: Vec3| (name, Quat::from_vec4(x.extend(0.0)), 3);
        [
            scalar(THRUST.name, output.wrench.thrust),
            vector(TORQUE.name, output.wrench.torque_body),
            vector(TORQUE_DEMAND.name, output.torque_demand_body),
            scalar(STATUS.name, f32::from(output.status.bits())),
            scalar("inverse_mass_estimate", estimates.inverse_mass),
            vector(INERTIA_ESTIMATE.name, estimates.inertia),
            vector("inverse_inertia_estimate", estimates.inverse_inertia),
            vector(GYROSCOPIC_RATIO_ESTIMATE.name, estimates.gyroscopic_ratio),
            (ATTITUDE_ERROR.name, *attitude_error, 4),
            (AUXILIARY_ATTITUDE.name, auxiliary.attitude, 4),
            vector(AUXILIARY_RATE.name, auxiliary.rate),
            vector(LASTING_ACCELERATION_ESTIMATE.name, lasting.acceleration_world),
            vector("lasting_torque_estimate", lasting.torque_body),
            vector("lasting_angular_acceleration_estimate", lasting.angular_acceleration_body),
        ]
    }

    /// The compared numbers: name of the quantity, ending of the component, and its value.
    fn numbers(&self) -> impl Iterator<Item = (&'static str, &'static str, f32)> {
        self.quantities().into_iter().flat_map(|(name, components, width)| {
            let endings = if width == 1 { &[""][..] } else { &["_x", "_y", "_z", "_w"][..width] };
            endings.iter().zip(components.to_array()).map(move |(ending, x)| (name, *ending, x))
        })
    }
}

/// The first number whose bits differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Control ticks since the start.
    pub tick: u64,
    /// Name of the quantity, as in `docs/trace.md` where it has it.
    pub quantity: &'static str,
    /// Ending of the component's name; empty if there is one component alone.
    pub component: &'static str,
    /// On the vehicle.
    pub vehicle: f32,
    /// On the host.
    pub host: f32,
}

impl fmt::Display for Difference {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tick, quantity, component, vehicle, host } = self;
        let bits = [vehicle, host].map(|number| number.to_bits());
        write!(
            out,
            "tick {tick}, {quantity}{component}: {vehicle:?} ({:08x}) on the vehicle, ",
            bits[0]
        )?;
        write!(out, "{host:?} ({:08x}) in SIL", bits[1])
    }
}

/// The first difference at `tick`, if there is one.
#[must_use]
pub fn first_difference(tick: u64, vehicle: &Step, host: &Step) -> Option<Difference> {
    let mut pairs = vehicle.numbers().zip(host.numbers());
    pairs.find(|((.., vehicle), (.., host))| vehicle.to_bits() != host.to_bits()).map(
        |((quantity, component, vehicle), (.., host))| Difference {
            tick,
            quantity,
            component,
            vehicle,
            host,
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use ctrl_core::controller::StepStatus;
    use ctrl_core::mode::SAFE;

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
            lasting: LastingEstimates::default(),
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
        assert_eq!((found.tick, found.quantity, found.component), (7, "torque_demand", "_y"));
        let mut other = step();
        other.lasting.angular_acceleration_body.z = f32::from_bits(1);
        let found = first_difference(8, &step(), &other).unwrap();
        assert_eq!(
            (found.quantity, found.component),
            ("lasting_angular_acceleration_estimate", "_z")
        );
        assert_eq!(
            found.to_string(),
            "tick 8, lasting_angular_acceleration_estimate_z: 0.0 (00000000) on the vehicle, 1e-45 (00000001) in SIL"
        );
    }
}
