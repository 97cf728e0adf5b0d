use super::*;
use ctrl_core::controller::{Intermediates, TrackingController};
use ctrl_core::reference::Reference;
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::vehicle::VehicleState;
use glam::Quat;

use crate::scenario::{BUILT_IN, LoadedScenario};

fn controller(name: &str, changes: &[&str]) -> ControllerConfig {
    let changes: Vec<String> = changes.iter().map(|it| (*it).to_owned()).collect();
    LoadedScenario::open(name, &changes).expect("a scenario").scenario().controller
}

/// Gentle gains, narrow sets: the worst course stays within the saturations.
const GENTLE: [&str; 13] = [
    "vehicle.inertia=[0.0485,0.0485,0.05]",
    "controller.robust_adaptive.k4=1.0",
    "controller.robust_adaptive.uncertainty.inertia={lower=[0.0480,0.0480,0.0495],upper=[0.0490,0.0490,0.0505]}",
    "controller.robust_adaptive.uncertainty.disturbance_acceleration=0.01",
    "controller.robust_adaptive.uncertainty.disturbance_torque=0.005",
    "controller.robust_adaptive.initial.inertia=[0.0485,0.0485,0.05]",
    "controller.robust_adaptive.cascade.k1=0.5",
    "controller.robust_adaptive.cascade.k2=0.4",
    "controller.robust_adaptive.cascade.k3=8.0",
    "controller.robust_adaptive.cascade.M1=1.0",
    "controller.robust_adaptive.cascade.M2=1.0",
    "controller.robust_adaptive.cascade.c=0.0005",
    "controller.robust_adaptive.cascade.delta_min_translation=0.5",
];

/// Errors of a good inertial unit and motion capture.
const GOOD: ReceivedErrors =
    ReceivedErrors { position: 6e-4, velocity: 3e-3, attitude: 2e-3, rate: 8e-3, mass: 4e-3 };

/// A number in [-1, 1] from a seed.
fn random(bits: &mut u64) -> f32 {
    *bits ^= *bits << 13;
    *bits ^= *bits >> 7;
    *bits ^= *bits << 17;
    (*bits >> 40) as f32 / 8_388_608.0 - 1.0
}

fn vector(bits: &mut u64, size: f32) -> Vec3 {
    size * Vec3::new(random(bits), random(bits), random(bits))
}

fn step(law: &RobustAdaptive, vehicle: &VehicleState, reference: &Reference) -> Intermediates {
    use ctrl_core::controller::AdaptiveController;
    let (mut seen, mut state) = (Intermediates::default(), law.initial_state());
    law.step_observed(&mut state, vehicle, reference, |it| seen = *it);
    seen
}

/// The law itself, at pairs of states in the region: no change of mu, mu' or the torque exceeds its bound, and the bounds of mu and mu' are within
/// reach of what is seen.
#[test]
fn changes_of_the_law_keep_their_bounds_at_random_pairs_of_states() {
    for changes in [&GENTLE[..], &[]] {
        let config = controller("sensors-indoors", changes);
        let ControllerConfig::RobustAdaptive(robust) = &config else { panic!("controller 1") };
        let law = RobustAdaptive::new(robust).expect("valid");
        let reference = Reference::hover(Vec3::ZERO);
        // (17) at the first step.
        let delta = (1.0 + f64::from(robust.cascade.delta_min_translation).powi(2)).sqrt();
        let bounds = Law::new(&config, delta).expect("covered");
        let (mut bits, mut worst) = (0x0123_4567_89AB_CDEF_u64, [0.0f64; 3]);
        for _ in 0..4000 {
            let size = libm::exp10f(random(&mut bits));
            let mut vehicle = VehicleState {
                position_world: vector(&mut bits, 0.2 * size),
                velocity_world: vector(&mut bits, 0.1 * size),
                attitude: Quat::from_scaled_axis(vector(&mut bits, 0.02 * size)),
                rate_body: Vec3::ZERO,
            };
            vehicle.rate_body =
                step(&law, &vehicle, &reference).mu + vector(&mut bits, 0.05 * size);
            let error = size * random(&mut bits).abs();
            let theta = vector(&mut bits, 0.003 * error);
            let received = VehicleState {
                position_world: vehicle.position_world - vector(&mut bits, 0.002 * error),
                velocity_world: vehicle.velocity_world - vector(&mut bits, 0.008 * error),
                attitude: Quat::from_scaled_axis(-theta) * vehicle.attitude,
                rate_body: vehicle.rate_body - vector(&mut bits, 0.01 * error),
            };
            let (true_step, step) =
                (step(&law, &vehicle, &reference), step(&law, &received, &reference));
            let region = Region {
                position: vehicle.position_world.abs().max_element().into(),
                velocity: vehicle.velocity_world.abs().max_element().into(),
                eps: true_step.attitude_error.xyz().length().into(),
                rate: true_step.rate_error.length().into(),
                force: 0.0,
            };
            let off = |a: Vec3, b: Vec3| f64::from((a - b).length());
            let rate = off(vehicle.rate_body, received.rate_body);
            let errors = [
                off(vehicle.position_world, received.position_world),
                off(vehicle.velocity_world, received.velocity_world),
                theta.length().into(),
                rate,
            ];
            // Gains of the scenario as it is may lean too far for any bound.
            let Some(seen) = bounds.evaluate(&ReferenceExtent::default(), errors, &region) else {
                continue;
            };
            let rounding = 1e-4;
            for (i, (observed, bound)) in [
                (off(true_step.mu, step.mu), seen.mu.change),
                (off(true_step.mu_dot, step.mu_dot), seen.mu_dot.change),
                (off(true_step.torque_body, step.torque_body), bounds.torque_change(&seen, rate)),
                (true_step.mu.length().into(), seen.mu.size),
                (true_step.mu_dot.length().into(), seen.mu_dot.size),
            ]
            .into_iter()
            .enumerate()
            {
                assert!(observed <= bound * 1.001 + rounding, "{i}: {observed} > {bound}");
                if i < 3 && bound > 100.0 * rounding {
                    worst[i] = worst[i].max(observed / bound);
                }
            }
        }
        println!("largest part of the bounds of mu, mu', torque: {worst:?}");
        assert!(worst[0] > 0.1 && worst[1] > 0.02 && worst[2] > 0.05, "{worst:?}");
    }
}

