//! Monitors that work on blocks of ticks: tracking, sets of the estimates, and the Lyapunov function.

use glam::Vec3;

use super::angle::Angles;
use super::estimates::EstimateSets;
use super::lyapunov::{EvaluatedBlock, LyapunovMonitor};
use super::tracking::Tracking;
use super::verdict::Verdict;
use crate::lanes::LANES;
use crate::observer::Observer;
use crate::tick::Tick;

/// Collects ticks and has them observed a block at a time.
#[derive(Clone, Debug)]
pub(super) struct BlockMonitors {
    /// Ticks that make no block yet.
    pending: Vec<Tick>,
    /// The block observed last, and room for the next.
    blocks: Box<[EvaluatedBlock; 2]>,
    /// Which of them is for the next.
    next: usize,
    /// `mu` of the latest tick of a block.
    latest_mu: Vec3,
    tracking: Tracking,
    law: Option<(EstimateSets, LyapunovMonitor)>,
}

impl BlockMonitors {
    /// Without `law` the controller is none of the paper's.
    pub fn new(tracking: Tracking, law: Option<(EstimateSets, LyapunovMonitor)>) -> Self {
        let (pending, blocks) = (Vec::new(), Box::default());
        Self { pending, blocks, next: 0, latest_mu: Vec3::ZERO, tracking, law }
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

    /// Observes a block of ticks.
    fn observe_block(&mut self, ticks: &[Tick]) {
        let (first, second) = self.blocks.split_at_mut(1);
        let (latest, before) = match self.next {
            0 => (&mut first[0], &mut second[0]),
            _ => (&mut second[0], &mut first[0]),
        };
        latest.ticks.gather(ticks, self.latest_mu);
        let due = self.tracking.due(&latest.ticks);
        self.tracking.observe(&latest.ticks, due);
        if let Some((estimates, lyapunov)) = &mut self.law {
            estimates.observe(&latest.ticks);
            lyapunov.evaluate(latest);
            let (sine, cosine) = (latest.v.lengths.attitude_error, latest.v.attitude.error.w.abs());
            self.tracking.observe_attitude(&latest.ticks, due, Angles { sine, cosine });
            lyapunov.judge(before, latest, before.ticks.count());
        }
        self.latest_mu = ticks.last().map_or(Vec3::ZERO, |it| it.intermediates.mu);
        self.next ^= 1;
    }

    /// Observes what has been collected, up to the latest tick.
    fn conclude(&mut self) {
        if !self.pending.is_empty() {
            let pending = std::mem::take(&mut self.pending);
            self.observe_block(&pending);
        }
        let last = &self.blocks[self.next ^ 1];
        if let Some((_, lyapunov)) = &mut self.law {
            lyapunov.judge(last, last, last.ticks.count().saturating_sub(1));
        }
    }
}

impl Observer for BlockMonitors {
    #[inline]
    fn observe(&mut self, tick: &Tick) {
        self.pending.push(*tick);
        if self.pending.len() == LANES {
            let mut pending = std::mem::take(&mut self.pending);
            self.observe_block(&pending);
            pending.clear();
            self.pending = pending;
        }
    }

    fn observe_ticks(&mut self, ticks: &[Tick]) {
        if self.pending.is_empty() && ticks.len() == LANES {
            self.observe_block(ticks);
        } else {
            ticks.iter().for_each(|tick| self.observe(tick));
        }
    }
}
