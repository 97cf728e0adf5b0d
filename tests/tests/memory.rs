//! The core's memory against the transcription's along one flight each: both see the same states
//! at every tick, so that what they differ by is what their discrete updates accumulate.

use ctrl_core::controller::AdaptiveController;
use ctrl_core::controller::StepStatus;
use ctrl_core::vehicle::Wrench;
use glam::DVec3;
use sim::plant::{Disturbance, PlantState};
use system_tests::accuracy::Accuracy;
use system_tests::flight::{Held, fly, start, truth};
use system_tests::paper_example::{Circle, ROBUST_ADAPTIVE_GAINS, SATURATED_GAINS};
use system_tests::random::{rounded_gains, rounded_reference};
use system_tests::single_precision::{reference, robust_adaptive, rounded_each, saturated};
use system_tests::transcription::{Gains, Law, Memory, RotorGains, Truth};

const DT: f64 = 1e-3;
const TICKS: u32 = 20_000;

/// Events that a flight must include to count.
struct Seen {
    status: StepStatus,
}

/// The state that both laws see: rounded to `f32`, its quaternion of unit length in `f64`.
fn rounded_truth(state: &PlantState) -> Truth {
    let Truth { p, v, q, w } = truth(state);
    let q = system_tests::random::rounded_unit(q);
    Truth { p: rounded_each(p), v: rounded_each(v), q, w: rounded_each(w) }
}

/// Flies the core over the paper's example, tilted and disturbed at the start, and compares.
fn compare<C: AdaptiveController>(
    law: Law,
    controller: &C,
    gains: &Gains,
    accuracy: &mut Accuracy,
) -> Seen {
    let beside = start(&Circle::PAPER, DVec3::new(-2.0, -2.0, 0.0), DVec3::new(0.6, 1.0, 0.1), 1.0);
    let mut memory = Memory::starting(0.75, DVec3::splat(f64::from(0.06f32)));
    let mut state = controller.initial_state();
    let mut seen = Seen { status: StepStatus::empty() };
    let mut rotors = DVec3::ZERO;
    fly(beside, DVec3::new(0.04856, 0.04856, 0.09801), DT, TICKS, |tick, plant| {
        let r = rounded_reference(&Circle::PAPER.at(f64::from(tick) * DT));
        let expected = law.step(gains, &rounded_truth(plant), &r, &mut memory, DT);
        let output = controller.step(&mut state, &plant.measured(), &reference(&r));
        seen.status |= output.status;
        accuracy.compare("f", &[output.wrench.thrust.into()], &[expected.thrust]);
        let torque = output.wrench.torque_body.as_dvec3();
        accuracy.compare("tau", &torque.to_array(), &expected.torque.to_array());
        compare_memory(law, controller, &state, &memory, accuracy);
        let disturbance = Disturbance {
            acceleration_world: DVec3::new(0.05, -0.03, 0.02),
            torque_body: DVec3::new(0.01, -0.01, 0.005),
            ..Disturbance::NONE
        };
        // What acts on the plant is what the model says: the command itself without one.
        let acting = gains.rotors.command(torque, DVec3::MAX, rotors);
        rotors = gains.rotors.after(rotors, torque);
        let wrench = Wrench { torque_body: acting.acting.as_vec3(), ..output.wrench };
        Held { wrench, mass: 0.85, disturbance }
    });
    seen
}

fn compare_memory<C: AdaptiveController>(
    law: Law,
    controller: &C,
    state: &C::State,
    memory: &Memory,
    accuracy: &mut Accuracy,
) {
    let estimates = controller.estimates(state);
    accuracy.compare("beta", &[estimates.inverse_mass.into()], &[memory.beta]);
    let mut vector = |name, actual: glam::Vec3, expected: DVec3| {
        accuracy.compare(name, &actual.as_dvec3().to_array(), &expected.to_array());
    };
    let auxiliary = controller.auxiliary(state);
    vector("w_a", auxiliary.rate, memory.w_a);
    if law == Law::RobustAdaptive {
        return vector("a_hat", estimates.inertia, memory.a_hat);
    }
    vector("theta_hat", estimates.inverse_inertia, memory.theta_hat);
    vector("Pi_hat", estimates.gyroscopic_ratio, memory.pi_hat);
    let q_a = auxiliary.attitude;
    let q_a = [q_a.w, q_a.x, q_a.y, q_a.z].map(f64::from);
    accuracy.compare("q_a", &q_a, &memory.q_a.to_array());
}

/// Compares both laws, each with its gains changed by `change`.
fn compare_both(section: &'static str, change: impl Fn(Gains) -> Gains) {
    let mut accuracy = Accuracy::documented(section);
    let gains = rounded_gains(&change(ROBUST_ADAPTIVE_GAINS));
    let first = robust_adaptive(&gains, DT as f32).expect("shipped gains");
    let seen = compare(Law::RobustAdaptive, &first, &gains, &mut accuracy);
    assert!(seen.status.contains(StepStatus::MASS_PROJECTED), "{:?}", seen.status);
    let gains = rounded_gains(&change(SATURATED_GAINS));
    let second = saturated(&gains, DT as f32).expect("shipped gains");
    let seen = compare(Law::Saturated, &second, &gains, &mut accuracy);
    assert!(seen.status.contains(StepStatus::TORQUE_SATURATED), "{:?}", seen.status);
    accuracy.check();
}

#[test]
fn memories_stay_together_along_a_flight() {
    compare_both("Memory along a flight", |gains| gains);
}

#[test]
fn memories_stay_together_behind_rotors_that_lag() {
    let rotors = RotorGains { lag: 0.03, residual_lag: 0.01, dt: DT };
    compare_both("Memory along a flight", |gains| Gains { rotors, ..gains });
}
