//! From the thrust of a rotor to its throttle: thrust curve and supply voltage.

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Bound, ConfigError, require};
use crate::sqrt::sqrt;

/// Throttle in [0, 1] for a thrust of `thrust` out of `thrust_max` (N), for a rotor whose thrust
/// grows with the square of its throttle.
///
/// ```
/// assert_eq!(ctrl_core::allocation::throttle(1.0, 4.0), 0.5);
/// ```
#[must_use]
pub fn throttle(thrust: f32, thrust_max: f32) -> f32 {
    let share = thrust / thrust_max;
    if share > 0.0 { sqrt(share.min(1.0)) } else { 0.0 }
}

/// Thrust of a rotor over its throttle `u` in [0, 1]:
///
/// ```text
/// T/T_max = (1 - q) u + q u^2,   u = 2 s / ((1 - q) + sqrt((1 - q)^2 + 4 q s)),  s = T/T_max
/// ```
///
/// `q = 1` is a rotor whose speed follows the throttle, `q = 0` one whose thrust does.
///
/// ```
/// use ctrl_core::allocation::ThrustCurve;
///
/// let curve = ThrustCurve::new(0.5)?;
/// assert_eq!(curve.share(0.5), 0.375);
/// assert!((curve.throttle(0.375) - 0.5).abs() < 1e-6);
/// # Ok::<(), ctrl_core::error::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThrustCurve {
    quadratic: f32,
}

impl ThrustCurve {
    /// The square: speed follows the throttle.
    pub const SQUARE: Self = Self { quadratic: 1.0 };

    /// A curve whose quadratic part is `quadratic` (-).
    ///
    /// # Errors
    /// When it is outside [0, 1].
    pub fn new(quadratic: f32) -> Result<Self, ConfigError> {
        let range = Bound::Inside(0.0, 1.0);
        require("thrust_curve.quadratic", quadratic, range, "part of u^2 in the thrust")?;
        Ok(Self { quadratic })
    }

    /// The throttle in [0, 1] for a share of the largest thrust; a share that is not a number gives 0.
    #[must_use]
    pub fn throttle(&self, share: f32) -> f32 {
        if share >= 1.0 {
            return 1.0;
        }
        if share > 0.0 {
            let linear = 1.0 - self.quadratic;
            let root = sqrt(linear * linear + 4.0 * self.quadratic * share);
            (2.0 * share / (linear + root)).min(1.0)
        } else {
            0.0
        }
    }

    /// The share of the largest thrust at a throttle, clipped to [0, 1].
    #[must_use]
    pub fn share(&self, throttle: f32) -> f32 {
        let u = if throttle > 0.0 { throttle.min(1.0) } else { 0.0 };
        u * (1.0 - self.quadratic + self.quadratic * u)
    }
}

/// Supply of the rotors.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct BatteryConfig {
    /// Voltage at which the rotors have the thrusts of their limits (V).
    pub nominal_voltage: f32,
    /// Time constant with which the measured voltage is smoothed (s).
    pub smoothing_time: f32,
}

/// Scale of the rotors' thrusts from the measured voltage, validated: the speed of a motor at a throttle grows
/// with the voltage, and thrust with its square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatteryCompensation {
    inverse_nominal: f32,
    /// Part of the way to the measurement that a step goes.
    gain: f32,
    /// Smoothed voltage over the nominal one.
    ratio: f32,
}

impl BatteryCompensation {
    /// At the nominal voltage, for measurements every `step_period` (s).
    ///
    /// # Errors
    /// Names a number that is out of its range.
    pub fn new(config: &BatteryConfig, step_period: f32) -> Result<Self, ConfigError> {
        let BatteryConfig { nominal_voltage, smoothing_time } = *config;
        let volts = Bound::Inside(1.0, 1000.0);
        require("battery.nominal_voltage", nominal_voltage, volts, "voltage of the limits, V")?;
        let times = Bound::Inside(step_period, 100.0);
        require("battery.smoothing_time", smoothing_time, times, "at least a step period, s")?;
        Ok(Self {
            inverse_nominal: 1.0 / nominal_voltage,
            gain: step_period / smoothing_time,
            ratio: 1.0,
        })
    }

