//! The exact derivatives `w_d'` and `mu'` against central differences along a closed-loop flight.
//!
//! The laws differentiate with the model's `v'` and `v''`. Here the plant is that model (known mass, no
//! disturbance, no adaptation, constant smoothing width), so the flight's own derivatives are exact. With
//! integral action, the disturbance is its estimate, as in the model.

use ctrl_core::config::{
    CascadeGains, Checkpoint, IntegralAction, RobustAdaptiveConfig, SaturatedConfig,
};
use ctrl_core::controller::{AdaptiveController, Auxiliary, Intermediates, LastingEstimates};
use ctrl_core::reference::Reference;
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::rotors::RotorModel;
use ctrl_core::saturated::Saturated;
use ctrl_core::trajectory::{CircleConfig, Heading, Trajectory, TrajectoryConfig};
use ctrl_core::vehicle::{
    GRAVITY, InitialEstimate, Interval, Uncertainty, VectorInterval, VehicleState,
};
use glam::{DQuat, DVec3, Vec3};

const STEP: f64 = 0.005;
const MASS: f64 = 0.8;
const INERTIA: DVec3 = DVec3::new(0.05, 0.06, 0.09);

/// Position, velocity, attitude, body rate and `d_hat` in 64 bits, or their rates.
#[derive(Clone, Copy)]
struct Motion(DVec3, DVec3, DQuat, DVec3, DVec3);

impl Motion {
    fn plus(self, h: f64, rate: Self) -> Self {
        Self(
            self.0 + h * rate.0,
            self.1 + h * rate.1,
            self.2 + rate.2 * h,
            self.3 + h * rate.3,
            self.4 + h * rate.4,
        )
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
        inertia: VectorInterval {
            lower: Vec3::new(0.03, 0.025, 0.05),
            upper: Vec3::new(0.12, 0.1, 0.2),
        },
        disturbance_acceleration: 0.05,
        disturbance_torque: Vec3::new(0.05, 0.04, 0.01),
    }
}

/// A controller whose memory may start with any `d_hat`.
trait Resumed: AdaptiveController {
    fn resumed(&self, checkpoint: &Checkpoint) -> Self::State;

    /// Its memory at `elapsed` seconds, with `d_hat`.
    fn memory(&self, elapsed: f32, d_hat: DVec3) -> Self::State {
        self.resumed(&checkpoint(elapsed, d_hat))
    }
}

/// The true parameters as estimates, at `elapsed` seconds, with `d_hat`.
fn checkpoint(elapsed: f32, d_hat: DVec3) -> Checkpoint {
    Checkpoint {
        elapsed,
        inverse_mass: 1.0 / MASS as f32,
        inertia: INERTIA.as_vec3(),
        inverse_inertia: INERTIA.recip().as_vec3(),
        gyroscopic_ratio: Vec3::ZERO,
        auxiliary: Auxiliary::REST,
        lasting: LastingEstimates {
            acceleration_world: d_hat.as_vec3(),
            ..LastingEstimates::default()
        },
    }
}

impl Resumed for RobustAdaptive {
    fn resumed(&self, checkpoint: &Checkpoint) -> Self::State {
        self.resume(checkpoint).expect("a checkpoint that it accepts")
    }
}

impl Resumed for Saturated {
    fn resumed(&self, checkpoint: &Checkpoint) -> Self::State {
        self.resume(checkpoint).expect("a checkpoint that it accepts")
    }
}

/// Both controllers, unlike about each axis, without adaptation, with a smoothing width that decays at `delta_1` (1/s).
fn controllers(delta_1: f32, integral: IntegralAction) -> (RobustAdaptive, Saturated) {
    let cascade = CascadeGains {
        k1: 0.8,
        k2: 0.9,
        k3: Vec3::new(3.0, 2.4, 1.3),
        c: 0.1,
        m1: 2.0,
        m2: 2.0,
        gamma1: 0.0,
        delta_1,
        delta_min_translation: 0.5,
        delta_min_rotation: 0.5,
    };
    let (step_period, reference_acceleration_max) = (1e-3, 1.5);
    let (uncertainty, initial) =
        (uncertainty(), InitialEstimate { mass: MASS as f32, inertia: INERTIA.as_vec3() });
    let first = RobustAdaptive::new(&RobustAdaptiveConfig {
        step_period,
        reference_acceleration_max,
        uncertainty,
        initial,
        cascade,
        k4: Vec3::new(0.5, 0.4, 0.2),
        gamma2: Vec3::ZERO,
        integral,
        rotors: RotorModel::OFF,
    });
    let second = Saturated::new(&SaturatedConfig {
        step_period,
        reference_acceleration_max,
        uncertainty,
        initial,
        cascade,
        thrust_max: 40.0,
        torque_max: Vec3::new(100.0, 90.0, 40.0),
        k4: Vec3::new(6.0, 5.0, 3.0),
        k5: 1.0,
        gamma2: Vec3::ZERO,
        gamma3: 0.0,
        integral,
        rotors: RotorModel::OFF,
    });
    (first.expect("gains that it accepts"), second.expect("gains that it accepts"))
}

