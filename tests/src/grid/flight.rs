//! Flies cases on every core and collects what the plant's truth says.

use std::sync::Mutex;
use std::thread;

use sim::guarantee::tracking::{heading_error, rotation_angle, tilt_error};
use sim::observer::Observer;
use sim::tick::Tick;

use super::Case;
use super::limits::{Breach, Limits};

/// Over the end of a flight of this length (s) a vehicle that is still far must come closer.
pub const LAST_LEG: f64 = 50.0;

/// Result of a flight.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The flight.
    pub case: Case,
    /// The first tick, if any, at which a bound did not hold.
    pub breach: Option<Breach>,
    /// Largest distance from the reference (m).
    pub farthest: f64,
    /// Largest body rate (rad/s).
    pub fastest_turn: f64,
    /// Largest magnitude of a torque component (N m).
    pub torque: f64,
    /// Latest time at which the distance from the reference was a metre or more (s).
    pub last_far: f64,
    /// Largest errors after settling.
    pub settled: Errors,
    /// Distance from the reference at the start and at the end of the [`LAST_LEG`] (m).
    pub last_leg: [f64; 2],
}

/// Tracking errors of the plant's truth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Distance from the reference (m).
    pub position: f64,
    /// Angle of `q_e` (rad).
    pub attitude: f64,
    /// Angle between body z and the reference's `b3d` (rad).
    pub tilt: f64,
    /// Angle between body y and the reference's `b2d` (rad).
    pub heading: f64,
}

impl Errors {
    /// The larger of each; NaN wins.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        let max = |a: f64, b: f64| if a > b || a.is_nan() { a } else { b };
        Self {
            position: max(self.position, other.position),
            attitude: max(self.attitude, other.attitude),
            tilt: max(self.tilt, other.tilt),
            heading: max(self.heading, other.heading),
        }
    }

    /// `true` if none exceeds its bound.
    #[must_use]
    pub fn within(&self, bounds: &Self) -> bool {
        self.position <= bounds.position
            && self.attitude <= bounds.attitude
            && self.tilt <= bounds.tilt
            && self.heading <= bounds.heading
    }
}

/// Judge of one flight.
struct FlightJudge {
    limits: Limits,
    settle_time: f64,
    last_leg: f64,
    outcome: Outcome,
}

impl Observer for FlightJudge {
    fn observe(&mut self, tick: &Tick) {
        let Tick { time, truth, reference, output, .. } = tick;
        let outcome = &mut self.outcome;
        if outcome.breach.is_none() {
            outcome.breach = self.limits.breach(tick);
        }
        let distance = truth.position_world.distance(reference.position_world.as_dvec3());
        outcome.farthest = outcome.farthest.max(distance);
        outcome.fastest_turn = outcome.fastest_turn.max(truth.rate_body.length());
        let torque = output.wrench.torque_body.abs().max_element();
        outcome.torque = outcome.torque.max(torque.into());
        if distance >= 1.0 {
            outcome.last_far = *time;
        }
        if *time <= self.last_leg {
            outcome.last_leg[0] = distance;
        }
        outcome.last_leg[1] = distance;
        if *time >= self.settle_time {
            outcome.settled = outcome.settled.max(Errors {
                position: distance,
                attitude: rotation_angle(tick.intermediates.attitude_error.as_dquat()),
                tilt: tilt_error(truth.attitude, reference),
                heading: heading_error(truth.attitude, reference),
            });
        }
    }
}

impl Case {
    /// Flies to the end.
    ///
    /// # Panics
    /// When controller or trajectory are refused.
    #[must_use]
    pub fn fly(self) -> Outcome {
        let scenario = &self.scenario;
        let (duration, ticks) = (scenario.duration, scenario.ticks());
        let mut flight = scenario.flight().unwrap_or_else(|error| panic!("{self}: {error}"));
        let mut judge = FlightJudge {
            limits: Limits::new(&scenario.controller),
            settle_time: scenario.guarantees.settle_time,
            last_leg: duration - LAST_LEG,
            outcome: Outcome {
                case: self,
                breach: None,
                farthest: 0.0,
                fastest_turn: 0.0,
                torque: 0.0,
                last_far: 0.0,
                settled: Errors::default(),
                last_leg: [0.0; 2],
            },
        };
        flight.observe(ticks, &mut judge);
        judge.outcome
    }
}

/// Flies every case, on as many threads as there are cores; outcomes in the order of the cases.
///
/// # Panics
/// When a case cannot be flown at all.
#[must_use]
pub fn fly_all(cases: Vec<Case>) -> Vec<Outcome> {
    let waiting = Mutex::new(cases.into_iter().enumerate());
    let done = Mutex::new(Vec::new());
    let next = || waiting.lock().unwrap().next();
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some((index, case)) = next() {
                    let outcome = case.fly();
                    done.lock().unwrap().push((index, outcome));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap();
    done.sort_by_key(|&(index, _)| index);
    done.into_iter().map(|(_, outcome)| outcome).collect()
}
