//! Rate groups: releases, deadlines, the failsafe after repeated overruns, the watchdog.
//!
//! Pure: time enters as a free-running 32-bit microsecond count (it may wrap), decisions leave as
//! values. The control group runs at every tick and calls [`RateLoop::tick`] first; each group
//! reports [`RateLoop::finish`] when its work is done. A group is late when it has not finished
//! its deadline after its release; every miss is one overrun. A run of overruns without a timely
//! finish between them, as long as configured, calls for the failsafe output.
//!
//! In lock step the host requests each tick ([`RateLoop::step`]): the time between two ticks
//! then counts as one period, whatever it was.

use core::num::NonZeroU32;

use link::{GROUPS, GroupHealth};

/// The rate groups, most urgent first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Group {
    /// Control law and rotor outputs, every tick.
    Control,
    /// Decodes what has arrived over the link.
    StateInput,
    /// Sends what the control group saw and did.
    Telemetry,
    /// Log, statistics, watchdog.
    Housekeeping,
}

impl Group {
    /// All groups, most urgent first.
    pub const ALL: [Self; GROUPS] =
        [Self::Control, Self::StateInput, Self::Telemetry, Self::Housekeeping];
}

/// Period and deadline of one rate group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GroupConfig {
    /// Ticks from one release to the next, at least 1; exactly 1 for the control group.
    pub period: u32,
    /// Tick of the first release, less than `period`; spreads the groups over the ticks.
    pub phase: u32,
    /// Time from release to finish (us), at most the period.
    pub deadline: u32,
}

/// Configuration of a [`RateLoop`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RateLoopConfig {
    /// Control ticks per second (Hz): 500 to 2000, a divisor of 1,000,000.
    pub control_rate: u32,
    /// In the order of [`Group::ALL`].
    pub groups: [GroupConfig; GROUPS],
    /// This many overruns of one group in a row lead to the failsafe output; at least 1.
    pub overruns_to_failsafe: u32,
}

/// Error of [`RateLoop::new`] and [`RateLoop::set_period`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RateLoopError {
    /// `control_rate` is not in 500..=2000 Hz or does not divide a million.
    ControlRate(u32),
    /// The control group's period is not one tick, or another group's period is zero.
    Period(Group),
    /// The phase is not below the period.
    Phase(Group),
    /// The deadline is zero or above the period.
    Deadline(Group),
    /// `overruns_to_failsafe` is zero.
    OverrunsToFailsafe,
}

/// The groups that are released at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Due(u8);

impl Due {
    /// `true` if `group` is released.
    #[must_use]
    pub fn contains(self, group: Group) -> bool {
        self.0 & (1 << group as u8) != 0
    }

    fn insert(&mut self, group: Group) {
        self.0 |= 1 << group as u8;
    }
}

/// Book-keeping of one group.
#[derive(Clone, Copy, Debug, Default)]
struct GroupRecord {
    /// Ticks until the next release.
    countdown: u32,
    /// Time of the release that has not finished yet (us).
    released: Option<u32>,
    /// That release has already been counted as an overrun.
    counted: bool,
    /// Overruns since the last timely finish.
    in_a_row: u32,
    /// Timely finishes and overruns since the watchdog was last fed.
    met: u32,
    missed: u32,
    health: GroupHealth,
}

impl GroupRecord {
    /// Counts one tick; true when a release is due.
    fn count_down(&mut self, period: u32) -> bool {
        let due = self.countdown == 0;
        self.countdown = if due { period } else { self.countdown }.saturating_sub(1);
        due
    }

    fn overrun(&mut self) {
        self.counted = true;
        self.in_a_row = self.in_a_row.saturating_add(1);
        self.missed = self.missed.saturating_add(1);
        self.health.overruns = self.health.overruns.saturating_add(1);
    }

    fn is_late(&self, now: u32, deadline: u32) -> bool {
        self.released.is_some_and(|released| now.wrapping_sub(released) > deadline)
    }

