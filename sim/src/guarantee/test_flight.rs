//! Real flights for the monitors' tests, which may tamper with what controller and plant exchange.

use ctrl_core::config::{CascadeGains, IntegralAction, RobustAdaptiveConfig, SaturatedConfig};
use ctrl_core::controller::{AdaptiveController, Intermediates};
use ctrl_core::rotors::RotorModel;
use ctrl_core::trajectory::{RisingCircle, RisingCircleConfig, Trajectory};
use ctrl_core::vehicle::{InitialEstimate, Interval, Uncertainty, VectorInterval};
use glam::{DQuat, DVec3, Vec3};

use crate::evaluation::Evaluation;
use crate::plant::disturbance::{DisturbanceConfig, DisturbanceProcess, DisturbanceSource};
use crate::plant::rigid_body::RigidBody;
use crate::plant::{PlantParameters, PlantState};
use crate::tick::Tick;
use ctrl_core::controller::ControllerConfig;

/// True parameters of the vehicle under test.
pub const VEHICLE: PlantParameters =
    PlantParameters::new(0.85, DVec3::new(0.04856, 0.04856, 0.09801));

const UNCERTAINTY: Uncertainty = Uncertainty {
    mass: Interval { lower: 0.7, upper: 1.0 },
    inertia: VectorInterval::splat(0.03, 0.12),
    disturbance_acceleration: 0.05,
    disturbance_torque: Vec3::splat(0.05),
};

fn gains(k3: f32, c: f32, m: f32) -> CascadeGains {
    CascadeGains {
        k1: 0.5,
        k2: 1.0,
        k3: Vec3::splat(k3),
        c,
        m1: m,
        m2: m,
        gamma1: 0.05,
        delta_1: 0.1,
        delta_min_translation: 0.1,
        delta_min_rotation: 0.05,
    }
}

/// Configuration of controller 1.
pub fn robust_adaptive(step_period: f32) -> RobustAdaptiveConfig {
    RobustAdaptiveConfig {
        step_period,
        reference_acceleration_max: 0.25,
        uncertainty: UNCERTAINTY,
        initial: InitialEstimate { mass: 0.75, inertia: Vec3::splat(0.06) },
        cascade: gains(4.0, 0.01, 4.0),
        k4: Vec3::splat(0.5),
        gamma2: Vec3::splat(0.01),
        integral: IntegralAction::OFF,
        rotors: RotorModel::OFF,
    }
}

/// Configuration of controller 2.
pub fn saturated(step_period: f32) -> SaturatedConfig {
    SaturatedConfig {
        step_period,
        reference_acceleration_max: 0.25,
        uncertainty: UNCERTAINTY,
        initial: InitialEstimate { mass: 0.75, inertia: Vec3::splat(0.06) },
        cascade: gains(2.0, 0.001, 0.45),
        thrust_max: 12.0,
        torque_max: Vec3::splat(0.05),
        k4: Vec3::splat(4.0),
        k5: 0.5,
        gamma2: Vec3::splat(0.01),
        gamma3: 0.01,
        integral: IntegralAction::OFF,
        rotors: RotorModel::OFF,
    }
}

/// Flies the paper's circle for `seconds`; `tamper` may change each tick before `observe` and the
/// plant see it.
pub fn fly<C: AdaptiveController>(
    controller: &C,
    seconds: f64,
    mut tamper: impl FnMut(&mut Tick),
    mut observe: impl FnMut(&Tick),
) {
    let dt = f64::from(controller.step_period());
    let circle =
        RisingCircleConfig { radius: 100.0, angular_rate: 0.05, height: 10.0, rise_rate: 0.1 };
    let trajectory = RisingCircle::new(&circle, controller.step_period()).unwrap();
    let body = RigidBody::new(&VEHICLE, dt, 1);
    let noise = crate::plant::disturbance::Noise { acceleration: 0.05, torque: DVec3::splat(0.05) };
    let config = DisturbanceConfig { noise: Some(noise), ..DisturbanceConfig::default() };
    let mut disturbances = DisturbanceProcess::new(&config, 1, dt);
    let mut state = controller.initial_state();
    let mut truth = PlantState {
        position_world: DVec3::new(98.0, -2.0, 0.0),
        velocity_world: DVec3::ZERO,
        attitude: DQuat::from_rotation_z(core::f64::consts::PI),
        rate_body: DVec3::ZERO,
    };
    for tick in 0..(seconds / dt).round() as u64 {
        let reference = trajectory.reference(tick);
        let estimates = controller.estimates(&state);
        let auxiliary = controller.auxiliary(&state);
        let lasting = controller.lasting(&state);
        let mut intermediates = Intermediates::default();
        let output = controller.step_observed(&mut state, &truth.measured(), &reference, |seen| {
            intermediates = *seen;
        });
        let disturbance = disturbances.advance(&truth);
        let time = tick as f64 * dt;
        let mut tick = Tick {
            tick,
            time,
            truth,
            reference,
            output,
            applied: output.wrench.into(),
            intermediates,
            estimates,
            auxiliary,
            lasting,
            disturbance,
            law: true,
            battery: None,
            evaluation: Evaluation::default(),
        };
        tamper(&mut tick);
        observe(&tick);
        truth = body.advance(&truth, &tick.output.wrench, &tick.disturbance);
    }
}

/// [`fly`] with the controller that `config` configures.
pub fn fly_either(
    config: &ControllerConfig,
    seconds: f64,
    tamper: impl FnMut(&mut Tick),
    observe: impl FnMut(&Tick),
) {
    fly(&config.build().unwrap(), seconds, tamper, observe);
}

/// Both controllers at the same step.
pub fn both(step_period: f32) -> [ControllerConfig; 2] {
    [
        ControllerConfig::RobustAdaptive(robust_adaptive(step_period)),
        ControllerConfig::Saturated(saturated(step_period)),
    ]
}

/// `config` with other gains, limits and intervals about each axis.
pub fn unlike(mut config: ControllerConfig) -> ControllerConfig {
    config.cascade_mut().k3 *= Vec3::new(1.0, 0.8, 0.5);
    let (k4, gamma2, known) = match &mut config {
        ControllerConfig::RobustAdaptive(it) => (&mut it.k4, &mut it.gamma2, &mut it.uncertainty),
        ControllerConfig::Saturated(it) => {
            it.torque_max *= Vec3::new(1.0, 0.7, 0.4);
            (&mut it.k4, &mut it.gamma2, &mut it.uncertainty)
        }
    };
    *k4 *= Vec3::new(1.0, 0.9, 0.6);
    *gamma2 *= Vec3::new(1.0, 0.5, 0.2);
    known.disturbance_torque *= Vec3::new(1.0, 1.2, 1.5);
    known.inertia =
        VectorInterval { lower: Vec3::new(0.03, 0.04, 0.05), upper: Vec3::new(0.12, 0.1, 0.2) };
    config
}

/// One tick of the start of a flight, to be changed at will.
pub fn sample(config: &ControllerConfig) -> Tick {
    let mut first = None;
    fly_either(config, f64::from(config.step_period()), |_| {}, |tick| first = Some(*tick));
    first.unwrap()
}
