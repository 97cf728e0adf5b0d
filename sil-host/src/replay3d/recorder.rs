//! Recorder of a replay: keeps ticks of a flight within a bound on their number, whatever its length.

use sim::guarantee::tracking::rotation_angle;
use sim::observer::Observer;
use sim::tick::Tick;

/// Largest difference between two kept ticks, as long as the bound allows (rad, N).
const STEP_ANGLE: f64 = 0.15;
const STEP_THRUST: f64 = 2.0;
/// Share of the kept ticks that a vehicle at rest would need.
const IDLE_SHARE: f64 = 0.5;
/// Ticks per tick that is considered: the vehicle hardly moves in between.
const STRIDE: u64 = 10;
/// Growth of the spacing when the bound is reached.
const COARSER: f64 = 1.25;

/// Keeps a tick when it is far enough from the last one kept. When there are too many, the spacing grows
/// and the ticks kept so far are thinned to it, so that the result depends on the flight alone.
#[derive(Clone, Debug)]
pub struct ReplayRecorder {
    kept: Vec<Tick>,
    last: Option<Tick>,
    limit: usize,
    step: Step,
    spacing: f64,
}

/// Differences between two ticks that count as one step: what the eye can follow along a straight line.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// (s)
    time: f64,
    /// (rad)
    angle: f64,
    /// (N)
    thrust: f64,
}

impl Step {
    /// Distance between two ticks in steps of time, of attitude and of thrust.
    fn distance(&self, a: &Tick, b: &Tick) -> f64 {
        let turned = rotation_angle(a.truth.attitude.conjugate() * b.truth.attitude);
        let [thrust_a, thrust_b] = [a, b].map(|tick| f64::from(tick.output.wrench.thrust));
        (a.time - b.time).abs() / self.time
            + turned / self.angle
            + (thrust_a - thrust_b).abs() / self.thrust
    }
}

impl ReplayRecorder {
    /// For a flight of `duration` (s), of which at most `limit` ticks are kept, at least three.
    #[must_use]
    pub fn new(duration: f64, limit: usize) -> Self {
        let limit = limit.max(3);
        let time = (duration / (IDLE_SHARE * limit as f64)).max(f64::MIN_POSITIVE);
        let step = Step { time, angle: STEP_ANGLE, thrust: STEP_THRUST };
        Self { kept: Vec::with_capacity(limit), last: None, limit, step, spacing: 1.0 }
    }

    fn push(&mut self, tick: &Tick) {
        self.last = Some(*tick);
        let far = |kept: &Tick| self.step.distance(kept, tick) >= self.spacing;
        if self.kept.last().is_none_or(far) {
            if self.kept.len() + 1 >= self.limit {
                self.thin();
            }
            self.kept.push(*tick);
        }
    }

    /// Grows the spacing until the next tick and the last one fit within the bound.
    fn thin(&mut self) {
        while self.kept.len() + 2 > self.limit {
            self.spacing *= COARSER;
            let (step, spacing) = (self.step, self.spacing);
            let mut previous: Option<Tick> = None;
            self.kept.retain(|tick| {
                let far = previous.is_none_or(|it| step.distance(&it, tick) >= spacing);
                if far {
                    previous = Some(*tick);
                }
                far
            });
        }
    }

    /// The kept ticks in order, among them the first and the last one considered.
    #[must_use]
    pub fn finish(mut self) -> Vec<Tick> {
        if let Some(last) = self.last
            && self.kept.last().is_some_and(|kept| kept.tick != last.tick)
        {
            self.kept.push(last);
        }
        self.kept
    }
}

impl Observer for ReplayRecorder {
    fn observe(&mut self, tick: &Tick) {
        if tick.tick.is_multiple_of(STRIDE) {
            self.push(tick);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3};
    use sim::guarantee::test_flight::{both, sample};

    const DURATION: f64 = 100.0;

    /// A vehicle that turns at 3 rad/s for ten seconds, then stands still.
    fn turning(start: &Tick, tick: u32) -> Tick {
        let (mut turned, time) = (*start, f64::from(tick) * 0.01);
        turned.tick = tick.into();
        turned.time = time;
        turned.truth.position_world = DVec3::new(time, 0.0, 0.0);
        turned.truth.attitude = DQuat::from_rotation_x(3.0 * time.min(10.0));
        turned
    }

    fn recorded(limit: usize) -> Vec<Tick> {
        let start = sample(&both(1e-3)[0]);
        let mut recorder = ReplayRecorder::new(DURATION, limit);
        (0..=10_000).for_each(|tick| recorder.push(&turning(&start, tick)));
        recorder.finish()
    }

    #[test]
    fn the_bound_holds_and_both_ends_are_kept() {
        for limit in [0, 3, 4, 50, 300, 600] {
            let ticks = recorded(limit);
            assert!(ticks.len() <= limit.max(3), "{} of {limit}", ticks.len());
            assert_eq!(ticks.first().map(|tick| tick.time), Some(0.0));
            assert_eq!(ticks.last().map(|tick| tick.time), Some(DURATION));
            assert!(ticks.is_sorted_by(|a, b| a.time < b.time));
        }
    }

    #[test]
    fn most_ticks_are_where_the_vehicle_turns() {
        let ticks = recorded(300);
        let turning = ticks.iter().filter(|tick| tick.time < 10.0).count();
        assert!(turning > 60, "{turning} of {} in the first tenth", ticks.len());
        assert!(ticks.len() > 150, "the bound is used: {}", ticks.len());
    }

    #[test]
    fn a_flight_of_one_tick_keeps_it() {
        let mut recorder = ReplayRecorder::new(0.0, 10);
        recorder.push(&sample(&both(1e-3)[0]));
        assert_eq!(recorder.finish().len(), 1);
    }
}
