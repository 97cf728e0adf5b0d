//! alpha', alpha'', w_d', mu' against central differences of alpha, alpha', w_d, mu between the ticks
//! of model-consistent closed-loop flights, of the transcription and of the core.
//!
//! Model-consistent: m = 1/beta at every tick, no disturbance, the smoothing width constant, no
//! estimate at the border of its set, no torque saturated. Because thrust is held between ticks,
//! the two still differ in first order of the tick: little in gentle flight, and half as much at half
//! the tick in a violent start.

use ctrl_core::controller::AdaptiveController;
use ctrl_core::vehicle::Wrench;
use glam::DVec3;
use sim::plant::{Disturbance, PlantState};
use system_tests::flight::{Held, fly, start, truth};
use system_tests::paper_example::{Circle, ROBUST_ADAPTIVE_GAINS, SATURATED_GAINS};
use system_tests::single_precision::{
    checkpoint, observed_step, reference, robust_adaptive, saturated,
};
use system_tests::transcription::{Evaluation, Gains, Law, Memory, Quantities};

/// A quantity and the one that is its time derivative.
const PAIRS: [(&str, &str); 4] =
    [("alpha", "alpha_dot"), ("alpha_dot", "alpha_ddot"), ("w_d", "w_d_dot"), ("mu", "mu_dot")];

const INERTIA: DVec3 = DVec3::new(0.04856, 0.04856, 0.09801);

const LAWS: [Law; 2] = [Law::RobustAdaptive, Law::Saturated];

/// Torque to spare (mu' is mu's derivative only while q_a rests), adaptation that does not reach
/// the border of its set, and a smoothing width that takes several ticks to cross.
fn gains(law: Law) -> Gains {
    let gains = if law == Law::RobustAdaptive { ROBUST_ADAPTIVE_GAINS } else { SATURATED_GAINS };
    Gains {
        m1: 0.45,
        m2: 0.45,
        m_tau: DVec3::splat(1e3),
        gamma1: 0.005,
        delta_min_translation: 1.0,
        ..gains
    }
}

/// Long after the first step: nothing is left of the decaying part of the smoothing width.
fn memory() -> Memory {
    Memory { decay: 0.0, ..Memory::starting(0.85, DVec3::splat(0.06)) }
}

/// Start of a flight, and the part of it that counts.
#[derive(Clone, Copy)]
struct Flight {
    start: PlantState,
    counted_from: f64,
    seconds: f64,
}

/// Along the circle from beside it, once the start has died away.
fn gentle() -> Flight {
    let mut start = start(&Circle::SMALL, DVec3::splat(0.02), DVec3::X, 0.0);
    start.velocity_world = Circle::SMALL.at(0.0).v;
    Flight { start, counted_from: 2.0, seconds: 6.0 }
}

/// At rest, tilted by 86 degrees.
fn violent() -> Flight {
    let axis = DVec3::new(1.0, 0.3, 0.2);
    let start = start(&Circle::SMALL, DVec3::new(0.5, -0.5, 0.2), axis, 1.5);
    Flight { start, counted_from: 0.0, seconds: 2.0 }
}

/// Every quantity at every tick that counts, by the transcription.
fn by_transcription(law: Law, flight: Flight, dt: f64) -> Vec<Quantities> {
    let (gains, mut memory) = (gains(law), memory());
    recorded(flight, dt, |tick, state| {
        let reference = Circle::SMALL.at(f64::from(tick) * dt);
        let mass = 1.0 / memory.beta;
        let evaluation = law.step(&gains, &truth(state), &reference, &mut memory, dt);
        let held = held_exactly(&evaluation, state, mass);
        (evaluation.quantities, held)
    })
}

/// The wrench in `f32`, and what that rounds off as a disturbance: a flight in `f64`.
fn held_exactly(evaluation: &Evaluation, state: &PlantState, mass: f64) -> Held {
    let Evaluation { thrust, torque, .. } = *evaluation;
    let wrench = Wrench { thrust: thrust as f32, torque_body: torque.as_vec3() };
    let rest = (thrust - f64::from(wrench.thrust)) / mass;
    let disturbance = Disturbance {
        acceleration_world: rest * (state.attitude * DVec3::Z),
        torque_body: torque - wrench.torque_body.as_dvec3(),
        ..Disturbance::NONE
    };
    Held { wrench, mass, disturbance }
}