    /// Takes a measured voltage (V); one that is not a number, negative, or above twice the nominal one is
    /// dropped. Returns the thrust over the nominal one, for [`allocate_at`](super::Allocator::allocate_at).
    pub fn measure(&mut self, voltage: f32) -> f32 {
        let ratio = voltage * self.inverse_nominal;
        if (0.0..=2.0).contains(&ratio) {
            self.ratio += self.gain * (ratio - self.ratio);
        }
        self.supply()
    }

    /// The thrust over the nominal one at the smoothed voltage.
    #[must_use]
    pub fn supply(&self) -> f32 {
        self.ratio * self.ratio
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn throttle_is_the_root_of_the_thrust_within_zero_and_one() {
        for (thrust, expected) in [(0.0, 0.0), (1.0, 0.5), (4.0, 1.0), (9.0, 1.0), (-1.0, 0.0)] {
            assert_eq!(throttle(thrust, 4.0), expected);
            assert_eq!(ThrustCurve::SQUARE.throttle(thrust / 4.0), expected);
        }
        assert_eq!(throttle(f32::NAN, 4.0), 0.0);
        assert_eq!(throttle(0.0, 0.0), 0.0);
    }

    #[test]
    fn a_curve_and_its_inverse_undo_each_other_and_hostile_shares_stay_inside() {
        for quadratic in [0.0, 1e-6, 0.3, 0.7, 1.0] {
            let curve = ThrustCurve::new(quadratic).unwrap();
            for i in 0..=1000 {
                let share = i as f32 * 1e-3;
                let back = curve.share(curve.throttle(share));
                assert!((back - share).abs() < 3e-7, "{quadratic}: {share} {back}");
            }
            for hostile in [f32::NAN, -1.0, f32::NEG_INFINITY] {
                assert_eq!((curve.throttle(hostile), curve.share(hostile)), (0.0, 0.0));
            }
            assert_eq!((curve.throttle(f32::INFINITY), curve.share(f32::INFINITY)), (1.0, 1.0));
        }
        for bad in [-0.1, 1.1, f32::NAN] {
            let error = ThrustCurve::new(bad).unwrap_err();
            assert_eq!(error.parameter, "thrust_curve.quadratic");
        }
    }

    const BATTERY: BatteryConfig = BatteryConfig { nominal_voltage: 14.8, smoothing_time: 0.5 };

    #[test]
    fn the_supply_follows_the_square_of_the_smoothed_voltage() {
        let mut battery = BatteryCompensation::new(&BATTERY, 0.01).unwrap();
        assert_eq!(battery.supply(), 1.0);
        for _ in 0..50 {
            battery.measure(13.32); // 0.9 of nominal
        }
        // After one time constant of an exponential in steps: 1 - 0.1 (1 - 0.98^50).
        let ratio = 1.0 - 0.1 * (1.0 - libm::powf(0.98, 50.0));
        assert!((battery.supply() - ratio * ratio).abs() < 1e-5);
        for _ in 0..2000 {
            battery.measure(13.32);
        }
        assert!((battery.supply() - 0.81).abs() < 1e-5);
        let before = battery;
        for bad in [f32::NAN, -1.0, f32::INFINITY, 100.0] {
            battery.measure(bad);
        }
        assert_eq!(battery, before);
    }

    #[test]
    fn a_battery_out_of_range_is_refused() {
        let refused = |config| BatteryCompensation::new(&config, 0.01).unwrap_err().parameter;
        let voltage = BatteryConfig { nominal_voltage: 0.0, ..BATTERY };
        assert_eq!(refused(voltage), "battery.nominal_voltage");
        let time = BatteryConfig { smoothing_time: 0.001, ..BATTERY };
        assert_eq!(refused(time), "battery.smoothing_time");
    }
}
