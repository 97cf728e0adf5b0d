//! Times of a sensor's samples: rate, delay, dropouts.
//!
//! Every `period` a sample is taken of the state of that tick; it arrives `delay` later, unless it is
//! lost. Both are whole ticks.

use std::collections::VecDeque;

use super::random::Normal;

/// Samples on their way.
#[derive(Clone, Debug)]
pub struct Schedule<T> {
    period: u64,
    delay: u64,
    /// Probability that a sample is lost.
    dropout: f64,
    waiting: VecDeque<(u64, T)>,
    normal: Normal,
}

impl<T> Schedule<T> {
    /// With `rate` (Hz) and `delay` (s) in ticks of `tick` (s); lost with the probability `dropout`.
    #[must_use]
    pub fn new(rate: f64, delay: f64, dropout: f64, tick: f64, normal: Normal) -> Self {
        let period = (1.0 / (rate * tick)).round().max(1.0) as u64;
        let delay = (delay / tick).round() as u64;
        Self { period, delay, dropout, waiting: VecDeque::new(), normal }
    }

    /// Takes a sample when it is time; returns the one that arrives at this tick, if any.
    pub fn advance(&mut self, tick: u64, sample: impl FnOnce() -> T) -> Option<T> {
        if tick.is_multiple_of(self.period) {
            let taken = sample();
            if self.normal.uniform() >= self.dropout {
                self.waiting.push_back((tick + self.delay, taken));
            }
        }
        let arrives = self.waiting.front().is_some_and(|(due, _)| *due <= tick);
        if arrives { self.waiting.pop_front().map(|(_, sample)| sample) } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_arrive_at_their_rate_and_after_their_delay() {
        let mut schedule = Schedule::new(50.0, 0.030, 0.0, 1e-3, Normal::new(1, 1));
        let arrivals: Vec<_> = (0..200)
            .filter_map(|tick| schedule.advance(tick, || tick).map(|taken| (tick, taken)))
            .collect();
        assert_eq!(arrivals.len(), 9);
        assert!(arrivals.iter().all(|(now, taken)| now - taken == 30 && taken % 20 == 0));
    }

    #[test]
    fn the_share_of_lost_samples_is_the_dropout() {
        let mut schedule = Schedule::new(1000.0, 0.0, 0.2, 1e-3, Normal::new(2, 1));
        let n = 50_000;
        let arrived = (0..n).filter(|tick| schedule.advance(*tick, || ()).is_some()).count();
        assert!((arrived as f64 / n as f64 - 0.8).abs() < 0.006, "{arrived}");
    }
}
