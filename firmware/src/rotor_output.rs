//! Rotor commands: from the thrust of each rotor to the duty cycle that its speed controller reads.
//!
//! Standard pulses: 1000 us stop, 2000 us full, repeated at [`PULSE_RATE`]. Thrust grows with the
//! square of the speed and the speed with the pulse, so the pulse follows the root of the thrust:
//!
//! ```text
//! pulse = 1000 us + 1000 us sqrt(T / T_max)
//! ```

use ctrl_core::allocation::throttle;
use embedded_hal::pwm::SetDutyCycle;

/// Pulses a second (Hz): the most that standard pulses leave room for.
pub const PULSE_RATE: u32 = 400;
/// Pulse at which a rotor stands still (s).
pub const PULSE_STOP: f32 = 1.0e-3;
/// Pulse at full speed (s).
pub const PULSE_FULL: f32 = 2.0e-3;

/// The outputs of `N` rotors.
#[derive(Debug)]
pub struct RotorOutput<P, const N: usize> {
    channels: [P; N],
    thrust_max: [f32; N],
}

impl<P: SetDutyCycle, const N: usize> RotorOutput<P, N> {
    /// Takes the channels, all stopped; `thrust_max` is each rotor's thrust at full speed (N).
    pub fn new(channels: [P; N], thrust_max: [f32; N]) -> Self {
        let mut output = Self { channels, thrust_max };
        output.stop();
        output
    }

    /// Commands the thrust of each rotor (N); values outside `0..=thrust_max` are clipped, and
    /// one that is not a number stops its rotor.
    ///
    /// A channel's error is not looked at: a timer's is [`core::convert::Infallible`].
    pub fn command(&mut self, thrust: &[f32; N]) {
        for ((channel, thrust), max) in self.channels.iter_mut().zip(thrust).zip(self.thrust_max) {
            let duty = duty(pulse(*thrust, max), channel.max_duty_cycle());
            let _ = channel.set_duty_cycle(duty);
        }
    }

    /// Commands standstill.
    pub fn stop(&mut self) {
        self.command(&[0.0; N]);
    }

    /// The channels, to read back what was commanded.
    pub fn channels(&self) -> &[P; N] {
        &self.channels
    }
}

/// Pulse length for a thrust (s).
fn pulse(thrust: f32, thrust_max: f32) -> f32 {
    PULSE_STOP + (PULSE_FULL - PULSE_STOP) * throttle(thrust, thrust_max)
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
    fn stop_takes_every_rotor_back() {
        let mut output = RotorOutput::new([Recorder(0); 4], [4.0; 4]);
        output.command(&[3.0; 4]);
        output.stop();
        assert_eq!(output.channels().map(|channel| channel.0), [10_000; 4]);
    }
}
