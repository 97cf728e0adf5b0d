//! The transcription against the golden steps.

use std::collections::BTreeMap;

use system_tests::golden::{GoldenStep, golden_steps};
use system_tests::tolerance::Tolerance;
use system_tests::transcription::cascade::{Attitude, Force, coupling};
use system_tests::transcription::{Law, Quaternion, robust_adaptive};

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
        for (name, expected) in step.determined() {
            let actual = &evaluation.quantities[name];
            let entry = worst.entry(name.to_owned()).or_insert(0.0f64);
            *entry = entry.max(PRINTED.ratio(actual, expected));
            PRINTED.check(&format!("line {}, {name}", step.index), actual, expected);
            checked += 1;
        }
    }
    println!("largest error in units of 1e-9 (absolute plus relative): {worst:#.4?}");
    // 100 lines of 18, 50 of 14, and 50 of 14 without the 6 that the line's input does not give.
    assert_eq!((steps.len(), checked), (200, 100 * 18 + 50 * 14 + 50 * (14 - 6)));
}

/// What [`GoldenStep::hides_auxiliary`] says: with the `q_a` that the line's own `q_e` implies, `mu`
/// is (49)'s, and what follows from the listed `q_e`, `w_e`, `mu'` is controller 1's again.
#[test]
fn half_of_the_first_controllers_lines_hide_an_auxiliary_attitude() {
    let steps = golden_steps();
    let hiding: Vec<_> = steps.iter().filter(|step| step.hides_auxiliary()).collect();
    assert_eq!(hiding.len(), 50);
    for step in hiding {
        assert_eq!(step.law(), Law::RobustAdaptive);
        let name = |name| format!("line {}, {name}", step.index);
        let (q_a, mu) = with_hidden_auxiliary(step);
        let angle = 2.0 * q_a.eps.length().asin().to_degrees();
        assert!((6.0..48.0).contains(&angle), "line {}: {angle} degrees", step.index);
        PRINTED.check(&name("mu"), &mu.to_array(), &step.vector("mu").to_array());
        let w_e = step.truth.w - step.vector("mu");
        PRINTED.check(&name("w_e"), &w_e.to_array(), &step.vector("w_e").to_array());
        let eps_e = attitude_error(step).eps;
        let (gains, memory) = (&step.gains, step.memory());
        let mu_dot = step.vector("mu_dot");
        let (tau, a_hat_dot) =
            robust_adaptive::torque(gains, step.truth.w, &memory, eps_e, w_e, mu_dot);
        PRINTED.check(&name("tau"), &tau.to_array(), &step.vector("tau").to_array());
        PRINTED.check(
            &name("a_hat_dot"),
            &a_hat_dot.to_array(),
            &step.vector("a_hat_dot").to_array(),
        );
    }
}

fn attitude_error(step: &GoldenStep) -> Quaternion {
    let [eta, x, y, z] = step.expected["q_e"].as_slice() else { panic!("four components") };
    Quaternion::from([*eta, *x, *y, *z])
}

/// `q_a` from (46) backwards, and `mu` (49) with it, R_d being that of controller 1.
fn with_hidden_auxiliary(step: &GoldenStep) -> (Quaternion, glam::DVec3) {
    let (gains, truth, memory) = (&step.gains, &step.truth, step.memory());
    let force = Force::new(gains, truth, &step.reference, &memory);
    let desired = Attitude::new(force.alpha, gains.g, &step.reference, memory.r2);
    let q_e = attitude_error(step);
    let q_a = truth.q.times(q_e.inverse()).times(desired.quaternion.inverse());
    let q_a = if q_a.eta < 0.0 { q_a.negated() } else { q_a };
    let r_ta = q_a.matrix().transpose() * truth.q.matrix();
    let u = (q_a.matrix() * desired.matrix).transpose() * force.g.value;
    let (pull, _) = coupling(gains.c, &force, (q_e, q_e), (u, u));
    let feed = q_e.matrix().transpose() * desired.rate;
    let mu = pull - gains.k3 * q_e.eps + feed - gains.k5 * (r_ta.transpose() * q_a.eps);
    (q_a, mu)
}
