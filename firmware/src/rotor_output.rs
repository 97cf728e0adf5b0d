//! Rotor commands: from the thrust of each rotor to what its speed controller reads.
//!
//! [`RotorDriver`] is the place of a driver, one per rotor: whatever takes a throttle in [0, 1]. Every PWM channel is one,
//! by standard pulses, 1000 us stop, 2000 us full, repeated at [`PULSE_RATE`]:
//!
//! ```text
//! pulse = 1000 us + 1000 us u,   u = throttle(T / T_max) of the rotor's curve
//! ```
//!
//! The curve is the square unless it is told otherwise: speed follows the pulse, and thrust its square.

use ctrl_core::allocation::ThrustCurve;
use embedded_hal::pwm::SetDutyCycle;

/// Pulses a second (Hz): the most that standard pulses leave room for.
pub const PULSE_RATE: u32 = 400;
/// Pulse at which a rotor stands still (s).
pub const PULSE_STOP: f32 = 1.0e-3;
/// Pulse at full speed (s).
pub const PULSE_FULL: f32 = 2.0e-3;

/// Output to the speed controller of one rotor.
pub trait RotorDriver {
    /// Commands a throttle in [0, 1]; zero is standstill. It returns at once, and a failure shows in the
    /// speed controller's own timeout.
    fn set_throttle(&mut self, throttle: f32);
}

/// By standard pulses. A channel's error is not looked at: a timer's is [`core::convert::Infallible`].
impl<P: SetDutyCycle> RotorDriver for P {
    fn set_throttle(&mut self, throttle: f32) {
        let pulse = PULSE_STOP + (PULSE_FULL - PULSE_STOP) * throttle;
        let duty = duty(pulse, self.max_duty_cycle());
        let _ = self.set_duty_cycle(duty);
    }
}

/// The outputs of `N` rotors.
#[derive(Debug)]
pub struct RotorOutput<D, const N: usize> {
    drivers: [D; N],
    thrust_max: [f32; N],
    curve: ThrustCurve,
}

impl<D: RotorDriver, const N: usize> RotorOutput<D, N> {
    /// Takes the drivers, all stopped; `thrust_max` is each rotor's thrust at full throttle (N).
    pub fn new(drivers: [D; N], thrust_max: [f32; N]) -> Self {
        let mut output = Self { drivers, thrust_max, curve: ThrustCurve::SQUARE };
        output.stop();
        output
    }

    /// The same with another thrust curve for all rotors.
    #[must_use]
    pub fn with_curve(self, curve: ThrustCurve) -> Self {
        Self { curve, ..self }
    }

    /// Commands the thrust of each rotor (N); values outside `0..=thrust_max` are clipped, and
    /// one that is not a number stops its rotor.
    pub fn command(&mut self, thrust: &[f32; N]) {
        // wcet: at most 4 iterations
        for ((driver, thrust), max) in self.drivers.iter_mut().zip(thrust).zip(self.thrust_max) {
            driver.set_throttle(self.curve.throttle(thrust / max));
        }
    }

    /// Commands standstill.
    pub fn stop(&mut self) {
        self.command(&[0.0; N]);
    }

    /// The drivers, to read back what was commanded.
    pub fn channels(&self) -> &[D; N] {
        &self.drivers
    }
}

/// Counts of a timer with `max` counts a period that give a pulse (s).
fn duty(pulse: f32, max: u16) -> u16 {
    (pulse * PULSE_RATE as f32 * f32::from(max) + 0.5) as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::convert::Infallible;

    #[derive(Debug, Default, Clone, Copy)]
    struct Recorder(u16);

    impl embedded_hal::pwm::ErrorType for Recorder {
        type Error = Infallible;
    }

    impl SetDutyCycle for Recorder {
        fn max_duty_cycle(&self) -> u16 {
            25_000
        }
        fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
            self.0 = duty;
            Ok(())
        }
    }

    fn commanded(thrust: [f32; 4]) -> [u16; 4] {
        let mut output = RotorOutput::new([Recorder(7); 4], [4.0; 4]);
        output.command(&thrust);
        output.channels().map(|channel| channel.0)
    }

    #[test]
    fn starts_stopped() {
        let output = RotorOutput::new([Recorder(7); 4], [4.0; 4]);
        assert_eq!(output.channels().map(|channel| channel.0), [10_000; 4]);
    }

    #[test]
    fn pulse_follows_the_root_of_the_thrust() {
        // 2.5 ms are 25,000 counts; a quarter of the thrust needs half the speed.
        assert_eq!(commanded([0.0, 1.0, 2.25, 4.0]), [10_000, 15_000, 17_500, 20_000]);
    }

    #[test]
    fn hostile_thrusts_stop_or_saturate() {
        let hostile = [f32::NAN, -1.0, f32::INFINITY, f32::NEG_INFINITY];
        assert_eq!(commanded(hostile), [10_000, 10_000, 20_000, 10_000]);
    }

    #[test]
    fn a_driver_of_its_own_gets_the_throttle_of_the_curve() {
        struct Digital(f32);
        impl RotorDriver for Digital {
            fn set_throttle(&mut self, throttle: f32) {
                self.0 = throttle;
            }
        }
        let curve = ThrustCurve::new(0.5).unwrap();
        let mut output = RotorOutput::new([Digital(1.0)], [4.0]).with_curve(curve);
        output.command(&[1.5]);
        assert!((output.channels()[0].0 - 0.5).abs() < 1e-6);
        output.stop();
        assert_eq!(output.channels()[0].0, 0.0);
    }

    #[test]
    fn stop_takes_every_rotor_back() {
        let mut output = RotorOutput::new([Recorder(0); 4], [4.0; 4]);
        output.command(&[3.0; 4]);
        output.stop();
        assert_eq!(output.channels().map(|channel| channel.0), [10_000; 4]);
    }
}
