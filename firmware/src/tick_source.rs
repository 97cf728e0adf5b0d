//! Source of control ticks: the timer, or in lock step the host.
//!
//! Pure: the control exception calls [`TickSource::begin`] first, whether the timer or software has
//! raised it. In lock step calls by the timer still count, so that a lost host is noticed. The source
//! owns the [`RateLoop`]: what begins a tick also decides which time counts.

use link::LinkStatistics;

use crate::rate_loop::{Due, Group, RateLoop};
use crate::rates;

/// Origin of a control tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TickOrigin {
    /// The timer.
    #[default]
    Timer,
    /// A lock-step request of the host; the rotor outputs stay off.
    LockStep,
}

/// A lock-step request of the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LockStepRequest {
    /// Ticks begin at the host's requests from now on; in lock step already, it is announced again.
    Enter,
    /// Ticks begin by the timer again.
    Leave,
    /// The tick after which the uptime is this.
    Step(u64),
}

/// Verdict on one call of the control exception.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Begin {
    /// A control tick.
    Tick(ControlTick),
    /// No tick; the watchdog is to be fed, which no group does in lock step without ticks.
    FeedWatchdog,
    /// No tick.
    Wait,
}

/// A control tick that has begun.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ControlTick {
    /// Its origin.
    pub origin: TickOrigin,
    /// Lock step has just ended: the vehicle is to be disarmed first.
    pub lock_step_ended: bool,
    /// Rate groups that it releases.
    pub due: Due,
    /// The last control period was an overrun, or a group has overrun repeatedly.
    pub overrun: bool,
    /// Ticks since the start of the program, with this one.
    pub uptime: u32,
}

/// Task to pend after a lock-step request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pend {
    /// Control: a tick has been granted.
    Control,
    /// Telemetry and housekeeping: answers and announcement go out without a tick.
    Answers,
}

/// Limits of lock step, in calls of the timer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LockStepConfig {
    /// Calls without a step that end lock step.
    pub silent_max: u32,
    /// Calls from one feed of the watchdog to the next, at least 1.
    pub feed_every: u32,
}

/// See the module's documentation.
#[derive(Clone, Debug)]
pub struct TickSource {
    rate_loop: RateLoop,
    config: LockStepConfig,
    origin: TickOrigin,
    granted: Option<Granted>,
    /// Calls by the timer since the last step.
    silent: u32,
    announcement: bool,
    ended: bool,
    /// Origin and subscription that the telemetry group's timing stands for.
    telemetry: (TickOrigin, u16),
}

/// Request that the next call of the control exception carries out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Granted {
    Step,
    Leave,
}

impl TickSource {
    /// A source of ticks by the timer.
    #[must_use]
    pub const fn new(rate_loop: RateLoop, config: LockStepConfig) -> Self {
        let (origin, granted, silent) = (TickOrigin::Timer, None, 0);
        let (announcement, ended, telemetry) = (false, false, (TickOrigin::Timer, 0));
        Self { rate_loop, config, origin, granted, silent, announcement, ended, telemetry }
    }

    /// Origin of the next tick.
    #[must_use]
    pub const fn origin(&self) -> TickOrigin {
        self.origin
    }

    /// Begins a tick at `now` (us), if this call of the control exception is to be one.
    pub fn begin(&mut self, now: u32) -> Begin {
        if self.origin == TickOrigin::Timer {
            return self.tick(now, false);
        }
        self.silent = self.silent.saturating_add(1);
        match self.granted.take() {
            Some(Granted::Step) => {
                (self.silent, self.announcement) = (0, true);
                let due = self.rate_loop.step(now);
                self.begun(due, false)
            }
            None if self.silent < self.config.silent_max => {
                let feed = self.silent.is_multiple_of(self.config.feed_every);
                if feed { Begin::FeedWatchdog } else { Begin::Wait }
            }
            Some(Granted::Leave) | None => {
                (self.origin, self.announcement, self.ended) = (TickOrigin::Timer, false, true);
                self.rate_loop.resume();
                self.tick(now, true)
            }
        }
    }

    fn tick(&mut self, now: u32, lock_step_ended: bool) -> Begin {
        let due = self.rate_loop.tick(now);
        self.begun(due, lock_step_ended)
    }

