//! Battery that sags under its load and runs down.
//!
//! Rotors take the power `P = p sum T_i^(3/2)` (momentum theory: `p = 1/(eta sqrt(2 rho A))`). With the open
//! voltage `E = E_empty + s (E_full - E_empty)` at the charge `s`, and the resistance `R`,
//!
//! ```text
//! V = E - R I,  I = P/V   =>   V = (E + sqrt(E^2 - 4 R P))/2        s' = -I/Q
//! ```
//!
//! More than `E^2/(4 R)` it cannot give: `V` is `E/2` then. The thrust of a rotor at a throttle grows with `V^2`.

use ctrl_core::allocation::BatteryConfig;
use serde::{Deserialize, Serialize};

/// A battery, and the mixer's compensation of its voltage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BatteryModel {
    /// Open voltage when it is full (V).
    pub full_voltage: f64,
    /// Open voltage when it is empty (V).
    pub empty_voltage: f64,
    /// Voltage at which the rotors have the thrusts of their limits (V).
    pub nominal_voltage: f64,
    /// Resistance, cables included (ohm).
    pub resistance: f64,
    /// Capacity (A h).
    pub capacity: f64,
    /// Charge at the start, part of the capacity; full where it is absent (-).
    pub charge: Option<f64>,
    /// `p`: electric power for each root of a cubed newton of a rotor (W/N^1.5).
    pub power_factor: f64,
    /// Time constant with which the mixer smooths the measured voltage to compensate it; where it is absent,
    /// the mixer takes the voltage for the nominal one (s).
    pub compensation_time: Option<f64>,
}

/// State of the battery at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatteryState {
    /// Voltage at the terminals (V).
    pub voltage: f64,
    /// Current (A).
    pub current: f64,
    /// Rest of its charge, part of the capacity (-).
    pub charge: f64,
}

impl BatteryModel {
    /// The mixer's compensation, if it has one.
    #[must_use]
    pub fn compensation(&self) -> Option<BatteryConfig> {
        let smoothing_time = self.compensation_time? as f32;
        Some(BatteryConfig { nominal_voltage: self.nominal_voltage as f32, smoothing_time })
    }

    /// At the charge of the start, without load.
    #[must_use]
    pub fn at_start(&self) -> BatteryState {
        self.loaded(self.charge.unwrap_or(1.0), 0.0)
    }

    /// The state at `charge` while it gives `power` (W).
    #[must_use]
    pub fn loaded(&self, charge: f64, power: f64) -> BatteryState {
        let open = self.empty_voltage + charge * (self.full_voltage - self.empty_voltage);
        let square = (open * open - 4.0 * self.resistance * power).max(0.0);
        let voltage = 0.5 * (open + square.sqrt());
        // What it cannot give is not taken: the current follows from the voltage.
        let current = if square > 0.0 { power / voltage } else { 0.5 * open / self.resistance };
        BatteryState { voltage, current, charge }
    }

    /// Electric power of rotors that give `thrusts` (N).
    #[must_use]
    pub fn power(&self, thrusts: &[f64]) -> f64 {
        let cubed =
            thrusts.iter().map(|thrust| thrust.max(0.0)).map(|thrust| thrust * thrust.sqrt());
        self.power_factor * cubed.sum::<f64>()
    }

    /// The state `dt` (s) later, while it gives `power` (W).
    #[must_use]
    pub fn after(&self, state: &BatteryState, power: f64, dt: f64) -> BatteryState {
        let charge = state.charge - state.current * dt / (3600.0 * self.capacity);
        self.loaded(charge.max(0.0), power)
    }

    /// Thrust at a throttle over that at the nominal voltage.
    #[must_use]
    pub fn supply(&self, state: &BatteryState) -> f64 {
        let ratio = state.voltage / self.nominal_voltage;
        ratio * ratio
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CELLS: BatteryModel = BatteryModel {
        full_voltage: 16.8,
        empty_voltage: 13.2,
        nominal_voltage: 14.8,
        resistance: 0.05,
        capacity: 1.5,
        charge: None,
        power_factor: 12.0,
        compensation_time: None,
    };

    #[test]
    fn voltage_and_current_are_those_of_the_circuit() {
        for (charge, power) in [(1.0, 0.0), (1.0, 150.0), (0.3, 400.0), (0.0, 800.0)] {
            let BatteryState { voltage, current, .. } = CELLS.loaded(charge, power);
            let open = 13.2 + 3.6 * charge;
            assert!((voltage - (open - 0.05 * current)).abs() < 1e-12);
            assert!((voltage * current - power).abs() < 1e-9);
        }
        // 13.2^2/(4 * 0.05) = 871 W are the most.
        let most = CELLS.loaded(0.0, 2000.0);
        assert!((most.voltage - 6.6).abs() < 1e-12 && (most.current - 132.0).abs() < 1e-9);
        assert!((most.voltage * most.current - 871.2).abs() < 1e-9);
    }

    #[test]
    fn under_constant_power_the_square_of_the_open_voltage_falls_evenly() {
        // Without resistance E E' = -(E_full - E_empty) P/Q.
        let cells = BatteryModel { resistance: 0.0, ..CELLS };
        let (power, dt) = (150.0, 0.01);
        let mut state = cells.loaded(1.0, power);
        for _ in 0..40_000 {
            state = cells.after(&state, power, dt);
        }
        let expected = (16.8f64 * 16.8 - 2.0 * 3.6 * power * 400.0 / (3600.0 * 1.5)).sqrt();
        assert!((state.voltage - expected).abs() < 1e-5, "{state:?} {expected}");
        let charge = (expected - 13.2) / 3.6;
        assert!((state.charge - charge).abs() < 1e-5);
    }

    #[test]
    fn an_empty_battery_stays_at_its_empty_voltage_and_thrust_goes_with_the_square() {
        let state = CELLS.after(&CELLS.loaded(1e-9, 500.0), 0.0, 1.0);
        assert_eq!((state.charge, state.voltage), (0.0, 13.2));
        let low = BatteryState { voltage: 0.9 * 14.8, current: 0.0, charge: 0.5 };
        assert!((CELLS.supply(&low) - 0.81).abs() < 1e-12);
        assert!((CELLS.power(&[4.0, 1.0, 0.0, -1.0]) - 12.0 * 9.0).abs() < 1e-12);
    }
}
