//! No start is too steep: both controllers recover on the paper's vehicle from any tilt.
//!
//! Controller 2 has 0.05 N m to turn a vehicle that lies nearly on its back; it falls meanwhile. The
//! auxiliary system has to carry what the torque cannot, without winding up.

use sim::plant::disturbance::Noise;
use system_tests::grid::{Case, Kind, Outcome, STEP_PERIODS, fly_all};

/// Starts of a sweep.
const STARTS: u32 = 12;
/// Length of controller 2's flights (s).
const DURATION: f64 = 400.0;

/// Disturbance of a recovery.
#[derive(Clone, Copy, Debug)]
enum Air {
    /// Nothing.
    Calm,
    /// The paper's: noise within `D1` and `D2`.
    Noise,
    /// A constant push of `D1` on every axis, in another octant for each start, and noise within `D2`.
    Wind,
}

impl Air {
    /// `case` in this air, with the directions of the `i`-th start.
    fn around(self, case: Case, i: u32) -> Case {
        if matches!(self, Self::Calm) {
            return case;
        }
        let noisy = case.clone().disturbed(Kind::Noise, [1.0; 6], 0.0);
        if matches!(self, Self::Noise) {
            return noisy;
        }
        let signs = core::array::from_fn(|bit| if i >> bit & 1 == 1 { -1.0 } else { 1.0 });
        let mut windy = case.disturbed(Kind::Constant, signs, 0.0).with_torque_fraction(0.0);
        let noise = noisy.scenario.disturbance.noise;
        windy.scenario.disturbance.noise = noise.map(|noise| Noise { acceleration: 0.0, ..noise });
        windy
    }
}

/// Starts of the built-in scenario: tilts evenly from 40 to 160 degrees, leaning to
/// directions spread by the golden angle.
fn starts(name: &str, air: Air) -> Vec<Case> {
    let start = |i: u32| {
        let mut case = air.around(Case::built_in(name), i);
        let scenario = &mut case.scenario;
        scenario.initial.tilt_deg = 40.0 + 120.0 * f64::from(i) / f64::from(STARTS - 1);
        scenario.initial.tilt_direction_deg = (137.5 * f64::from(i)) % 360.0;
        scenario.duration = DURATION;
        scenario.seed = 100 + u64::from(i);
        case
    };
    (0..STARTS).map(start).collect()
}

/// Bounds of a sweep: distance from the reference at the end and ever (m).
#[derive(Clone, Copy, Debug)]
struct Bounds {
    end: f64,
    farthest: f64,
}

/// Distance from the reference at the end (m).
fn end(outcome: &Outcome) -> f64 {
    outcome.last_leg[1]
}

/// Flies, prints the extremes, and names every flight that broke a bound.
fn check(name: &str, cases: Vec<Case>, bounds: Bounds) {
    let outcomes = fly_all(cases);
    let most = |of: fn(&Outcome) -> f64| outcomes.iter().map(of).fold(0.0, f64::max);
    println!(
        "{name}: at the end {:.4} ({}) m, farthest {:.1} ({}) m, latest {:.0} s, torque {:.3} N m",
        most(end),
        bounds.end,
        most(|o| o.farthest),
        bounds.farthest,
        most(|o| o.last_far),
        most(|o| o.torque),
    );
    let lost: Vec<_> = outcomes
        .iter()
        .filter(|o| !(o.breach.is_none() && end(o) <= bounds.end && o.farthest <= bounds.farthest))
        .map(|o| format!("{}: {:?}, {} m, {} m", o.case, o.breach, end(o), o.farthest))
        .collect();
    assert!(lost.is_empty(), "{name}, {} not recovered:\n{}", lost.len(), lost.join("\n"));
}

/// Both sets of gains. From 160 degrees the vehicle falls up to 190 m; the paper scenario's gains bring
/// it back at 0.49 m/s (`docs/verification.md`), just in time, and the last metre is still under way.
fn check_both(air: Air, settled: f64) {
    let name = "tilt-recovery";
    check(name, starts(name, air), Bounds { end: settled, farthest: 400.0 });
    let name = "paper-saturated";
    check(name, starts(name, air), Bounds { end: settled + 1.0, farthest: 400.0 });
}

#[test]
fn controller_2_recovers_from_twelve_tilts_in_calm_air() {
    check_both(Air::Calm, 0.001);
}

#[test]
fn controller_2_recovers_from_twelve_tilts_under_noise_at_its_bound() {
    check_both(Air::Noise, 0.06);
}

#[test]
fn controller_2_recovers_from_twelve_tilts_under_a_constant_push_at_its_bound() {
    check_both(Air::Wind, 1.4);
}

#[test]
fn controller_1_recovers_from_170_degrees_in_every_direction() {
    for step_period in STEP_PERIODS {
        let mut cases = starts("paper-robust-adaptive", Air::Noise);
        for case in &mut cases {
            *case = case.clone().stepped(step_period);
            case.scenario.initial.tilt_deg = 170.0;
            case.scenario.duration = 60.0;
        }
        check("paper-robust-adaptive", cases, Bounds { end: 0.005, farthest: 12.0 });
    }
}