#[test]
fn gentle_gains_have_a_region_that_grows_with_every_error() {
    let law = Law::new(&controller("sensors-indoors", &GENTLE), 0.5).expect("covered");
    let still = ReferenceExtent::default();
    let region = law.region(&GOOD, &still).expect("finite");
    println!("{region:?}");
    assert!((0.05..1.0).contains(&region.force) && region.position < 2.0, "{region:?}");
    let none = ReceivedErrors { position: 0.0, velocity: 0.0, attitude: 0.0, rate: 0.0, mass: 0.0 };
    let least = law.region(&none, &still).expect("finite");
    assert!(least.force > 0.0 && least.force < region.force);
    for more in [
        ReceivedErrors { position: 7e-4, ..GOOD },
        ReceivedErrors { velocity: 3.2e-3, ..GOOD },
        ReceivedErrors { attitude: 2.1e-3, ..GOOD },
        ReceivedErrors { rate: 8.4e-3, ..GOOD },
        ReceivedErrors { mass: 5e-3, ..GOOD },
    ] {
        assert!(law.region(&more, &still).is_none_or(|it| it.force > region.force));
    }
    let twenty = ReceivedErrors { rate: 0.2, ..GOOD };
    assert_eq!(law.region(&twenty, &still), None);
}

/// What `docs/guarantees.md` says of the scenarios as they are.
#[test]
fn gains_of_the_built_in_scenarios_have_none_and_integral_action_is_left_out() {
    let still = ReferenceExtent::default();
    let exact =
        ReceivedErrors { position: 0.0, velocity: 0.0, attitude: 0.0, rate: 0.0, mass: 0.0 };
    for built_in in BUILT_IN.iter().filter(|it| it.name.starts_with("sensors-")) {
        let config = controller(built_in.name, &[]);
        let delta = f64::from(config.cascade().delta_min_translation);
        let law = Law::new(&config, delta);
        assert_eq!(law.is_none(), built_in.name == "sensors-wind", "{}", built_in.name);
        assert_eq!(law.and_then(|law| law.region(&exact, &still)), None, "{}", built_in.name);
    }
    assert!(Law::new(&controller("steady-wind", &[]), 0.1).is_none());
}

#[test]
fn controller_2_has_a_region_while_its_torque_cannot_saturate() {
    let gentle = [
        "controller.saturated.k4=20.0",
        "controller.saturated.uncertainty.inertia={lower=0.0485,upper=0.0488}",
        "controller.saturated.uncertainty.disturbance_acceleration=0.002",
        "controller.saturated.uncertainty.disturbance_torque=0.0002",
        "controller.saturated.initial.inertia=[0.0486,0.0486,0.0486]",
        "controller.saturated.thrust_max=16.0",
        "controller.saturated.cascade.k1=0.5",
        "controller.saturated.cascade.k2=0.4",
        "controller.saturated.cascade.k3=8.0",
        "controller.saturated.cascade.M1=1.0",
        "controller.saturated.cascade.M2=1.0",
        "controller.saturated.cascade.c=0.0001",
        "controller.saturated.cascade.delta_min_translation=0.5",
    ];
    let errors =
        ReceivedErrors { position: 1e-5, velocity: 5e-5, attitude: 3e-5, rate: 2e-4, mass: 2e-4 };
    let still = ReferenceExtent::default();
    let region = |limit: &str| {
        let limit = format!("controller.saturated.torque_max={limit}");
        let all: Vec<&str> = gentle.iter().copied().chain([limit.as_str()]).collect();
        let law = Law::new(&controller("paper-saturated", &all), 0.5).expect("covered");
        law.region(&errors, &still)
    };
    let wide = region("0.5");
    println!("{wide:?}");
    assert!(wide.is_some_and(|region| region.force < 0.3), "{wide:?}");
    assert_eq!(region("0.01"), None);
}
