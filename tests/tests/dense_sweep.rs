//! The core's single step against the transcription, over thousands of random steps whose inputs
//! are exact in `f32`: what is left is the core's own arithmetic.

use system_tests::accuracy::Accuracy;
use system_tests::random::{STEP_PERIOD, Source, Step};
use system_tests::single_precision::observe;
use system_tests::transcription::Law;

const STEPS_PER_LAW: usize = 5000;

#[test]
fn core_agrees_with_the_transcription() {
    sweep("Dense sweep", 1, Source::step);
}

#[test]
fn core_with_integral_action_agrees_with_the_transcription() {
    sweep("Dense sweep with integral action", 3, Source::step_with_integral);
}

#[test]
fn core_with_unlike_axes_agrees_with_the_transcription() {
    sweep("Dense sweep with integral action", 5, Source::step_with_unlike_axes);
}

#[test]
fn core_behind_rotors_agrees_with_the_transcription() {
    sweep("Dense sweep behind rotors that lag", 7, Source::step_behind_rotors);
}

/// Compares steps of both laws from `draw` with the documented accuracies of the page's `section`.
fn sweep(section: &'static str, first_seed: u64, draw: fn(&mut Source, Law) -> Step) {
    let mut accuracy = Accuracy::documented(section);
    for (law, seed) in [(Law::RobustAdaptive, first_seed), (Law::Saturated, first_seed + 1)] {
        let mut source = Source::new(seed);
        for index in 0..STEPS_PER_LAW {
            let Step { gains, truth, reference, memory, elapsed } = draw(&mut source, law);
            let expected = law.evaluate(&gains, &truth, &reference, &memory).quantities;
            let (_, seen) =
                observe(law, &gains, &truth, &reference, &memory, elapsed, STEP_PERIOD as f32)
                    .unwrap_or_else(|error| panic!("{law:?}, step {index}: {error}"));
            for (name, expected) in &expected {
                accuracy.compare(name, &seen[name], expected);
            }
        }
    }
    accuracy.check();
}
