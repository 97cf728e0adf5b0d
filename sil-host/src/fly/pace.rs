//! Real time, or a multiple of it.

use std::time::{Duration, Instant};

/// Ticks that are due by the clock.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    start: Instant,
    /// Ticks per second of the clock.
    rate: f64,
    done: u64,
    skipped: u64,
}

/// Ticks that are run before the ports get their turn.
const BURST: u64 = 200;
/// Delay beyond which time is given up instead of caught up with (s of the clock).
const LATE: f64 = 0.25;

impl Pace {
    /// Begins at `now`, at `speed` times real time with ticks of `period` (s).
    #[must_use]
    pub fn new(now: Instant, speed: f64, period: f64) -> Self {
        Self { start: now, rate: speed / period, done: 0, skipped: 0 }
    }

    /// Number of ticks to run now; a computer that is too slow loses time rather than chasing it.
    pub fn due(&mut self, now: Instant) -> u64 {
        let due = (now.duration_since(self.start).as_secs_f64() * self.rate) as u64;
        let behind = due.saturating_sub(self.done + self.skipped);
        let most = (LATE * self.rate) as u64;
        if behind > most.max(BURST) {
            self.skipped += behind - most.max(BURST);
        }
        let ticks = behind.min(BURST);
        self.done += ticks;
        ticks
    }

    /// Time until the next tick is due.
    #[must_use]
    pub fn wait(&self, now: Instant) -> Duration {
        let next = (self.done + self.skipped + 1) as f64 / self.rate;
        Duration::from_secs_f64(next).saturating_sub(now.duration_since(self.start))
    }

    /// Ticks given up because the computer was too slow.
    #[must_use]
    pub fn skipped(&self) -> u64 {
        self.skipped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_keep_up_with_the_clock_and_its_multiple() {
        for (speed, expected) in [(1.0, 1000), (4.0, 4000)] {
            let start = Instant::now();
            let mut pace = Pace::new(start, speed, 1e-3);
            let mut ticks = 0;
            for ms in 0..=1000 {
                ticks += pace.due(start + Duration::from_millis(ms));
            }
            assert!((i64::try_from(ticks).unwrap() - expected).abs() <= 1, "{ticks}");
            assert_eq!(pace.skipped(), 0);
            assert!(pace.wait(start + Duration::from_secs(1)) <= Duration::from_millis(1));
        }
    }

    #[test]
    fn a_pause_of_the_computer_is_not_chased() {
        let start = Instant::now();
        let mut pace = Pace::new(start, 1.0, 1e-3);
        let later = start + Duration::from_secs(60);
        let caught_up: u64 = (0..100).map(|_| pace.due(later)).sum();
        assert_eq!(caught_up, 250);
        assert_eq!(pace.skipped(), 60_000 - 250);
        assert_eq!(pace.due(later + Duration::from_millis(5)), 5);
    }
}