/// Every quantity at every tick that counts, by the core.
fn by_core(law: Law, flight: Flight, dt: f64) -> Vec<Quantities> {
    let (gains, checkpoint) = (gains(law), checkpoint(law, &memory(), 1e4));
    match law {
        Law::RobustAdaptive => {
            let controller = robust_adaptive(&gains, dt as f32).expect("gains that it accepts");
            let state = controller.resume(&checkpoint).expect("a memory that it accepts");
            by_controller(&controller, state, flight, dt)
        }
        Law::Saturated => {
            let controller = saturated(&gains, dt as f32).expect("gains that it accepts");
            let state = controller.resume(&checkpoint).expect("a memory that it accepts");
            by_controller(&controller, state, flight, dt)
        }
    }
}

fn by_controller<C: AdaptiveController>(
    controller: &C,
    mut memory: C::State,
    flight: Flight,
    dt: f64,
) -> Vec<Quantities> {
    recorded(flight, dt, |tick, state| {
        let reference = reference(&Circle::SMALL.at(f64::from(tick) * dt));
        let mass = 1.0 / f64::from(controller.estimates(&memory).inverse_mass);
        let (output, seen) = observed_step(controller, &mut memory, &state.measured(), &reference);
        assert!(output.status.is_empty(), "tick {tick}: {:?}", output.status);
        (seen, Held { wrench: output.wrench, mass, disturbance: Disturbance::default() })
    })
}

fn recorded(
    flight: Flight,
    dt: f64,
    mut control: impl FnMut(u32, &PlantState) -> (Quantities, Held),
) -> Vec<Quantities> {
    let ticks = |seconds: f64| (seconds / dt).round() as u32;
    let mut record = Vec::new();
    fly(flight.start, INERTIA, dt, ticks(flight.seconds), |tick, state| {
        let (seen, held) = control(tick, state);
        if tick >= ticks(flight.counted_from) {
            record.push(seen);
        }
        held
    });
    record
}

/// Largest difference over the flight, as a fraction of the derivative's largest magnitude.
fn disagreement(record: &[Quantities], dt: f64, (value, rate): (&str, &str)) -> f64 {
    let at = |k: usize, name: &str| DVec3::from_slice(&record[k][name]);
    let inner = 1..record.len() - 1;
    let error = inner.clone().map(|k| {
        let central = (at(k + 1, value) - at(k - 1, value)) / (2.0 * dt);
        (central - at(k, rate)).abs().max_element()
    });
    let scale = inner.clone().map(|k| at(k, rate).abs().max_element()).fold(0.0, f64::max);
    error.fold(0.0, f64::max) / scale
}

type Fly = fn(Law, Flight, f64) -> Vec<Quantities>;

/// [`disagreement`] of each of the [`PAIRS`].
fn disagreements(fly: Fly, law: Law, flight: Flight, dt: f64) -> [f64; 4] {
    let record = fly(law, flight, dt);
    let found = PAIRS.map(|pair| disagreement(&record, dt, pair));
    println!("{law:?} at {dt} s, {PAIRS:?}: {found:.6?}");
    found
}

#[test]
fn gentle_flight_of_the_transcription_agrees_to_1e_5() {
    for law in LAWS {
        for found in disagreements(by_transcription, law, gentle(), 1e-3) {
            assert!(found < 1e-5, "{law:?}: {found:e}");
        }
    }
}

#[test]
fn violent_flight_of_the_transcription_agrees_better_at_half_the_tick() {
    for law in LAWS {
        let coarse = disagreements(by_transcription, law, violent(), 2e-3);
        let fine = disagreements(by_transcription, law, violent(), 1e-3);
        for (coarse, fine) in coarse.into_iter().zip(fine) {
            assert!(coarse < 1.5e-3, "{law:?}: {coarse:e}");
            assert!((1.8..2.5).contains(&(coarse / fine)), "{law:?}: {coarse:e} to {fine:e}");
        }
    }
}

/// Not the gentle one: there the differences of `f32` values are mostly rounding.
#[test]
fn violent_flight_of_the_core_agrees_better_at_half_the_tick() {
    for law in LAWS {
        let coarse = disagreements(by_core, law, violent(), 2e-3);
        let fine = disagreements(by_core, law, violent(), 1e-3);
        for (coarse, fine) in coarse.into_iter().zip(fine) {
            assert!(coarse < 1.5e-3, "{law:?}: {coarse:e}");
            assert!((1.6..2.5).contains(&(coarse / fine)), "{law:?}: {coarse:e} to {fine:e}");
        }
    }
}
