//! Who begins a control tick: the clock, or in lock step a host.
//!
//! Pure: the control exception asks at each of its calls, by the clock or by software. In lock step
//! calls by the clock still count, so that a host that has gone is noticed.

/// What a call of the control exception is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Begin {
    /// A tick by the clock.
    Tick,
    /// A tick that the host asked for; the rotors stand still.
    Step,
    /// Lock step ends: disarm, then a tick by the clock.
    Leave,
    /// Nothing; the watchdog is to be fed, which nobody else does in lock step without ticks.
    Feed,
    /// Nothing.
    Wait,
}

/// See the module's documentation.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    in_step: bool,
    request: Option<Request>,
    /// Calls by the clock since the last step.
    silent: u32,
    /// As many end lock step.
    silent_max: u32,
    /// As many feed the watchdog.
    feed_every: u32,
    /// The host is to hear that nothing is left to do.
    announce: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Request {
    Step,
    Leave,
}

impl Pace {
    /// By the clock. Lock step ends after `silent_max` calls without a step; in between the watchdog
    /// is fed at every `feed_every`-th, at least 1.
    #[must_use]
    pub const fn new(silent_max: u32, feed_every: u32) -> Self {
        let (in_step, request, silent, announce) = (false, None, 0, false);
        Self { in_step, request, silent, silent_max, feed_every, announce }
    }

    /// Whether a host decides.
    #[must_use]
    pub fn in_step(&self) -> bool {
        self.in_step
    }

    /// The host decides from now on; it is told.
    pub fn enter(&mut self) {
        *self =
            Self { in_step: true, announce: true, ..Self::new(self.silent_max, self.feed_every) };
    }

    /// The clock decides from its next call on.
    pub fn leave(&mut self) {
        if self.in_step {
            self.request = Some(Request::Leave);
        }
    }

    /// The host asks for the tick after which the uptime is `wanted`; it is `uptime` now. True if the
    /// control exception is to be called; else the host is told what the uptime is.
    pub fn ask(&mut self, wanted: u64, uptime: u32) -> bool {
        let next = wanted == u64::from(uptime.wrapping_add(1));
        if next && self.in_step && self.request.is_none() {
            self.request = Some(Request::Step);
        } else {
            self.announce |= self.in_step;
        }
        self.request == Some(Request::Step)
    }

    /// What this call of the control exception is to do.
    pub fn begin(&mut self) -> Begin {
        if !self.in_step {
            return Begin::Tick;
        }
        self.silent = self.silent.saturating_add(1);
        match self.request.take() {
            Some(Request::Step) => {
                (self.silent, self.announce) = (0, true);
                Begin::Step
            }
            None if self.silent < self.silent_max => {
                let feed = self.silent.is_multiple_of(self.feed_every);
                if feed { Begin::Feed } else { Begin::Wait }
            }
            Some(Request::Leave) | None => {
                (self.in_step, self.announce) = (false, false);
                Begin::Leave
            }
        }
    }

    /// Whether the host is to hear now that nothing is left to do; once.
    pub fn take_announcement(&mut self) -> bool {
        core::mem::take(&mut self.announce)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACE: Pace = Pace::new(10, 4);

    fn in_step() -> Pace {
        let mut pace = PACE;
        pace.enter();
        assert!(pace.in_step() && pace.take_announcement() && !pace.take_announcement());
        pace
    }

    #[test]
    fn the_clock_decides_at_first_and_heeds_no_host() {
        let mut pace = PACE;
        assert!(!pace.ask(1, 0));
        pace.leave();
        assert_eq!((pace.begin(), pace.begin()), (Begin::Tick, Begin::Tick));
        assert!(!pace.take_announcement());
    }

    #[test]
    fn in_lock_step_a_tick_passes_for_each_step_and_is_announced() {
        let mut pace = in_step();
        for uptime in 7..20 {
            assert_eq!(pace.begin(), Begin::Wait);
            assert!(pace.ask(u64::from(uptime) + 1, uptime));
            assert!(pace.ask(u64::from(uptime) + 1, uptime), "asked twice before it began");
            assert_eq!(pace.begin(), Begin::Step);
            assert!(pace.take_announcement());
        }
    }

    #[test]
    fn a_step_that_has_passed_or_is_not_the_next_is_only_answered() {
        let mut pace = in_step();
        for wanted in [0, 7, 9, u64::MAX] {
            assert!(!pace.ask(wanted, 7));
            assert!(pace.take_announcement());
            assert_eq!(pace.begin(), Begin::Wait);
            pace.silent = 0;
        }
    }

    #[test]
    fn uptime_wraps() {
        assert!(in_step().ask(0, u32::MAX));
    }

    #[test]
    fn a_silent_host_is_waited_for_with_a_fed_watchdog_and_then_left() {
        let mut pace = in_step();
        let calls: [_; 11] = core::array::from_fn(|_| pace.begin());
        let (w, f) = (Begin::Wait, Begin::Feed);
        assert_eq!(calls, [w, w, w, f, w, w, w, f, w, Begin::Leave, Begin::Tick]);
        assert!(!pace.in_step() && !pace.take_announcement());
    }

    #[test]
    fn a_host_may_leave() {
        let mut pace = in_step();
        pace.leave();
        assert!(pace.in_step(), "until the next call");
        assert_eq!((pace.begin(), pace.begin()), (Begin::Leave, Begin::Tick));
        pace.enter();
        assert_eq!(pace.begin(), Begin::Wait);
    }
}
