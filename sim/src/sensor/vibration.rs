//! Vibration of the frame at the speed of its rotors.
//!
//! Each rotor has an imbalance: a force that turns with it in its plane, and a rate about the axes of that plane.
//! Its blades push twice a turn along the body's z axis. Speeds follow the root of the thrust, forces the square
//! of the speeds.

use core::f64::consts::TAU;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::random::Normal;
use ctrl_core::vehicle::GRAVITY;

/// Largest number of rotors.
const ROTORS: usize = 8;

/// Parameters of the vibration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VibrationParameters {
    /// Number of rotors, 1 to 8.
    pub rotors: u32,
    /// Turns of a rotor at hover (Hz).
    pub frequency: f64,
    /// Difference between the fastest and the slowest rotor, part of the speed.
    pub spread: f64,
    /// Amplitude of each rotor's force, at hover: along two axes at its speed, along z at twice it (m/s^2).
    pub acceleration: f64,
    /// Amplitude of each rotor's rate about x and y, at hover (deg/s).
    pub rate: f64,
}

/// A vibration in progress.
#[derive(Clone, Debug)]
pub struct Vibration {
    parameters: VibrationParameters,
    /// Angle of each rotor (turns).
    angles: [f64; ROTORS],
}

impl Vibration {
    /// With rotors at random angles.
    #[must_use]
    pub fn new(parameters: &VibrationParameters, mut normal: Normal) -> Self {
        Self { parameters: *parameters, angles: std::array::from_fn(|_| normal.uniform()) }
    }

    /// Rate (rad/s) and specific force (m/s^2) at the end of a step of `period` (s), for a thrust of
    /// `specific_thrust` per mass (m/s^2).
    pub fn advance(&mut self, period: f64, specific_thrust: f64) -> (DVec3, DVec3) {
        let p = &self.parameters;
        let square = (specific_thrust / f64::from(GRAVITY)).max(0.0);
        let (mut rate, mut force) = (DVec3::ZERO, DVec3::ZERO);
        let rotors = (p.rotors as usize).clamp(1, ROTORS);
        for (k, angle) in self.angles.iter_mut().take(rotors).enumerate() {
            let place = if rotors > 1 { k as f64 / (rotors - 1) as f64 - 0.5 } else { 0.0 };
            let frequency = p.frequency * square.sqrt() * (1.0 + p.spread * place);
            *angle = (*angle + frequency * period).fract();
            let (sine, cosine) = (libm::sin(TAU * *angle), libm::cos(TAU * *angle));
            // Neighbours turn in opposite directions.
            let side = if k % 2 == 0 { 1.0 } else { -1.0 };
            force += square * p.acceleration * DVec3::new(cosine, side * sine, 2.0 * sine * cosine);
            rate += square * p.rate.to_radians() * DVec3::new(side * sine, cosine, 0.0);
        }
        (rate, force)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUIET: VibrationParameters = VibrationParameters {
        rotors: 1,
        frequency: 110.0,
        spread: 0.0,
        acceleration: 3.0,
        rate: 10.0,
    };

    /// Amplitude of the force's component at `frequency`, at a thrust.
    fn amplitude(component: usize, frequency: f64, thrust: f64) -> f64 {
        let mut vibration = Vibration::new(&QUIET, Normal::new(1, 60));
        let (mut re, mut im, n) = (0.0, 0.0, 10_000);
        for k in 1..=n {
            let (_, force) = vibration.advance(1e-4, thrust);
            let angle = TAU * frequency * 1e-4 * f64::from(k);
            re += force[component] * libm::cos(angle) * 2.0 / f64::from(n);
            im += force[component] * libm::sin(angle) * 2.0 / f64::from(n);
        }
        re.hypot(im)
    }

    #[test]
    fn the_spectrum_has_its_lines_at_the_rotors_speed_and_at_twice_it() {
        let g = f64::from(GRAVITY);
        assert!((amplitude(0, 110.0, g) - 3.0).abs() < 1e-6);
        assert!((amplitude(1, 110.0, g) - 3.0).abs() < 1e-6);
        assert!((amplitude(2, 220.0, g) - 3.0).abs() < 1e-6);
        assert!(amplitude(0, 220.0, g) < 1e-6 && amplitude(2, 110.0, g) < 1e-6);
        // Four times the thrust: twice the speed, four times the force.
        assert!((amplitude(0, 220.0, 4.0 * g) - 12.0).abs() < 1e-6);
        assert!(amplitude(0, 110.0, 4.0 * g) < 1e-6);
    }

    #[test]
    fn rotors_apart_in_speed_beat() {
        let four = VibrationParameters { rotors: 4, spread: 0.05, ..QUIET };
        let mut vibration = Vibration::new(&four, Normal::new(1, 60));
        let forces: Vec<_> =
            (0..60_000).map(|_| vibration.advance(1e-4, f64::from(GRAVITY)).1.x).collect();
        let square = forces.iter().map(|x| x * x).sum::<f64>() / forces.len() as f64;
        // Four lines 1.83 Hz apart, over 11 beats: their powers add.
        assert!((square / (4.0 * 4.5) - 1.0).abs() < 0.01, "{square}");
    }
}
