//! Monitors that work on blocks of ticks: tracking, sets of the estimates, and the Lyapunov function.

use super::angle::Angles;
use super::estimates::EstimateSets;
use super::lyapunov::{EvaluatedBlock, LyapunovMonitor};
use super::tracking::Tracking;
use super::verdict::Verdict;
use crate::observer::Observer;
use crate::tick::Tick;

/// Collects ticks and has them observed a block at a time.
#[derive(Clone, Debug)]
pub(super) struct BlockMonitors {
    /// The block that is being filled, and the one before it.
    blocks: Box<[EvaluatedBlock; 2]>,
    /// Which of them is being filled.
    filling: usize,
    tracking: Tracking,
    law: Option<(EstimateSets, LyapunovMonitor)>,
}

impl BlockMonitors {
    /// Without `law` the controller is none of the paper's.
    pub fn new(tracking: Tracking, law: Option<(EstimateSets, LyapunovMonitor)>) -> Self {
        Self { blocks: Box::default(), filling: 0, tracking, law }
    }

    /// The monitor of V, under a law of the paper.
    pub fn lyapunov(&mut self) -> Option<&mut LyapunovMonitor> {
        self.law.as_mut().map(|(_, lyapunov)| lyapunov)
    }

    /// Rows of the table so far: of the estimates, of tracking, and of V.
    pub fn verdicts(&self) -> [Vec<Verdict>; 3] {
        let mut concluded = self.clone();
        concluded.conclude();
        let Self { tracking, law, .. } = concluded;
        let rows = law.map(|(estimates, lyapunov)| (estimates.verdicts(), lyapunov.verdicts()));
        let (estimates, lyapunov) = rows.unwrap_or_default();
        [estimates, tracking.verdicts(), lyapunov]
    }

    /// Observes the block that is being filled, and begins the next.
    fn complete(&mut self) {
        let (first, second) = self.blocks.split_at_mut(1);
        let (latest, before) = match self.filling {
            0 => (&mut first[0], &mut second[0]),
            _ => (&mut second[0], &mut first[0]),
        };
        let due = self.tracking.due(&latest.ticks);
        self.tracking.observe(&latest.ticks, due);
        if let Some((estimates, lyapunov)) = &mut self.law {
            estimates.observe(&latest.ticks);
            lyapunov.evaluate(latest);
            let (sine, cosine) = (latest.v.lengths.attitude_error, latest.v.attitude.error.w.abs());
            self.tracking.observe_attitude(&latest.ticks, due, Angles { sine, cosine });
            lyapunov.judge(before, latest, before.ticks.count());
        }
        before.ticks.begin(&latest.ticks);
        self.filling ^= 1;
    }

    /// Observes what has been collected, up to the latest tick.
    fn conclude(&mut self) {
        if self.blocks[self.filling].ticks.count() > 0 {
            self.complete();
        }
        let last = &self.blocks[self.filling ^ 1];
        if let Some((_, lyapunov)) = &mut self.law {
            lyapunov.judge(last, last, last.ticks.count().saturating_sub(1));
        }
    }
}

impl Observer for BlockMonitors {
    #[inline]
    fn observe(&mut self, tick: &Tick) {
        let filling = &mut self.blocks[self.filling].ticks;
        filling.push(tick);
        if filling.is_full() {
            self.complete();
        }
    }
}
