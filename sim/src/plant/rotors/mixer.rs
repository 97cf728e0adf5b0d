//! The mixer before the rotors, as a flight controller has it: allocation, battery compensation, and the inverse
//! of the thrust curve that it assumes; and another allocation once it knows of a failed rotor.

use ctrl_core::allocation::{
    Allocation, Allocator, BatteryCompensation, RotorGeometry, RotorSet, ThrustCurve,
};
use ctrl_core::error::ConfigError;
use ctrl_core::vehicle::Wrench;

use super::battery::BatteryState;
use super::{RotorsConfig, Thrusts};

/// From a wrench to throttles.
#[derive(Clone, Debug)]
pub(super) struct Mixer {
    allocator: Allocator,
    curve: ThrustCurve,
    thrust_max: [f32; Thrusts::MAX],
    compensation: Option<BatteryCompensation>,
    /// Allocations to come and their times (s), in order; the next one last.
    plans: Vec<(f64, Allocator)>,
}

impl Mixer {
    /// The mixer of `config` at control ticks of `step_period` (s).
    ///
    /// # Errors
    /// Names what the allocation, the curve or the compensation refuses; also for the rotors that failures leave.
    pub fn new(
        config: &RotorsConfig,
        geometry: &RotorGeometry,
        step_period: f64,
    ) -> Result<Self, ConfigError> {
        let mut thrust_max = [1.0; Thrusts::MAX];
        for (max, rotor) in thrust_max.iter_mut().zip(&geometry.rotors) {
            *max = rotor.thrust.upper;
        }
        let compensation = config.battery.and_then(|battery| battery.compensation());
        let compensation =
            compensation.map(|battery| BatteryCompensation::new(&battery, step_period as f32));
        Ok(Self {
            allocator: Allocator::new(geometry)?,
            curve: config.thrust_curve().assumed()?,
            thrust_max,
            compensation: compensation.transpose()?,
            plans: plans(config, geometry)?,
        })
    }

    /// The throttles at `time` (s) for `command`.
    pub fn throttles(
        &mut self,
        command: &Wrench,
        time: f64,
        battery: Option<&BatteryState>,
    ) -> Thrusts {
        while let Some((_, allocator)) = self.plans.pop_if(|(from, _)| *from <= time) {
            self.allocator = allocator;
        }
        let supply = match (&mut self.compensation, battery) {
            (Some(compensation), Some(battery)) => compensation.measure(battery.voltage as f32),
            _ => 1.0,
        };
        let Allocation { thrusts, .. } = self.allocator.allocate_at(command, supply);
        self.of_thrusts(&thrusts, supply)
    }

    /// The throttles for `thrusts` (N) at `supply`, the thrust over that at the nominal voltage.
    pub fn of_thrusts(&self, thrusts: &[f32], supply: f32) -> Thrusts {
        let mut throttles = [0.0; Thrusts::MAX];
        for ((throttle, thrust), max) in throttles.iter_mut().zip(thrusts).zip(self.thrust_max) {
            *throttle = self.curve.throttle(thrust / (max * supply)).into();
        }
        Thrusts(throttles)
    }
}

/// Allocations without the rotors that have failed by then, the latest first.
fn plans(
    config: &RotorsConfig,
    geometry: &RotorGeometry,
) -> Result<Vec<(f64, Allocator)>, ConfigError> {
    let known = config.failures.iter();
    let mut known: Vec<_> = known
        .filter_map(|failure| Some((failure.time + failure.reallocated_after?, failure.rotor)))
        .collect();
    known.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut failed = RotorSet::empty();
    let mut plans = Vec::new();
    for (time, rotor) in known {
        failed |= RotorSet::rotor(rotor);
        plans.push((time, Allocator::without(geometry, failed)?));
    }
    plans.reverse();
    Ok(plans)
}
