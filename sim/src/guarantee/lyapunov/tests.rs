//! The balance along real flights: it holds for the laws as they are, and fails for broken ones.

use ctrl_core::config::SaturatedConfig;
use ctrl_core::controller::StepStatus;
use glam::{DVec3, Vec3};

use super::*;
use crate::guarantee::test_flight::{
    VEHICLE, both, fly_either, robust_adaptive, saturated, unlike,
};
use crate::guarantee::{GuaranteeConfig, Guarantees, Verdict};
use crate::lanes::LANES;
use crate::observer::Observer;
use crate::plant::Disturbance;
use crate::plant::actuation::ActuationConfig;
use crate::tick::Tick;
use ctrl_core::controller::ControllerConfig;

const CONFIG: GuaranteeConfig = GuaranteeConfig {
    settle_time: 0.0,
    position_error_max: 10.0,
    attitude_error_max: 3.0,
    tilt_error_max: 3.0,
    heading_error_max: 3.0,
    lyapunov_window: 0.5,
    state_error: None,
};

/// First words of the rows of V.
const LYAPUNOV: [&str; 6] =
    ["Lyapunov", "increase of V", "disturbance", "time outside", "perturbation", "ticks excluded"];

/// The monitor's rows after a flight that is tampered with.
fn rows(config: &ControllerConfig, seconds: f64, tamper: impl FnMut(&mut Tick)) -> Vec<Verdict> {
    rows_believing(config, config, seconds, tamper)
}

/// The rows of monitors that take the law that flies for `believed`.
fn rows_believing(
    believed: &ControllerConfig,
    config: &ControllerConfig,
    seconds: f64,
    tamper: impl FnMut(&mut Tick),
) -> Vec<Verdict> {
    let mut monitors = Guarantees::new(&CONFIG, believed, &VEHICLE, &ActuationConfig::default());
    fly_either(config, seconds, tamper, |tick| monitors.observe(tick));
    let mut rows = monitors.verdicts();
    rows.retain(|row| {
        row.name.starts_with("V ") || LYAPUNOV.iter().any(|it| row.name.starts_with(it))
    });
    rows
}

fn row<'a>(rows: &'a [Verdict], start: &str) -> &'a Verdict {
    rows.iter().find(|row| row.name.starts_with(start)).unwrap()
}

#[test]
fn v_obeys_its_balance_under_both_laws() {
    for step_period in [0.0005, 0.001, 0.002] {
        for config in both(step_period) {
            let rows = rows(&config, 12.0, |_| {});
            assert!(rows.iter().all(|row| row.pass), "{step_period}: {rows:#?}");
            assert_eq!(row(&rows, "ticks").observed, Some(0.0));
            let [start, end] = ["V at the start", "V at the end"].map(|name| row(&rows, name));
            assert!(end.observed < start.observed);
            assert!(row(&rows, "increase of V over a window").observed.unwrap() < 0.0);
        }
    }
}

#[test]
fn v_obeys_its_balance_with_unlike_axes_and_not_that_of_other_gains_of_one_axis() {
    for config in both(0.001).map(unlike) {
        let rows = rows(&config, 12.0, |_| {});
        assert!(rows.iter().all(|row| row.pass), "{rows:#?}");
        assert_eq!(row(&rows, "ticks").observed, Some(0.0));
        for axis in 0..3 {
            let mut believed = config;
            // The heading starts right: little of W is its.
            believed.cascade_mut().k3[axis] *= [2.0, 2.0, 8.0][axis];
            let rows = rows_believing(&believed, &config, 3.0, |_| {});
            assert!(!row(&rows, "Lyapunov balance residual").pass, "k3 of axis {axis}: {rows:#?}");
        }
    }
}

/// Largest excess over the balance of a flight that is tampered with, which must be a failure.
fn excess(config: &ControllerConfig, tamper: impl FnMut(&mut Tick)) -> f64 {
    let rows = rows(config, 3.0, tamper);
    let row = row(&rows, "Lyapunov balance residual");
    assert!(!row.pass, "{row:?}");
    row.observed.unwrap()
}

#[test]
fn a_law_with_the_wrong_sign_of_its_rate_feedback_breaks_the_balance() {
    let [first, second] = both(0.001);
    let flip = |gain: f32| {
        move |tick: &mut Tick| {
            tick.output.wrench.torque_body += 2.0 * gain * tick.intermediates.rate_error;
        }
    };
    assert!(excess(&first, flip(0.5)) > 0.1);
    assert!(excess(&second, flip(4.0 * 0.06)) > 1e-3);
}

