//! Keeps frames of a flight within a bound on their number, whatever its length.

use super::frame::{Frame, Step};
use sim::observer::Observer;
use sim::tick::Tick;

/// What a frame may differ from the one before, as long as there is room [rad, N].
const STEP_ANGLE: f64 = 0.15;
const STEP_THRUST: f64 = 2.0;
/// Share of the frames that a vehicle at rest would need.
const IDLE_SHARE: f64 = 0.5;
/// Only every so many ticks are looked at: the vehicle hardly moves in between.
const STRIDE: u64 = 10;
/// Growth of the spacing when there is no more room.
const COARSER: f64 = 1.25;

/// Keeps a frame when it is far enough from the last one kept. When there are too many, the spacing
/// grows and the frames kept so far are thinned to it, so that the outcome depends on the flight alone.
#[derive(Clone, Debug)]
pub struct FrameRecorder {
    frames: Vec<Frame>,
    last: Option<Frame>,
    limit: usize,
    step: Step,
    spacing: f64,
}

impl FrameRecorder {
    /// For a flight of `duration` (s), of which at most `limit` frames are kept, three at least.
    #[must_use]
    pub fn new(duration: f64, limit: usize) -> Self {
        let limit = limit.max(3);
        let time = (duration / (IDLE_SHARE * limit as f64)).max(f64::MIN_POSITIVE);
        let step = Step { time, angle: STEP_ANGLE, thrust: STEP_THRUST };
        Self { frames: Vec::with_capacity(limit), last: None, limit, step, spacing: 1.0 }
    }

    /// Takes in the next frame.
    pub fn push(&mut self, frame: Frame) {
        self.last = Some(frame);
        let far = |kept: &Frame| kept.distance(&frame, &self.step) >= self.spacing;
        if self.frames.last().is_none_or(far) {
            if self.frames.len() + 1 >= self.limit {
                self.thin();
            }
            self.frames.push(frame);
        }
    }

    /// Grows the spacing until there is room for the next frame and the last one.
    fn thin(&mut self) {
        while self.frames.len() + 2 > self.limit {
            self.spacing *= COARSER;
            let (step, spacing) = (self.step, self.spacing);
            let mut kept: Option<Frame> = None;
            self.frames.retain(|frame| {
                let far = kept.is_none_or(|kept| kept.distance(frame, &step) >= spacing);
                if far {
                    kept = Some(*frame);
                }
                far
            });
        }
    }

    /// The frames, first and last of the flight among them, in order.
    #[must_use]
    pub fn finish(mut self) -> Vec<Frame> {
        if let Some(last) = self.last.filter(|last| self.frames.last() != Some(last)) {
            self.frames.push(last);
        }
        self.frames
    }
}

impl Observer for FrameRecorder {
    fn observe(&mut self, tick: &Tick) {
        if tick.tick.is_multiple_of(STRIDE) {
            self.push(Frame::of(tick));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3};

    const DURATION: f64 = 100.0;

    /// Turns at 3 rad/s for ten seconds, then stands still.
    fn frame(tick: u32) -> Frame {
        let time = f64::from(tick) * 0.01;
        Frame {
            time,
            position_world: DVec3::new(time, 0.0, 0.0),
            attitude: DQuat::from_rotation_x(3.0 * time.min(10.0)),
            reference_world: DVec3::ZERO,
            thrust: 8.0,
            tilt_error: 0.0,
        }
    }

    fn recorded(limit: usize) -> Vec<Frame> {
        let mut recorder = FrameRecorder::new(DURATION, limit);
        (0..=10_000).for_each(|tick| recorder.push(frame(tick)));
        recorder.finish()
    }

    #[test]
    fn the_bound_holds_and_both_ends_are_kept() {
        for limit in [0, 3, 4, 50, 300, 600] {
            let frames = recorded(limit);
            assert!(frames.len() <= limit.max(3), "{} of {limit}", frames.len());
            assert_eq!(frames.first().map(|frame| frame.time), Some(0.0));
            assert_eq!(frames.last().map(|frame| frame.time), Some(DURATION));
            assert!(frames.is_sorted_by(|a, b| a.time < b.time));
        }
    }

    #[test]
    fn most_frames_are_where_the_vehicle_turns() {
        let frames = recorded(300);
        let turning = frames.iter().filter(|frame| frame.time < 10.0).count();
        assert!(turning > 60, "{turning} of {} in the first tenth", frames.len());
        assert!(frames.len() > 150, "the room is used: {}", frames.len());
    }

    #[test]
    fn a_flight_of_one_tick_has_one_frame() {
        let mut recorder = FrameRecorder::new(0.0, 10);
        recorder.push(frame(0));
        assert_eq!(recorder.finish().len(), 1);
    }
}
