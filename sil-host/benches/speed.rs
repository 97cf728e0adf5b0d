//! Wall time of one step of each controller, of each part of a tick, and of whole flights:
//! `cargo bench -p sil-host --bench speed`. A flight's tick below 1 us is 1,000 times real time.

use std::path::Path;

use ctrl_core::config::{RobustAdaptiveConfig, SaturatedConfig};
use ctrl_core::controller::ControllerConfig;
use ctrl_core::controller::TrackingController;
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::saturated::Saturated;
use ctrl_core::trajectory::Trajectory;
use ctrl_core::vehicle::Wrench;
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use glam::Vec3;
use sil_host::run::FlightRecorder;
use sim::observer::Observer;
use sim::plant::Disturbance;
use sim::plant::disturbance::{DisturbanceProcess, DisturbanceSource};
use sim::plant::rigid_body::RigidBody;
use sim::scenario::{LoadedScenario, Scenario};

const PAPER: [&str; 2] = ["paper-robust-adaptive", "paper-saturated"];
/// Calls in one measurement of a part of a tick.
const CALLS: u64 = 1_000;

fn main() {
    divan::main();
}

fn load(name: &str) -> LoadedScenario {
    LoadedScenario::open(name, &[]).expect("a built-in scenario is valid")
}

/// Control ticks of a whole flight without logging: reference, law, disturbance and plant.
#[divan::bench(args = PAPER, sample_count = 20)]
fn flight(bencher: Bencher, name: &str) {
    let scenario = load(name);
    let ticks = scenario.scenario().ticks();
    bencher
        .counter(ItemsCount::new(ticks))
        .with_inputs(|| scenario.flight().expect("a built-in scenario is valid"))
        .bench_local_values(|mut flight| {
            flight.advance(ticks);
            *flight.truth()
        });
}

/// The same flight with every monitor, figure and a trace of every tick.
#[divan::bench(args = PAPER, sample_count = 10)]
fn flight_with_trace(bencher: Bencher, name: &str) {
    let scenario = load(name).scenario().clone();
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("speed").join(name);
    fly(bencher, name, || {
        FlightRecorder::new(&scenario, &directory, 1).expect("results can be written")
    });
}

fn fly<O: Observer>(bencher: Bencher, name: &str, observer: impl Fn() -> O) {
    let scenario = load(name);
    let ticks = scenario.scenario().ticks();
    bencher
        .counter(ItemsCount::new(ticks))
        .with_inputs(|| (scenario.flight().expect("a built-in scenario is valid"), observer()))
        .bench_local_values(|(mut flight, mut observer)| {
            flight.observe(ticks, &mut observer);
            *flight.truth()
        });
}

#[divan::bench]
fn step_robust_adaptive(bencher: Bencher) {
    let scenario = load(PAPER[0]).scenario().clone();
    let ControllerConfig::RobustAdaptive(config) = scenario.controller else { unreachable!() };
    let new = |config: &RobustAdaptiveConfig| RobustAdaptive::new(config).expect("valid");
    step(bencher, &new(&config), &scenario);
}

#[divan::bench]
fn step_saturated(bencher: Bencher) {
    let scenario = load(PAPER[1]).scenario().clone();
    let ControllerConfig::Saturated(config) = scenario.controller else { unreachable!() };
    let new = |config: &SaturatedConfig| Saturated::new(config).expect("valid");
    step(bencher, &new(&config), &scenario);
}

/// One evaluation of the law beside its reference.
fn step<C: TrackingController>(bencher: Bencher, controller: &C, scenario: &Scenario) {
    let trajectory = scenario.trajectory.build(controller.step_period()).expect("valid");
    let (reference, vehicle) = (trajectory.reference(10), scenario.initial.state().measured());
    let mut state = controller.initial_state();
    bencher.counter(ItemsCount::new(CALLS)).bench_local(|| {
        for _ in 0..CALLS {
            black_box(controller.step(&mut state, black_box(&vehicle), black_box(&reference)));
        }
    });
}

/// Every kind of trajectory that a built-in scenario has.
#[divan::bench(args = [PAPER[0], "hover-gusts", "lemniscate", "waypoints"])]
fn reference(bencher: Bencher, name: &str) {
    let trajectory = load(name).scenario().trajectory.build(1e-3).expect("valid");
    bencher.counter(ItemsCount::new(CALLS)).bench_local(|| {
        for tick in 0..CALLS {
            black_box(trajectory.reference(black_box(tick)));
        }
    });
}

#[divan::bench]
fn disturbance(bencher: Bencher) {
    let scenario = load(PAPER[0]).scenario().clone();
    let mut noise = DisturbanceProcess::new(&scenario.disturbance, 1, 1e-3);
    let truth = scenario.initial.state();
    bencher.counter(ItemsCount::new(CALLS)).bench_local(|| {
        for _ in 0..CALLS {
            black_box(noise.advance(&truth));
        }
    });
}

#[divan::bench]
fn plant(bencher: Bencher) {
    let scenario = load(PAPER[0]).scenario().clone();
    let body = RigidBody::new(&scenario.vehicle.into(), 1e-3, 1);
    let wrench = Wrench { thrust: 8.0, torque_body: Vec3::new(0.01, 0.0, -0.01) };
    bencher.counter(ItemsCount::new(CALLS)).bench_local(|| {
        let mut truth = scenario.initial.state();
        for _ in 0..CALLS {
            truth = body.advance(&truth, black_box(&wrench), &Disturbance::default());
        }
        truth
    });
}
