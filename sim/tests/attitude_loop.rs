//! The bound of the attitude loop against flights by sensors, on the truth (`docs/guarantees.md#the-attitude-loop`).

use sim::guarantee::{Requirement, Verdict};
use sim::scenario::LoadedScenario;

/// Controller 1 with gentle gains and narrow sets, by an ICM-42688-P and motion capture.
const FLIGHT: [&str; 24] = [
    "duration=70",
    "vehicle.inertia=[0.0485,0.0485,0.05]",
    "guarantees.settle_time=40",
    "disturbance.noise.acceleration=0.01",
    "disturbance.noise.torque=0.005",
    "sensors.imu=\"icm-42688-p\"",
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
    "guarantees.state_error.position=0.001",
    "guarantees.state_error.velocity=0.003",
    "guarantees.state_error.force=0.3",
    "guarantees.attitude_error_max=0.05",
    "guarantees.position_error_max=0.2",
    "guarantees.state_error.attitude_loop={attitude=0.0015,rate=0.0095,mass=0.001}",
];
/// Practically at rest, and half a metre to either side with 0.005 m/s^2.
const TRAJECTORIES: [[&str; 3]; 2] = [
    [
        "trajectory.lemniscate.amplitude_x=0.001",
        "trajectory.lemniscate.amplitude_y=0.001",
        "trajectory.lemniscate.angular_rate=0.1",
    ],
    [
        "trajectory.lemniscate.amplitude_x=0.5",
        "trajectory.lemniscate.amplitude_y=0.25",
        "trajectory.lemniscate.angular_rate=0.1",
    ],
];
/// Flights along each trajectory.
const FLIGHTS: u64 = 6;

fn fly(trajectory: &[&str; 3], seed: u64) -> Vec<Verdict> {
    let seed = format!("seed={seed}");
    let changes: Vec<String> =
        FLIGHT.iter().chain(trajectory).chain([&&*seed]).map(|it| (*it).to_owned()).collect();
    let loaded =
        LoadedScenario::open("sensors-indoors", &changes).unwrap_or_else(|e| panic!("{e}"));
    let mut monitors = loaded.scenario().monitors();
    let period = f64::from(loaded.scenario().controller.step_period());
    let ticks = (loaded.scenario().duration / period).round() as u64;
    loaded.flight().expect("valid").observe(ticks, &mut monitors);
    monitors.verdicts()
}

#[test]
fn flights_stay_within_the_bounds_that_follow_from_the_errors_of_the_state() {
    for trajectory in &TRAJECTORIES {
        let mut most = [0.0f64; 9];
        for seed in 0..FLIGHTS {
            let rows = fly(trajectory, seed);
            for row in &rows {
                assert!(row.pass, "seed {seed}: {row}");
            }
            let judged: Vec<_> =
                rows.iter().filter(|row| row.equation == "guarantees.md").collect();
            let judged = &judged[judged.len() - 9..];
            for (most, row) in most.iter_mut().zip(judged) {
                assert!(matches!(row.requirement, Requirement::AtMost(_)), "no bound: {row}");
                *most = most.max(row.observed.expect("observed"));
            }
            if seed + 1 == FLIGHTS {
                for (most, row) in most.iter().zip(judged) {
                    println!("{}: {most:.5} of {:?}", row.name, row.requirement);
                }
            }
        }
    }
}