/// The law at `motion`; nothing else of its memory moves while nothing adapts or saturates.
fn law(controller: &impl Resumed, reference: &Reference, motion: &Motion) -> Intermediates {
    let mut seen = None;
    let mut state = controller.memory(0.0, motion.4);
    controller.step_observed(&mut state, &motion.vehicle(), reference, |i| seen = Some(*i));
    seen.expect("a step that is not held")
}

/// The rate of `motion` under the law (`q' = 1/2 q ⊗ [0, w]`, Euler's equation).
fn rate(controller: &impl Resumed, reference: &Reference, motion: &Motion) -> Motion {
    let seen = law(controller, reference, motion);
    let Motion(_, velocity, q, w, d_hat) = *motion;
    let axis = q.normalize() * DVec3::Z;
    let push = f64::from(seen.thrust) / MASS * axis;
    let spin = q * DQuat::from_xyzw(0.5 * w.x, 0.5 * w.y, 0.5 * w.z, 0.0);
    let torque = seen.torque_body.as_dvec3();
    let acceleration = push - f64::from(GRAVITY) * DVec3::Z + d_hat;
    let angular = (torque - w.cross(INERTIA * w)) / INERTIA;
    Motion(velocity, acceleration, spin, angular, seen.lasting_acceleration_rate.as_dvec3())
}

/// One Runge-Kutta step of length `h` from the reference at `tick`, two ticks long.
fn advance(
    controller: &impl Resumed,
    trajectory: &impl Trajectory,
    tick: u64,
    motion: Motion,
) -> Motion {
    let [start, middle, end] = [0, 1, 2].map(|i| trajectory.reference(tick + i));
    let k1 = rate(controller, &start, &motion);
    let k2 = rate(controller, &middle, &motion.plus(0.5 * STEP, k1));
    let k3 = rate(controller, &middle, &motion.plus(0.5 * STEP, k2));
    let k4 = rate(controller, &end, &motion.plus(STEP, k3));
    let Motion(p, v, q, w, d_hat) =
        motion.plus(STEP / 6.0, k1).plus(STEP / 3.0, k2).plus(STEP / 3.0, k3).plus(STEP / 6.0, k4);
    Motion(p, v, q.normalize(), w, d_hat)
}

fn assert_derivative(name: &str, values: [Vec3; 3], rate: Vec3, tick: u64) {
    let difference = (values[2] - values[0]).as_dvec3() / (2.0 * STEP);
    let error = (difference - rate.as_dvec3()).length();
    let allowed = 0.02 * (0.5 + difference.length());
    assert!(error <= allowed, "{name} at tick {tick}: {rate}, by differences {difference}");
}

/// Flies a tilted start and compares at every second tick.
fn assert_derivatives(controller: &impl Resumed) {
    let circle = CircleConfig {
        centre_world: Vec3::new(0.0, 0.0, 3.0),
        radius: 2.0,
        angular_rate: 0.7,
        heading: Heading::Tangent,
    };
    let trajectory = TrajectoryConfig::Circle(circle).build(0.5 * STEP as f32).unwrap();
    let tilt = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.9);
    let (start, velocity) = (DVec3::new(2.5, -0.4, 2.6), DVec3::new(0.2, 0.5, 0.1));
    let mut motion = Motion(start, velocity, tilt, DVec3::new(0.3, -0.2, 0.4), DVec3::ZERO);
    let mut window = Vec::new();
    for i in 0..600 {
        let seen = law(controller, &trajectory.reference(2 * i), &motion);
        window.push(seen);
        motion = advance(controller, &trajectory, 2 * i, motion);
        if let [before, at, after] = window[..] {
            let rates = [before, at, after].map(|seen| seen.desired_rate);
            assert_derivative("w_d", rates, at.desired_rate_dot, 2 * i);
            assert_derivative("mu", [before.mu, at.mu, after.mu], at.mu_dot, 2 * i);
            window.remove(0);
        }
    }
}