    /// Releases the group, unless its last release has not finished: that one is missed.
    fn release(&mut self, now: u32) -> bool {
        if self.released.is_some() {
            self.overrun();
            return false;
        }
        self.released = Some(now);
        self.counted = false;
        true
    }

    fn finish(&mut self, now: u32, deadline: u32) {
        let late = self.is_late(now, deadline);
        let Some(released) = self.released.take() else { return };
        let time = now.wrapping_sub(released);
        self.health.worst_time = self.health.worst_time.max(time);
        self.health.completed = self.health.completed.wrapping_add(1);
        if late && !self.counted {
            self.overrun();
        } else if !late && !self.counted {
            self.in_a_row = 0;
            self.met = self.met.saturating_add(1);
        }
    }
}

/// Releases and deadlines of all groups; see the module's documentation.
#[derive(Clone, Debug)]
pub struct RateLoop {
    config: RateLoopConfig,
    tick_period: NonZeroU32,
    tick: u32,
    last_tick: Option<u32>,
    /// Time that does not count (us).
    skipped: u32,
    records: [GroupRecord; GROUPS],
    lost_ticks: u32,
}

impl RateLoop {
    /// Checks the configuration.
    ///
    /// # Errors
    /// Names the first value that is out of its documented range.
    pub const fn new(config: RateLoopConfig) -> Result<Self, RateLoopError> {
        if config.control_rate < 500
            || config.control_rate > 2000
            || !1_000_000u32.is_multiple_of(config.control_rate)
        {
            return Err(RateLoopError::ControlRate(config.control_rate));
        }
        if config.overruns_to_failsafe == 0 {
            return Err(RateLoopError::OverrunsToFailsafe);
        }
        let Some(tick_period) = NonZeroU32::new(1_000_000 / config.control_rate) else {
            return Err(RateLoopError::ControlRate(config.control_rate));
        };
        let mut records = [EMPTY_RECORD; GROUPS];
        let mut i = 0;
        while i < GROUPS {
            let group = &config.groups[i];
            if let Err(error) = check_group(Group::ALL[i], group, tick_period.get()) {
                return Err(error);
            }
            records[i].countdown = group.phase;
            i += 1;
        }
        let (tick, last_tick, skipped, lost_ticks) = (0, None, 0, 0);
        Ok(Self { config, tick_period, tick, last_tick, skipped, records, lost_ticks })
    }

    /// Begins a tick at `now` (us): counts what is late and returns what is due.
    ///
    /// The control group calls it first of all, once per tick; a tick that comes one and a half
    /// periods or more after the last one shows that ticks were lost, which are control overruns.
    pub fn tick(&mut self, now: u32) -> Due {
        let now = now.wrapping_sub(self.skipped);
        let lost = self.lost_since_last_tick(now);
        self.lost_ticks = self.lost_ticks.saturating_add(lost);
        self.last_tick = Some(now);
        let mut due = Due::default();
        // wcet: at most 4 iterations
        for group in Group::ALL {
            let config = self.config.groups[group as usize];
            let record = &mut self.records[group as usize];
            if !record.counted && record.is_late(now, config.deadline) {
                record.overrun();
            }
            if group == Group::Control && lost > 0 {
                record.overrun();
            }
            if record.count_down(config.period) && record.release(now) {
                due.insert(group);
            }
        }
        self.tick = self.tick.wrapping_add(1);
        due
    }

    /// As [`tick`](Self::tick), one period after the last one whenever that was.
    pub fn step(&mut self, now: u32) -> Due {
        if let Some(last) = self.last_tick {
            self.skipped = now.wrapping_sub(last).wrapping_sub(self.tick_period.get());
        }
        self.tick(now)
    }

    /// Excludes `time` (us) that has just passed: in lock step, that of the wire.
    pub fn skip(&mut self, time: u32) {
        self.skipped = self.skipped.wrapping_add(time);
    }

