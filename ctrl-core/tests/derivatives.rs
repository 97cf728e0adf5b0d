//! The exact derivatives `w_d'` and `mu'` against central differences along a closed-loop flight.
//!
//! The laws differentiate with the model's `v'` and `v''`. Here the plant is that model (known mass, no
//! disturbance, no adaptation, constant smoothing width), so the flight's own derivatives are exact.

use ctrl_core::config::{CascadeGains, IntegralAction, RobustAdaptiveConfig, SaturatedConfig};
use ctrl_core::controller::{AdaptiveController, ControllerConfig, Intermediates};
use ctrl_core::reference::Reference;
use ctrl_core::trajectory::{CircleConfig, Heading, Trajectory, TrajectoryConfig};
use ctrl_core::vehicle::{GRAVITY, InitialEstimate, Interval, Uncertainty, VehicleState};
use glam::{DQuat, DVec3, Vec3};

const STEP: f64 = 0.005;
const MASS: f64 = 0.8;
const INERTIA: DVec3 = DVec3::new(0.05, 0.06, 0.09);

/// Position, velocity, attitude and body rate in 64 bits, or their rates.
#[derive(Clone, Copy)]
struct Motion(DVec3, DVec3, DQuat, DVec3);

impl Motion {
    fn plus(self, h: f64, rate: Self) -> Self {
        Self(self.0 + h * rate.0, self.1 + h * rate.1, self.2 + rate.2 * h, self.3 + h * rate.3)
    }

    fn vehicle(&self) -> VehicleState {
        VehicleState {
            position_world: self.0.as_vec3(),
            velocity_world: self.1.as_vec3(),
            attitude: self.2.as_quat(),
            rate_body: self.3.as_vec3(),
        }
    }
}

fn uncertainty() -> Uncertainty {
    Uncertainty {
        mass: Interval { lower: 0.7, upper: 1.0 },
        inertia: Interval { lower: 0.03, upper: 0.12 },
        disturbance_acceleration: 0.05,
        disturbance_torque: 0.05,
    }
}

fn configurations() -> [ControllerConfig; 2] {
    let cascade = CascadeGains {
        k1: 0.8,
        k2: 0.9,
        k3: 3.0,
        c: 0.1,
        m1: 2.0,
        m2: 2.0,
        gamma1: 0.0,
        delta_1: 0.0,
        delta_min_translation: 0.5,
        delta_min_rotation: 0.5,
    };
    let (step_period, reference_acceleration_max) = (1e-3, 1.5);
    let (uncertainty, initial) =
        (uncertainty(), InitialEstimate { mass: MASS as f32, inertia: INERTIA.as_vec3() });
    [
        ControllerConfig::RobustAdaptive(RobustAdaptiveConfig {
            step_period,
            reference_acceleration_max,
            uncertainty,
            initial,
            cascade,
            k4: 0.5,
            gamma2: 0.0,
            integral: IntegralAction::OFF,
        }),
        ControllerConfig::Saturated(SaturatedConfig {
            step_period,
            reference_acceleration_max,
            uncertainty,
            initial,
            cascade,
            thrust_max: 40.0,
            torque_max: 100.0,
            k4: 6.0,
            k5: 1.0,
            gamma2: 0.0,
            gamma3: 0.0,
            integral: IntegralAction::OFF,
        }),
    ]
}

/// The law at `motion`; its memory does not move while nothing adapts or saturates.
fn law(
    controller: &impl AdaptiveController,
    reference: &Reference,
    motion: &Motion,
) -> Intermediates {
    let mut seen = None;
    let mut state = controller.initial_state();
    controller.step_observed(&mut state, &motion.vehicle(), reference, |i| seen = Some(*i));
    seen.expect("a step that is not held")
}

/// The rate of `motion` under the law (`q' = 1/2 q ⊗ [0, w]`, Euler's equation).
fn rate(controller: &impl AdaptiveController, reference: &Reference, motion: &Motion) -> Motion {
    let seen = law(controller, reference, motion);
    let Motion(_, velocity, q, w) = *motion;
    let axis = q.normalize() * DVec3::Z;
    let push = f64::from(seen.thrust) / MASS * axis;
    let spin = q * DQuat::from_xyzw(0.5 * w.x, 0.5 * w.y, 0.5 * w.z, 0.0);
    let torque = seen.torque_body.as_dvec3();
    let acceleration = push - f64::from(GRAVITY) * DVec3::Z;
    Motion(velocity, acceleration, spin, (torque - w.cross(INERTIA * w)) / INERTIA)
}

/// One Runge-Kutta step of length `h` from the reference at `tick`, two ticks long.
fn advance(
    controller: &impl AdaptiveController,
    trajectory: &impl Trajectory,
    tick: u64,
    motion: Motion,
) -> Motion {
    let [start, middle, end] = [0, 1, 2].map(|i| trajectory.reference(tick + i));
    let k1 = rate(controller, &start, &motion);
    let k2 = rate(controller, &middle, &motion.plus(0.5 * STEP, k1));
    let k3 = rate(controller, &middle, &motion.plus(0.5 * STEP, k2));
    let k4 = rate(controller, &end, &motion.plus(STEP, k3));
    let Motion(p, v, q, w) =
        motion.plus(STEP / 6.0, k1).plus(STEP / 3.0, k2).plus(STEP / 3.0, k3).plus(STEP / 6.0, k4);
    Motion(p, v, q.normalize(), w)
}

fn assert_derivative(name: &str, values: [Vec3; 3], rate: Vec3, tick: u64) {
    let difference = (values[2] - values[0]).as_dvec3() / (2.0 * STEP);
    let error = (difference - rate.as_dvec3()).length();
    let allowed = 0.02 * (0.5 + difference.length());
    assert!(error <= allowed, "{name} at tick {tick}: {rate}, by differences {difference}");
}

#[test]
fn virtual_and_desired_rates_are_differentiated_exactly() {
    let circle = CircleConfig {
        centre_world: Vec3::new(0.0, 0.0, 3.0),
        radius: 2.0,
        angular_rate: 0.7,
        heading: Heading::Tangent,
    };
    let trajectory = TrajectoryConfig::Circle(circle).build(0.5 * STEP as f32).unwrap();
    for config in configurations() {
        let controller = config.build().unwrap();
        let tilt = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.9);
        let start = DVec3::new(2.5, -0.4, 2.6);
        let mut motion = Motion(start, DVec3::new(0.2, 0.5, 0.1), tilt, DVec3::new(0.3, -0.2, 0.4));
        let mut window = Vec::new();
        for i in 0..600 {
            let seen = law(&controller, &trajectory.reference(2 * i), &motion);
            window.push(seen);
            motion = advance(&controller, &trajectory, 2 * i, motion);
            if let [before, at, after] = window[..] {
                let rates = [before, at, after].map(|seen| seen.desired_rate);
                assert_derivative("w_d", rates, at.desired_rate_dot, 2 * i);
                assert_derivative("mu", [before.mu, at.mu, after.mu], at.mu_dot, 2 * i);
                window.remove(0);
            }
        }
    }
}
