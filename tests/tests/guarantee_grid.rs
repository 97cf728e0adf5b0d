//! Guarantees of both controllers over a grid of vehicles, starts, disturbances and step rates; the
//! grid and its margins are in `docs/verification.md`. The feature `exhaustive` flies more of it.

use ctrl_core::config::IntegralAction;
use ctrl_core::controller::ControllerConfig;
use glam::DVec3;
use rayon::prelude::*;
use sil_host::campaign::{Campaign, CampaignOverrides, RunOutcome, fly_run};
use sim::scenario::LoadedScenario;
use system_tests::grid::{Case, Errors, Kind, campaign, check, corners, documented, fly_all};

/// Factor on the number of runs in a campaign's file.
const TIMES: u32 = if cfg!(feature = "exhaustive") { 8 } else { 1 };

/// The part of `D2` that a lasting torque may have under controller 2, which has `M_tau = D2`: the
/// whole would leave it nothing. Noise always has the whole.
const LASTING_TORQUE: f64 = 0.25;

/// Every gain set's campaign and section of the page.
const CAMPAIGNS: [(&str, &str); 3] = [
    ("guarantees-controller-1", "Controller 1"),
    ("guarantees-tilt-recovery", "Controller 2, gains of tilt-recovery"),
    ("guarantees-paper-saturated", "Controller 2, gains of paper-saturated"),
];

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
    let [(name, section), ..] = CAMPAIGNS;
    let mut cases = campaign(name, TIMES);
    let corners = [0.0, 170.0].map(|tilt_deg| corners("paper-robust-adaptive", tilt_deg));
    cases.extend(timed(corners.concat(), 80.0, 60.0));
    check(section, &fly_all(cases), false);
}

#[test]
fn controller_2_with_gentle_gains_keeps_its_guarantees_over_the_grid() {
    let [_, (name, section), _] = CAMPAIGNS;
    let mut cases = campaign(name, TIMES);
    cases.extend(timed(bearable(corners("tilt-recovery", 170.0)), 400.0, 350.0));
    check(section, &fly_all(cases), true);
}

#[test]
fn controller_2_with_the_paper_s_gains_keeps_its_guarantees_over_the_grid() {
    let [.., (name, section)] = CAMPAIGNS;
    let mut cases = campaign(name, TIMES);
    cases.extend(timed(bearable(corners("paper-saturated", 90.0)), 400.0, 350.0));
    check(section, &fly_all(cases), true);
}