    /// The next tick begins a new row, after a pause of any length.
    pub fn resume(&mut self) {
        self.last_tick = None;
    }

    fn lost_since_last_tick(&self, now: u32) -> u32 {
        let Some(last) = self.last_tick else { return 0 };
        let elapsed = now.wrapping_sub(last);
        (elapsed.saturating_add(self.tick_period.get() / 2) / self.tick_period).saturating_sub(1)
    }

    /// Ends the work of `group` at `now` (us); without a release it does nothing.
    pub fn finish(&mut self, group: Group, now: u32) {
        let now = now.wrapping_sub(self.skipped);
        let deadline = self.config.groups[group as usize].deadline;
        self.records[group as usize].finish(now, deadline);
    }

    /// `true` if `group` has been released and not finished.
    #[must_use]
    pub fn is_due(&self, group: Group) -> bool {
        self.records[group as usize].released.is_some()
    }

    /// `true` if a group has overrun so often in a row that the outputs must go to failsafe.
    #[must_use]
    pub fn failsafe_required(&self) -> bool {
        // wcet: at most 4 iterations
        self.records.iter().any(|record| record.in_a_row >= self.config.overruns_to_failsafe)
    }

    /// `true` if the latest control period was an overrun.
    #[must_use]
    pub fn control_overran(&self) -> bool {
        self.records[Group::Control as usize].in_a_row > 0
    }

    /// Changes period (ticks) and deadline (us) of `group`, from its next release on.
    ///
    /// # Errors
    /// Names what is out of its range; nothing is then changed.
    pub fn set_period(
        &mut self,
        group: Group,
        period: u32,
        deadline: u32,
    ) -> Result<(), RateLoopError> {
        let config = GroupConfig { period, phase: 0, deadline };
        check_group(group, &config, self.tick_period.get())?;
        self.config.groups[group as usize] = config;
        let record = &mut self.records[group as usize];
        record.countdown = record.countdown.min(period.saturating_sub(1));
        Ok(())
    }

    /// `true` if the watchdog is to be fed: every group has finished in time at least once, and none has
    /// overrun, since the last call that returned true or the last one that saw an overrun.
    pub fn feed_watchdog(&mut self) -> bool {
        // wcet: at most 4 iterations
        let overrun = self.records.iter().any(|record| record.missed > 0);
        // wcet: at most 4 iterations
        let feed = !overrun && self.records.iter().all(|record| record.met > 0);
        if feed || overrun {
            // wcet: at most 4 iterations
            for record in &mut self.records {
                record.met = 0;
                record.missed = 0;
            }
        }
        feed
    }

    /// Measurements of `group` since the start.
    #[must_use]
    pub fn health(&self, group: Group) -> GroupHealth {
        self.records[group as usize].health
    }

    /// Ticks begun since the start.
    #[must_use]
    pub fn ticks(&self) -> u32 {
        self.tick
    }

    /// Ticks that never began because the one before took too long.
    #[must_use]
    pub fn lost_ticks(&self) -> u32 {
        self.lost_ticks
    }
}

const EMPTY_RECORD: GroupRecord = GroupRecord {
    countdown: 0,
    released: None,
    counted: false,
    in_a_row: 0,
    met: 0,
    missed: 0,
    health: GroupHealth { completed: 0, worst_time: 0, overruns: 0 },
};

const fn check_group(
    group: Group,
    config: &GroupConfig,
    tick_period: u32,
) -> Result<(), RateLoopError> {
    if config.period == 0 || (matches!(group, Group::Control) && config.period != 1) {
        return Err(RateLoopError::Period(group));
    }
    if config.phase >= config.period {
        return Err(RateLoopError::Phase(group));
    }
    if config.deadline == 0 || config.deadline > config.period.saturating_mul(tick_period) {
        return Err(RateLoopError::Deadline(group));
    }
    Ok(())
}

#[cfg(test)]
#[path = "rate_loop_tests.rs"]
mod tests;
