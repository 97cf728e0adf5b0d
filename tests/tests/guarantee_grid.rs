//! Guarantees of both controllers over a grid of vehicles, starts, disturbances and step rates; the
//! grid and its margins are in `docs/verification.md`. The feature `exhaustive` flies more of it.

use ctrl_core::controller::ControllerConfig;
use system_tests::grid::{Case, Kind, Ranges, check, corners, fly_all, sample};

/// Factor on the everyday number of flights.
const TIMES: usize = if cfg!(feature = "exhaustive") { 8 } else { 1 };

/// The part of `D2` that a lasting torque may have under controller 2, which has `M_tau = D2`: the
/// whole would leave it nothing. Noise always has the whole.
const LASTING_TORQUE: f64 = 0.25;

/// With this duration and time to settle (s).
fn timed(mut cases: Vec<Case>, duration: f64, settle_time: f64) -> Vec<Case> {
    for case in &mut cases {
        case.scenario.duration = duration;
        case.scenario.guarantees.settle_time = settle_time;
    }
    cases
}

/// With as much lasting torque as controller 2 can bear.
fn bearable(cases: Vec<Case>) -> Vec<Case> {
    let each = |case: Case| match case.disturbance {
        Kind::Calm | Kind::Noise => case,
        _ => case.with_torque_fraction(LASTING_TORQUE),
    };
    cases.into_iter().map(each).collect()
}

#[test]
fn controller_1_keeps_its_guarantees_over_the_grid() {
    let ranges = Ranges { tilt_deg: 170.0, speed: 5.0, rate: 3.0, offset: 5.0 };
    let name = "paper-robust-adaptive";
    let mut cases = sample(name, &ranges, 60 * TIMES, 1);
    cases.extend(corners(name, 0.0));
    cases.extend(corners(name, 170.0));
    check("Controller 1", &fly_all(timed(cases, 80.0, 60.0)), false);
}

#[test]
fn controller_2_with_gentle_gains_keeps_its_guarantees_over_the_grid() {
    let ranges = Ranges { tilt_deg: 170.0, speed: 2.0, rate: 0.5, offset: 5.0 };
    let name = "tilt-recovery";
    let mut cases = sample(name, &ranges, 30 * TIMES, 1);
    cases.extend(corners(name, 170.0));
    let cases = timed(bearable(cases), 400.0, 350.0);
    check("Controller 2, gains of tilt-recovery", &fly_all(cases), true);
}

#[test]
fn controller_2_with_the_paper_s_gains_keeps_its_guarantees_over_the_grid() {
    let ranges = Ranges { tilt_deg: 90.0, speed: 2.0, rate: 0.5, offset: 5.0 };
    let name = "paper-saturated";
    let mut cases = sample(name, &ranges, 30 * TIMES, 1);
    cases.extend(corners(name, 90.0));
    let cases = timed(bearable(cases), 400.0, 350.0);
    check("Controller 2, gains of paper-saturated", &fly_all(cases), true);
}

/// A constant torque of `D2 = M_tau` cannot be held against, and the vehicle is lost; what is promised
/// of every tick still holds.
#[test]
fn controller_2_keeps_its_limits_even_where_it_cannot_recover() {
    let cases: Vec<_> = ["paper-saturated", "tilt-recovery"]
        .into_iter()
        .flat_map(|name| timed(corners(name, 170.0), 60.0, 60.0))
        .enumerate()
        .map(|(i, case)| {
            let signs = core::array::from_fn(|bit| if i >> bit & 1 == 1 { -1.0 } else { 1.0 });
            case.disturbed(Kind::Constant, signs, 0.0)
        })
        .collect();
    for outcome in fly_all(cases) {
        assert_eq!(outcome.breach, None, "{}", outcome.case);
        assert!(outcome.farthest.is_finite() && outcome.fastest_turn.is_finite());
    }
}

/// The coupling term of (49) asks for a body rate of `2 c g |G|`, and `G` holds `k1 e_v`: a vehicle
/// that falls fast is told to spin faster than its torque can stop, and falls on. This start is
/// lost with `c = 1e-3` and the paper scenario's gains; a tenth of it recovers.
#[test]
fn less_coupling_saves_a_vehicle_that_falls_for_long() {
    let ranges = Ranges { tilt_deg: 170.0, speed: 2.0, rate: 0.5, offset: 5.0 };
    let case = sample("paper-saturated", &ranges, 500, 1)
        .into_iter()
        .find(|case| case.scenario.seed == 127_927_995)
        .expect("the start of the finding");
    let [lost, saved] = [1e-3, 1e-4].map(|c| {
        let mut case = case.clone().with_torque_fraction(LASTING_TORQUE);
        let ControllerConfig::Saturated(config) = &mut case.scenario.controller else {
            unreachable!("paper-saturated flies controller 2")
        };
        config.cascade.c = c;
        timed(vec![case], 400.0, 350.0).remove(0).fly()
    });
    println!("c = 1e-3: {:?}, {} rad/s", lost.settled, lost.fastest_turn);
    println!("c = 1e-4: {:?}, {} rad/s", saved.settled, saved.fastest_turn);
    assert!(lost.settled.tilt > 1.0 && lost.breach.is_none());
    assert!(saved.settled.tilt < 0.03 && saved.breach.is_none());
}
