//! Drag of the rotors: a rotor that moves through air in its own plane is held back in proportion to its speed
//! of rotation, which is as the root of its thrust.
//!
//! ```text
//! v_i = R^T (v - wind) + w × r_i        F_i = -c sqrt(T_i) P v_i,   P = diag(1, 1, 0)
//! d1 += R sum F_i / m                   d2 += sum r_i × F_i
//! ```
//!
//! As every disturbance it is held over a tick of `dt`. What is held is the mean over it for a held attitude and
//! still air's decay: with `k = c sum sqrt(T_i)/m`, `(1 - e^(-k dt))/(k dt)` of what acts at its start.

use glam::DVec3;

use super::Thrusts;
use crate::plant::{Disturbance, PlantState};

/// Coefficient and places of the rotors.
#[derive(Clone, Copy, Debug)]
pub(super) struct RotorDrag {
    /// `c` (kg/s per root newton).
    coefficient: f64,
    inverse_mass: f64,
    step_period: f64,
    positions_body: [DVec3; Thrusts::MAX],
}

impl RotorDrag {
    pub fn new(
        coefficient: f64,
        mass: f64,
        step_period: f64,
        positions_body: [DVec3; Thrusts::MAX],
    ) -> Self {
        Self { coefficient, inverse_mass: 1.0 / mass, step_period, positions_body }
    }

    /// What rotors that give `thrusts` add to the disturbance of a tick that begins at `truth` in a `wind` (m/s).
    pub fn acting(&self, thrusts: &Thrusts, truth: &PlantState, wind_world: DVec3) -> Disturbance {
        let air = truth.attitude.conjugate() * (truth.velocity_world - wind_world);
        let (mut force, mut torque, mut sum) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for (thrust, place) in thrusts.0.into_iter().zip(self.positions_body) {
            let strength = self.coefficient * thrust.max(0.0).sqrt();
            let through = (air + truth.rate_body.cross(place)).with_z(0.0);
            let drag = -strength * through;
            force += drag;
            torque += place.cross(drag);
            sum += strength;
        }
        let decay = sum * self.inverse_mass * self.step_period;
        let held = if decay > 1e-12 { -(-decay).exp_m1() / decay } else { 1.0 };
        Disturbance {
            acceleration_world: truth.attitude * (held * self.inverse_mass * force),
            torque_body: held * torque,
            ..Disturbance::NONE
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    fn drag() -> RotorDrag {
        let mut places = [DVec3::ZERO; Thrusts::MAX];
        for (index, place) in places.iter_mut().take(4).enumerate() {
            let angle = std::f64::consts::FRAC_PI_4 + std::f64::consts::FRAC_PI_2 * index as f64;
            *place = 0.2 * DVec3::new(angle.cos(), angle.sin(), 0.0);
        }
        RotorDrag::new(0.04, 0.85, 1e-3, places)
    }

    const HOVER: Thrusts = Thrusts([2.25, 2.25, 2.25, 2.25, 0.0, 0.0, 0.0, 0.0]);

    fn state(attitude: DQuat, velocity_world: DVec3, rate_body: DVec3) -> PlantState {
        PlantState { position_world: DVec3::ZERO, velocity_world, attitude, rate_body }
    }

    #[test]
    fn it_acts_in_the_plane_of_the_rotors_against_the_air() {
        let tilted = DQuat::from_rotation_y(0.4);
        let along = |v| drag().acting(&HOVER, &state(tilted, v, DVec3::ZERO), DVec3::ZERO);
        // Along the rotors' axis there is none.
        assert!(along(tilted * DVec3::Z * 7.0).acceleration_world.length() < 1e-12);
        let k = 0.04 * 6.0 / 0.85;
        let mean = (1.0 - (-k * 1e-3f64).exp()) / (k * 1e-3);
        let pushed = along(tilted * DVec3::X * 3.0);
        assert!((pushed.acceleration_world + tilted * DVec3::X * 3.0 * k * mean).length() < 1e-12);
        assert!(pushed.torque_body.length() < 1e-12, "a balanced frame is not turned");
        let carried = DVec3::new(3.0, -2.0, 1.0);
        let with_the_air = drag().acting(&HOVER, &state(tilted, carried, DVec3::ZERO), carried);
        assert_eq!(with_the_air.acceleration_world, DVec3::ZERO);
    }

    #[test]
    fn it_brakes_yaw_by_the_arm_squared_and_a_dead_rotor_lets_the_drag_turn_the_body() {
        let turning = state(DQuat::IDENTITY, DVec3::ZERO, DVec3::Z * 2.0);
        let braked = drag().acting(&HOVER, &turning, DVec3::ZERO);
        let expected = -0.04 * 6.0 * 0.2 * 0.2 * 2.0;
        assert!((braked.torque_body.z / expected - 1.0).abs() < 1e-3, "{braked:?}");
        let mut three = HOVER;
        three.0[0] = 0.0; // front left
        let forward = state(DQuat::IDENTITY, DVec3::X, DVec3::ZERO);
        let turned = drag().acting(&three, &forward, DVec3::ZERO).torque_body.z;
        // The left side brakes with one rotor, the right with two: the nose goes right.
        let expected = -0.04 * 1.5 * 0.2 * std::f64::consts::FRAC_1_SQRT_2;
        assert!((turned / expected - 1.0).abs() < 1e-3, "{turned} {expected}");
    }

    #[test]
    fn no_thrust_no_drag() {
        let moving = state(DQuat::IDENTITY, DVec3::X * 9.0, DVec3::ONE);
        let none = drag().acting(&Thrusts([0.0; 8]), &moving, DVec3::ZERO);
        assert_eq!((none.acceleration_world, none.torque_body), (DVec3::ZERO, DVec3::ZERO));
    }
}