#[test]
fn campaigns_judge_by_the_documented_bounds() {
    for (name, section) in CAMPAIGNS {
        for case in campaign(name, 1).into_iter().take(Kind::ALL.len()) {
            let bounds = documented(section, case.disturbance);
            let campaign = case.scenario.guarantees;
            let judges_position = campaign.position_error_max < 1e6;
            let judged = Errors {
                position: campaign.position_error_max,
                attitude: campaign.attitude_error_max,
                tilt: campaign.tilt_error_max,
                heading: campaign.heading_error_max,
            };
            let position = if judges_position { bounds.position } else { judged.position };
            assert_eq!(judged, Errors { position, ..bounds }, "{name}, {:?}", case.disturbance);
        }
    }
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

/// Start of a vehicle that falls for long under gusts: a flight of an earlier sample of this grid.
const LONG_FALL: [&str; 11] = [
    "seed=127927995",
    "vehicle.mass=0.7161522844716944",
    "vehicle.inertia=[0.09566493199862092, 0.07947439595298991, 0.045815952566065674]",
    "initial.position=[98.2858163532339, -3.8519741912848016, 0.7347396965166354]",
    "initial.velocity=[-0.14749174210407706, 0.00032432071286436396, 0.1892890397873319]",
    "initial.rate_body=[-0.22271219465355307, -0.00145838771998021, 0.3236671617703892]",
    "initial.heading_deg=116.01546516923352",
    "initial.tilt_deg=164.01714757922227",
    "initial.tilt_direction_deg=145.7177487015584",
    "disturbance.gust={hold=0.9849886637065357, acceleration=0.05, torque=0.0125}",
    "controller.saturated.step_period=0.002",
];

/// The coupling term of (49) asks for a body rate of `2 c g |G|`, and `G` holds `k1 e_v`: a vehicle
/// that falls fast is told to spin faster than its torque can stop, and falls on. This start is
/// lost with `c = 1e-3` and the paper scenario's gains; a tenth of it recovers.
#[test]
fn less_coupling_saves_a_vehicle_that_falls_for_long() {
    let [lost, saved] = [1e-3, 1e-4].map(|c| {
        let scenario = LoadedScenario::open("paper-saturated", &LONG_FALL.map(str::to_owned));
        let mut scenario = scenario.expect("a scenario").scenario().clone();
        scenario.disturbance.noise = None;
        let mut case = Case { scenario, disturbance: Kind::Gust };
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

/// The campaign of the integral action: what a lasting push leaves.
const INTEGRAL: &str = "guarantees-integral-action";

#[test]
fn integral_action_leaves_less_than_a_centimetre_and_a_tenth_of_a_degree() {
    let open = |runs| CampaignOverrides { runs, first_seed: None };
    let file = Campaign::open(INTEGRAL, &open(None), &[]).expect("a campaign");
    let campaign = Campaign::open(INTEGRAL, &open(Some(file.runs() * TIMES)), &[]);
    let campaign = campaign.expect("a campaign");
    let runs: Vec<_> = (0..campaign.runs()).collect();
    let rows = runs.par_iter().flat_map(|&index| fly_run(&campaign, index).rows);
    let faults: Vec<_> = rows
        .filter(|row| row.outcome != RunOutcome::Held || !row.assumptions_kept)
        .map(|row| {
            format!("{} {}: {}", row.seed, campaign.variants()[row.variant].name, row.reason)
        })
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// From nearly upside down it is a matter of time: the vehicle falls two hundred metres, and comes back with the estimate at the
/// speed that `docs/theory.md` gives.
#[test]
fn after_a_long_fall_the_same_push_leaves_as_little() {
    let campaign =
        Campaign::open(INTEGRAL, &CampaignOverrides::default(), &[]).expect("a campaign");
    let gentle = &campaign.variants()[2];
    let signs = [[1.0, 1.0, 1.0], [-1.0, -1.0, -1.0]];
    let outcomes = signs.par_iter().map(|[x, y, z]| {
        let mut scenario = campaign.scenario(0, gentle).expect("a scenario").scenario().clone();
        let nominal = LoadedScenario::open("tilt-recovery", &["initial.tilt_deg=170".to_owned()]);
        let nominal = nominal.expect("a scenario");
        scenario.vehicle = nominal.scenario().vehicle;
        scenario.initial = nominal.scenario().initial;
        let constant = scenario.disturbance.constant.as_mut().expect("a push");
        constant.acceleration = DVec3::new(0.3 * x, 0.3 * y, 0.05 * z);
        constant.torque = DVec3::splat(0.0125);
        timed(vec![Case { scenario, disturbance: Kind::Constant }], 620.0, 600.0).remove(0).fly()
    });
    for outcome in outcomes.collect::<Vec<_>>() {
        println!("{:?}, {} m away before", outcome.settled, outcome.farthest);
        assert!(outcome.breach.is_none() && outcome.farthest > 150.0, "{:?}", outcome.breach);
        assert!(outcome.settled.position < 0.01 && outcome.settled.attitude < 0.00174);
    }
}

/// The same flights without it: the push leaves what the tables of the page say, half a metre and more.
#[test]
fn without_integral_action_the_same_push_leaves_decimetres() {
    let campaign =
        Campaign::open(INTEGRAL, &CampaignOverrides::default(), &[]).expect("a campaign");
    for variant in campaign.variants() {
        let mut scenario = campaign.scenario(0, variant).expect("a scenario").scenario().clone();
        match &mut scenario.controller {
            ControllerConfig::RobustAdaptive(config) => config.integral = IntegralAction::OFF,
            ControllerConfig::Saturated(config) => config.integral = IntegralAction::OFF,
        }
        let outcome = Case { scenario, disturbance: Kind::Constant }.fly();
        assert!(outcome.settled.position > 0.1, "{}: {:?}", variant.name, outcome.settled);
    }
}

/// A wind that turns at `omega` leaves the error of the linearisation at hover, with `Gp`, `Gv`, `Kp`, `Kv` as in
/// `docs/tune.md`: `|e/d| = omega/|s^3 + Kv s^2 + (Kp + gamma_d Gv) s + gamma_d Gp|` at `s = i omega`.
#[test]
fn a_slowly_turning_wind_leaves_the_predicted_error() {
    for omega in [0.005f64, 0.02] {
        let changes = [
            "duration=1500".to_owned(),
            "guarantees.settle_time=1000".to_owned(),
            "disturbance.constant.acceleration=[0, 0, 0]".to_owned(),
            "disturbance.constant.torque=[0, 0, 0]".to_owned(),
            format!(
                "disturbance.sinusoid={{frequency={}, acceleration=[0.02, 0, 0], torque=[0, 0, 0]}}",
                omega / core::f64::consts::TAU
            ),
        ];
        let scenario = LoadedScenario::open("steady-wind", &changes).expect("a scenario");
        let scenario = scenario.scenario().clone();
        let (gains, known) = (*scenario.controller.cascade(), *scenario.controller.uncertainty());
        let [k1, k2, m1, m2] = [gains.k1, gains.k2, gains.m1, gains.m2].map(f64::from);
        let slope = f64::from(known.disturbance_acceleration / gains.delta_min_translation);
        let gamma = f64::from(scenario.controller.integral().gamma_d);
        let (gp, gv) = (k1 * k2 * m1, k2 * k2 * (m1 + m2) + k1);
        let (kp, kv) = (k1 * m1 + slope * gp, k2 * (m1 + m2) + slope * gv);
        let real = gamma * gp - kv * omega * omega;
        let imaginary = omega * (kp + gamma * gv - omega * omega);
        let predicted = 0.02 * omega / real.hypot(imaginary);
        let flown = Case { scenario, disturbance: Kind::Sinusoid }.fly().settled.position;
        println!("{omega} rad/s: {flown:.5} m, predicted {predicted:.5} m");
        assert!((flown / predicted - 1.0).abs() < 0.05, "{omega}: {flown} for {predicted}");
    }
}
