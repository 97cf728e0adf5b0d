//! The core's single step against the golden steps.

use system_tests::accuracy::Accuracy;
use system_tests::golden::golden_steps;
use system_tests::single_precision::observe;

#[test]
fn core_gives_the_golden_quantities_in_single_precision() {
    let mut accuracy = Accuracy::documented("Golden steps");
    for step in golden_steps() {
        let (law, memory, elapsed) = (step.law(), step.memory(), step.elapsed());
        let (_, seen) =
            observe(law, &step.gains, &step.truth, &step.reference, &memory, elapsed, 1e-3)
                .unwrap_or_else(|error| panic!("line {}: {error}", step.index));
        for (name, expected) in step.quantities() {
            accuracy.compare(name, &seen[name], expected);
        }
    }
    accuracy.check();
}