    fn begun(&self, due: Due, lock_step_ended: bool) -> Begin {
        let (origin, uptime) = (self.origin, self.rate_loop.ticks());
        let overrun = self.rate_loop.control_overran() || self.rate_loop.failsafe_required();
        Begin::Tick(ControlTick { origin, lock_step_ended, due, overrun, uptime })
    }

    /// Applies a lock-step request from the host.
    pub fn apply(&mut self, request: LockStepRequest) -> Pend {
        match (request, self.origin) {
            (LockStepRequest::Step(_) | LockStepRequest::Leave, TickOrigin::Timer) => {}
            (LockStepRequest::Enter, TickOrigin::LockStep) => self.announcement = true,
            (LockStepRequest::Enter, TickOrigin::Timer) => self.enter(),
            (LockStepRequest::Leave, TickOrigin::LockStep) => self.granted = Some(Granted::Leave),
            (LockStepRequest::Step(wanted), TickOrigin::LockStep) => return self.step(wanted),
        }
        Pend::Answers
    }

    fn enter(&mut self) {
        (self.origin, self.granted, self.silent) = (TickOrigin::LockStep, None, 0);
        self.announcement = true;
    }

    /// Grants the next tick; any other number is answered with the uptime alone.
    fn step(&mut self, wanted: u64) -> Pend {
        let next = u64::from(self.rate_loop.ticks().wrapping_add(1));
        if wanted == next && self.granted.is_none() {
            self.granted = Some(Granted::Step);
        } else {
            self.announcement = true;
        }
        if self.granted == Some(Granted::Step) { Pend::Control } else { Pend::Answers }
    }

    /// Uptime (ticks) to announce now that all work of a lock-step request is done; once.
    pub fn take_announcement(&mut self) -> Option<u64> {
        let uptime = u64::from(self.rate_loop.ticks());
        core::mem::take(&mut self.announcement).then_some(uptime)
    }

    /// `true` once after lock step has ended.
    pub fn take_lock_step_ended(&mut self) -> bool {
        core::mem::take(&mut self.ended)
    }

    /// Sets the telemetry group's timing for a subscription (ticks; zero for none), and for the
    /// origin of ticks.
    pub fn time_telemetry(&mut self, subscribed: u16) {
        let wanted = (self.origin, subscribed);
        if self.telemetry != wanted {
            self.telemetry = wanted;
            let (period, deadline) = rates::telemetry_timing(self.origin, subscribed);
            // Every timing of `rates` is accepted (tested there).
            let _ = self.rate_loop.set_period(Group::Telemetry, period, deadline);
        }
    }

    /// Ends the work of `group` at `now` (us).
    pub fn finish(&mut self, group: Group, now: u32) {
        self.rate_loop.finish(group, now);
    }

    /// Ends the work of telemetry at `now` (us), of which the wire took `wire` (us): time that does
    /// not count in lock step, where telemetry goes out at every tick.
    pub fn finish_telemetry(&mut self, now: u32, wire: u32) {
        if self.origin == TickOrigin::LockStep {
            self.rate_loop.skip(wire);
        }
        self.rate_loop.finish(Group::Telemetry, now);
    }

    /// Ends the work of housekeeping at `now` (us); `true` if the watchdog is to be fed.
    pub fn finish_housekeeping(&mut self, now: u32) -> bool {
        self.rate_loop.finish(Group::Housekeeping, now);
        self.rate_loop.feed_watchdog()
    }

    /// `true` if `group` has been released and not finished.
    #[must_use]
    pub fn is_due(&self, group: Group) -> bool {
        self.rate_loop.is_due(group)
    }

    /// Health report of link and rate groups; `transmit_dropped` answers found no room.
    #[must_use]
    pub fn health(&self, link: LinkStatistics, transmit_dropped: u32) -> link::Health {
        let uptime_ticks = u64::from(self.rate_loop.ticks());
        let groups = Group::ALL.map(|group| self.rate_loop.health(group));
        link::Health { uptime_ticks, groups, link, transmit_dropped }
    }
}

#[cfg(test)]
#[path = "tick_source_tests.rs"]
mod tests;
