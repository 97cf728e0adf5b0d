//! No start is too steep: both controllers recover on the paper's vehicle from any tilt.
//!
//! Controller 2 has 0.05 N m to turn a vehicle that lies nearly on its back; it falls meanwhile. The
//! auxiliary system has to carry what the torque cannot, without winding up.

use sil_host::plant::disturbance::Noise;
use system_tests::grid::{Case, Kind, Outcome, STEP_PERIODS, fly_all};

/// Starts of a sweep.
const STARTS: u32 = 12;
/// Length of controller 2's flights [s].
const DURATION: f64 = 400.0;

/// What disturbs a recovery.
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

/// The built-in scenario from the starts of issue 2: tilts evenly from 40 to 160 degrees, leaning to
/// directions spread by the golden angle.
fn starts(name: &str, air: Air) -> Vec<Case> {
    let start = |i: u32| {
        let mut case = air.around(Case::built_in(name), i);
        let scenario = &mut case.scenario;
        scenario.initial.tilt_deg = 40.0 + 120.0 * f64::from(i) / f64::from(STARTS - 1);
        scenario.initial.tilt_direction_deg = 137.5 * f64::from(i);
        scenario.duration = DURATION;
        scenario.guarantees.settle_time = DURATION - 20.0;
        scenario.seed = 100 + u64::from(i);
        case
    };
    (0..STARTS).map(start).collect()
}

/// Bounds of a sweep: position error over the last 20 s, distance ever, in metres.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    position: f64,
    farthest: f64,
}

/// Flies, prints the extremes, and names every flight that broke a bound.
fn check(name: &str, cases: Vec<Case>, bounds: Bounds) {
    let outcomes = fly_all(cases);
    let most = |of: fn(&Outcome) -> f64| outcomes.iter().map(of).fold(0.0, f64::max);
    println!(
        "{name}: position {:.4} ({}) m, farthest {:.1} ({}) m, latest {:.0} s, torque {:.3} N m",
        most(|o| o.settled.position),
        bounds.position,
        most(|o| o.farthest),
        bounds.farthest,
        most(|o| o.last_far),
        most(|o| o.torque),
    );
    let lost: Vec<_> = outcomes
        .iter()
        .filter(|o| {
            !(o.breach.is_none()
                && o.settled.position <= bounds.position
                && o.farthest <= bounds.farthest)
        })
        .map(|o| format!("{}: {:?}, {:?}, {} m", o.case, o.breach, o.settled, o.farthest))
        .collect();
    assert!(lost.is_empty(), "{name}, {} not recovered:\n{}", lost.len(), lost.join("\n"));
}

#[test]
fn controller_2_recovers_from_twelve_tilts_in_calm_air() {
    for name in ["paper-saturated", "tilt-recovery"] {
        check(name, starts(name, Air::Calm), Bounds { position: 0.01, farthest: 200.0 });
    }
}

#[test]
fn controller_2_recovers_from_twelve_tilts_under_noise_at_its_bound() {
    for name in ["paper-saturated", "tilt-recovery"] {
        check(name, starts(name, Air::Noise), Bounds { position: 0.06, farthest: 200.0 });
    }
}

#[test]
fn controller_2_recovers_from_twelve_tilts_under_a_constant_push_at_its_bound() {
    for name in ["paper-saturated", "tilt-recovery"] {
        check(name, starts(name, Air::Wind), Bounds { position: 0.6, farthest: 200.0 });
    }
}

#[test]
fn controller_1_recovers_from_170_degrees_in_every_direction() {
    for step_period in STEP_PERIODS {
        let mut cases = starts("paper-robust-adaptive", Air::Noise);
        for case in &mut cases {
            *case = case.clone().stepped(step_period);
            case.scenario.initial.tilt_deg = 170.0;
            case.scenario.duration = 60.0;
            case.scenario.guarantees.settle_time = 40.0;
        }
        check("paper-robust-adaptive", cases, Bounds { position: 0.01, farthest: 20.0 });
    }
}