#[test]
fn an_adaptation_that_runs_backwards_breaks_the_balance() {
    let [first, _] = both(0.001);
    // The shipped gain moves theta_hat by less than its report can show.
    let second = ControllerConfig::Saturated(SaturatedConfig {
        gamma2: Vec3::splat(10.0),
        ..saturated(0.001)
    });
    assert!(rows(&second, 3.0, |_| {}).iter().all(|row| row.pass));
    excess(&first, |tick| {
        tick.estimates.inertia = Vec3::splat(0.12) - tick.estimates.inertia;
    });
    excess(&first, |tick| {
        tick.estimates.inverse_mass = 2.0 / 0.75 - tick.estimates.inverse_mass;
    });
    excess(&second, |tick| {
        let start = Vec3::splat(1.0 / 0.06);
        tick.estimates.inverse_inertia = 2.0 * start - tick.estimates.inverse_inertia;
    });
}

#[test]
fn a_lost_torque_axis_or_a_wrong_virtual_rate_breaks_the_balance() {
    for config in both(0.001) {
        excess(&config, |tick| tick.output.wrench.torque_body.x = 0.0);
        excess(&config, |tick| tick.intermediates.mu *= 1.05);
    }
}

#[test]
fn a_disturbance_that_nobody_admits_breaks_the_balance() {
    for config in both(0.001) {
        excess(&config, |tick| {
            // Along w_e, so that it feeds the error; the tick does not show it.
            let push = tick.intermediates.rate_error.normalize_or_zero();
            tick.output.wrench.torque_body += 0.02 * push;
        });
    }
}

#[test]
fn a_disturbance_beyond_its_bound_is_seen_as_such() {
    for config in both(0.001) {
        let rows = rows(&config, 3.0, |tick| {
            tick.disturbance.torque_body += DVec3::new(0.3, 0.0, 0.0);
        });
        assert!(row(&rows, "Lyapunov balance residual").pass, "it is in the balance");
        assert!(!row(&rows, "disturbance term").pass);
    }
}

#[test]
fn steps_outside_the_proof_are_counted_and_not_judged() {
    let [first, _] = both(0.001);
    let rows = rows(&first, 1.0, |tick| {
        if tick.tick == 500 {
            tick.output.status |= StepStatus::SIGN_FLIPPED;
            tick.output.wrench.torque_body = Vec3::splat(3.0);
        }
    });
    assert!(row(&rows, "Lyapunov balance residual").pass, "{rows:#?}");
    assert_eq!(row(&rows, "ticks").observed, Some(1.0));
}

/// The balance over the first tick of each block of a flight.
fn balances(
    config: &ControllerConfig,
    seconds: f64,
    tamper: impl FnMut(&mut Tick),
    mut see: impl FnMut(balance::Balance),
) {
    let mut evaluator = Evaluator::new(config, &VEHICLE);
    let (mut block, mut ticks) = (EvaluatedBlock::default(), Vec::new());
    fly_either(config, seconds, tamper, |tick| {
        ticks.push(*tick);
        if ticks.len() == LANES {
            block.ticks.gather(&ticks, Vec3::ZERO);
            evaluator.evaluate_block(&block.ticks, &mut block.v);
            see(balance::Balance::new(&evaluator.parameters, &block, &block));
            ticks.clear();
        }
    });
}

/// Of the first tick.
fn first(lanes: crate::lanes::Scalars) -> f64 {
    lanes.to_array()[0]
}

#[test]
fn with_the_true_mass_and_in_still_air_the_model_term_is_only_the_hold() {
    let peak = |step_period| {
        let mut config = robust_adaptive(step_period);
        config.initial.mass = VEHICLE.mass as f32;
        config.cascade.gamma1 = 0.0;
        let config = ControllerConfig::RobustAdaptive(config);
        let (mut model, mut decrease) = (0.0f64, 0.0f64);
        let still = |tick: &mut Tick| tick.disturbance = Disturbance::default();
        balances(&config, 3.0, still, |balance| {
            model = model.max(first(balance.model).abs());
            decrease = decrease.max(first(balance.decrease));
        });
        model / decrease
    };
    // The same flight with the mass 12 % off has a term of 3 %.
    let (coarse, fine) = (peak(0.002), peak(0.0005));
    assert!(fine < 2e-3, "{fine}");
    assert!((3.0..5.0).contains(&(coarse / fine)), "{coarse} {fine}");
}

#[test]
fn the_allowance_for_the_hold_shrinks_with_the_step() {
    let total = |config: &ControllerConfig| {
        let mut sum = 0.0;
        balances(config, 2.0, |_| {}, |balance| sum += first(balance.hold));
        sum
    };
    for (coarse, fine) in both(0.002).iter().zip(&both(0.0005)) {
        let ratio = total(coarse) / total(fine);
        assert!((3.0..5.0).contains(&ratio), "a quarter of the step, a quarter in all: {ratio}");
    }
}
