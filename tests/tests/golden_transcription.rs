//! The transcription against the golden steps.

use std::collections::BTreeMap;

use system_tests::golden::golden_steps;
use system_tests::tolerance::Tolerance;

/// The file prints inputs with 13 digits, so they are off by up to 5e-13 of themselves, and the
/// second derivatives amplify that; measured: 1.2e-10 of absolute plus relative.
const PRINTED: Tolerance = Tolerance { absolute: 1e-9, relative: 1e-9 };

#[test]
fn transcription_gives_every_golden_quantity() {
    let steps = golden_steps();
    let (mut worst, mut checked) = (BTreeMap::new(), 0);
    for step in &steps {
        let evaluation =
            step.law().evaluate(&step.gains, &step.truth, &step.reference, &step.memory());
        for (name, expected) in step.quantities() {
            let actual = &evaluation.quantities[name];
            let entry = worst.entry(name.to_owned()).or_insert(0.0f64);
            *entry = entry.max(PRINTED.ratio(actual, expected));
            PRINTED.check(&format!("line {}, {name}", step.index), actual, expected);
            checked += 1;
        }
    }
    println!("largest error in units of 1e-9 (absolute plus relative): {worst:#.4?}");
    // 100 lines of controller 2 with 18 quantities each, and 100 of controller 1 with 14 each.
    assert_eq!((steps.len(), checked), (200, 100 * 18 + 100 * 14));
}
