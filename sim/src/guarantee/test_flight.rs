//! Real flights for the monitors' tests, which may tamper with what controller and plant exchange.

use ctrl_core::config::{CascadeGains, IntegralAction, RobustAdaptiveConfig, SaturatedConfig};
use ctrl_core::controller::{AdaptiveController, Intermediates};
use ctrl_core::trajectory::{RisingCircle, RisingCircleConfig, Trajectory};
use ctrl_core::vehicle::{InitialEstimate, Interval, Uncertainty};
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
    inertia: Interval { lower: 0.03, upper: 0.12 },
    disturbance_acceleration: 0.05,
    disturbance_torque: 0.05,
};

fn gains(k3: f32, c: f32, m: f32) -> CascadeGains {
    CascadeGains {
        k1: 0.5,
        k2: 1.0,
        k3,
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
        k4: 0.5,
        gamma2: 0.01,
        integral: IntegralAction::OFF,
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
        torque_max: 0.05,
        k4: 4.0,
        k5: 0.5,
        gamma2: 0.01,
        gamma3: 0.01,
        integral: IntegralAction::OFF,
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
    let noise = crate::plant::disturbance::Noise { acceleration: 0.05, torque: 0.05 };
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

/// One tick of the start of a flight, to be changed at will.
pub fn sample(config: &ControllerConfig) -> Tick {
    let mut first = None;
    fly_either(config, f64::from(config.step_period()), |_| {}, |tick| first = Some(*tick));
    first.unwrap()
}
