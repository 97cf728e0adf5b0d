//! The mixer before the rotors, as a flight controller has it: allocation, battery compensation, and the inverse
//! of the thrust curve that it assumes; and another allocation once it knows of a failed rotor.

use ctrl_core::allocation::{
    Allocation, Allocator, BatteryCompensation, RotorGeometry, ThrustCurve,
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
    /// Rotors that it will know to have failed, and when (s); the next one last.
    losses: Vec<(f64, usize)>,
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
        let allocator = Allocator::new(geometry)?;
        let losses = losses(config);
        let mut left = allocator.clone();
        losses.iter().rev().try_for_each(|(_, rotor)| left.lose(*rotor))?;
        Ok(Self {
            allocator,
            curve: config.thrust_curve().assumed()?,
            thrust_max,
            compensation: compensation.transpose()?,
            losses,
        })
    }

    /// The throttles at `time` (s) for `command`.
    pub fn throttles(
        &mut self,
        command: &Wrench,
        time: f64,
        battery: Option<&BatteryState>,
    ) -> Thrusts {
        let (Allocation { thrusts, .. }, supply) = self.allocation(command, time, battery);
        self.of_thrusts(&thrusts, supply)
    }

    /// The allocation at `time` (s) of `command`, and the supply that it reckons with.
    pub fn allocation(
        &mut self,
        command: &Wrench,
        time: f64,
        battery: Option<&BatteryState>,
    ) -> (Allocation, f32) {
        while let Some((_, rotor)) = self.losses.pop_if(|(from, _)| *from <= time) {
            let lost = self.allocator.lose(rotor);
            debug_assert!(lost.is_ok(), "all of them were lost once, in `new`");
        }
        let supply = match (&mut self.compensation, battery) {
            (Some(compensation), Some(battery)) => compensation.measure(battery.voltage as f32),
            _ => 1.0,
        };
        (self.allocator.allocate_at(command, supply), supply)
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

/// The failures that the mixer gets to know, the latest first.
fn losses(config: &RotorsConfig) -> Vec<(f64, usize)> {
    let known = config.failures.iter();
    let mut known: Vec<_> = known
        .filter_map(|failure| Some((failure.time + failure.reallocated_after?, failure.rotor)))
        .collect();
    known.sort_by(|a, b| b.0.total_cmp(&a.0));
    known
}
