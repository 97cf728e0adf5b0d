//! The balance along real flights: it holds for the laws as they are, and fails for broken ones.

use ctrl_core::config::{CascadeGains, RobustAdaptiveConfig, SaturatedConfig};
use ctrl_core::controller::{Intermediates, TrackingController};
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::saturated::Saturated;
use ctrl_core::trajectory::{RisingCircle, RisingCircleConfig, Trajectory};
use ctrl_core::vehicle::{InitialEstimate, Interval, Uncertainty};
use glam::{DQuat, DVec3, Vec3};

use super::balance::balance;
use super::*;
use crate::plant::disturbance::{DisturbanceConfig, DisturbanceProcess};
use crate::plant::rigid_body::RigidBody;
use crate::plant::{PlantParameters, PlantState};
use crate::sample::Sample;
use crate::scenario::ControllerConfig;

const VEHICLE: PlantParameters =
    PlantParameters { mass: 0.85, inertia: DVec3::new(0.04856, 0.04856, 0.09801) };

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

fn robust_adaptive(step_period: f32) -> RobustAdaptiveConfig {
    RobustAdaptiveConfig {
        step_period,
        reference_acceleration_max: 0.25,
        uncertainty: UNCERTAINTY,
        initial: InitialEstimate { mass: 0.75, inertia: Vec3::splat(0.06) },
        cascade: gains(4.0, 0.01, 4.0),
        k4: 0.5,
        gamma2: 0.01,
    }
}

fn saturated(step_period: f32) -> SaturatedConfig {
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
    }
}

/// Flies the paper's circle for `seconds`; `tamper` may change each sample before the monitor and
/// the plant see it.
fn fly<C: TrackingController>(
    controller: &C,
    seconds: f64,
    mut tamper: impl FnMut(&mut Sample),
    mut observe: impl FnMut(&Sample),
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
        let mut intermediates = Intermediates::default();
        let output = controller.step_observed(&mut state, &truth.measured(), &reference, |seen| {
            intermediates = *seen;
        });
        let disturbance = disturbances.advance();
        let time = tick as f64 * dt;
        let mut sample = Sample {
            tick,
            time,
            truth,
            reference,
            output,
            intermediates,
            estimates,
            auxiliary,
            disturbance,
        };
        tamper(&mut sample);
        observe(&sample);
        truth = body.advance(&truth, &sample.output.wrench, &sample.disturbance);
    }
}

#[test]
fn explore() {
    for dt in [0.001f32, 0.0005] {
        let config = robust_adaptive(dt);
        explore_one(
            &RobustAdaptive::new(&config).unwrap(),
            ControllerConfig::RobustAdaptive(config),
        );
        let config = saturated(dt);
        explore_one(&Saturated::new(&config).unwrap(), ControllerConfig::Saturated(config));
    }
}

fn explore_one<C: TrackingController>(controller: &C, law: ControllerConfig) {
    let dt = f64::from(law.step_period());
    let mut evaluator = Evaluator::new(&law, &VEHICLE);
    let mut previous: Option<(Sample, Evaluation)> = None;
    let mut worst = f64::NEG_INFINITY;
    let mut sums = [0.0; 6];
    let mut next = 0.0;
    println!("time  V  Vparam | per s: change W smooth model allowance | worst excess");
    fly(
        controller,
        160.0,
        |_| {},
        |sample| {
            let evaluation = evaluator.evaluate(sample);
            if let Some((before, earlier)) = &previous {
                if !before.output.status.intersects(function::OUTSIDE_THE_PROOF) {
                    let b =
                        balance(&evaluator.parameters, (before, earlier), (sample, &evaluation));
                    worst = worst.max(b.excess(dt));
                    if b.excess(dt) > 0.0 {
                        println!(
                            "BAD {} {:+.3e} {:?} dpar {:+.3e} inc {:?} g {:?} eps {:?} we {:?} est {:?}",
                            sample.time,
                            b.excess(dt),
                            b,
                            evaluation.parameter_part - earlier.parameter_part,
                            earlier.increments,
                            earlier.translation.g,
                            earlier.attitude_error,
                            earlier.rate_error,
                            sample.estimates
                        );
                    }
                    for (s, x) in sums.iter_mut().zip([
                        b.change,
                        b.decrease * dt,
                        b.disturbance * dt,
                        b.model * dt,
                        b.allowance,
                        dt,
                    ]) {
                        *s += x;
                    }
                } else {
                    println!("left out {} {:?}", sample.time, before.output.status);
                }
            }
            previous = Some((*sample, evaluation));
            if sample.time >= next {
                let t = sums[5].max(dt);
                println!(
                    "{:7.3} V {:10.4e} par {:10.4e} | dV {:+.3e} W {:.3e} dist {:+.3e} model {:+.3e} A {:+.3e} | {:+.3e} {:?}",
                    sample.time,
                    evaluation.value,
                    evaluation.parameter_part,
                    sums[0] / t,
                    sums[1] / t,
                    sums[2] / t,
                    sums[3] / t,
                    sums[4] / t,
                    worst,
                    sample.output.status
                );
                sums = [0.0; 6];
                worst = f64::NEG_INFINITY;
                next = if next < 1.0 {
                    next + 0.1
                } else if next < 10.0 {
                    next + 1.0
                } else {
                    next + 10.0
                };
            }
        },
    );
}