#[test]
fn virtual_and_desired_rates_are_differentiated_exactly() {
    let (first, second) = controllers(0.0, IntegralAction::OFF);
    assert_derivatives(&first);
    assert_derivatives(&second);
}

/// A large gain, so that what the estimate adds to the derivatives shows, inside a set that it never leaves.
#[test]
fn rates_are_differentiated_exactly_with_integral_action() {
    let integral = IntegralAction { acceleration_max: 8.0, gamma_d: 2.0, ..IntegralAction::OFF };
    let (first, second) = controllers(0.0, integral);
    assert_derivatives(&first);
    assert_derivatives(&second);
}

/// The smoothing width of a flight of `n` ticks is that of a memory resumed at `n dt` (17).
#[test]
fn the_smoothing_decays_tick_by_tick_as_in_closed_form() {
    fn assert_decay(controller: &impl Resumed) {
        let vehicle = VehicleState {
            rate_body: Vec3::new(0.2, -0.1, 0.1),
            ..VehicleState::at_rest(Vec3::new(0.3, -0.2, 5.2))
        };
        let reference = Reference::hover(Vec3::new(0.0, 0.0, 5.0));
        let mut state = controller.memory(0.0, DVec3::ZERO);
        let first = controller.step(&mut state, &vehicle, &reference).wrench;
        for _ in 1..2000 {
            controller.step(&mut state, &vehicle, &reference);
        }
        let flown = controller.step(&mut state, &vehicle, &reference).wrench.torque_body;
        let mut resumed = controller.memory(2.0, DVec3::ZERO);
        let expected = controller.step(&mut resumed, &vehicle, &reference).wrench.torque_body;
        let change = (expected - first.torque_body).length();
        assert!(change > 1e-3, "the width must show: {change}");
        assert!((flown - expected).length() < 1e-3 * change, "{flown} for {expected}");
    }
    let (first, second) = controllers(0.4, IntegralAction::OFF);
    assert_decay(&first);
    assert_decay(&second);
}

/// `t_hat` is taken off the torque of controller 1, `s_hat` off the bracket of (50), and both follow `w_e`.
#[test]
fn the_estimate_of_a_lasting_torque_is_taken_off() {
    let integral = IntegralAction { torque_max: 0.05, gamma_t: 0.4, ..IntegralAction::OFF };
    let (first, second) = controllers(0.0, integral);
    let estimate = Vec3::new(0.01, -0.02, 0.03);
    let vehicle = VehicleState {
        rate_body: Vec3::new(0.2, -0.1, 0.1),
        ..VehicleState::at_rest(Vec3::new(0.3, -0.2, 5.2))
    };
    let reference = Reference::hover(Vec3::new(0.0, 0.0, 5.0));
    let torque = |lasting: LastingEstimates, of: &dyn Fn(&Checkpoint) -> Intermediates| {
        of(&Checkpoint { lasting, ..checkpoint(0.0, DVec3::ZERO) })
    };
    fn at<C: Resumed>(
        controller: &C,
        vehicle: &VehicleState,
        reference: &Reference,
        checkpoint: &Checkpoint,
    ) -> Intermediates {
        let (mut state, mut seen) = (controller.resumed(checkpoint), None);
        controller.step_observed(&mut state, vehicle, reference, |i| seen = Some(*i));
        seen.expect("a step that is not held")
    }
    let none = LastingEstimates::default();
    let of_first = |it: &Checkpoint| at(&first, &vehicle, &reference, it);
    let with = torque(LastingEstimates { torque_body: estimate, ..none }, &of_first);
    let change = with.torque_body - torque(none, &of_first).torque_body;
    assert!((change + estimate).length() < 1e-6, "{change}");
    assert_eq!(with.lasting_torque_rate, 0.4 * with.rate_error);
    let of_second = |it: &Checkpoint| at(&second, &vehicle, &reference, it);
    let lasting = LastingEstimates { angular_acceleration_body: estimate, ..none };
    let with = torque(lasting, &of_second);
    let change = with.torque_demand_body - torque(none, &of_second).torque_demand_body;
    assert!((change + estimate * INERTIA.as_vec3()).length() < 1e-6, "{change}");
    assert_eq!(with.lasting_torque_rate, 0.4 * with.rate_error);
}
