//! State samples from the host: their age, and the order of the ticks that they carry.

use ctrl_core::vehicle::VehicleState;

/// A state of the vehicle and the time since it arrived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateSample {
    /// The state.
    pub state: VehicleState,
    /// Control ticks since the sample arrived; zero for one that arrived after the latest tick.
    pub age_ticks: u32,
}

/// The latest sample, as it arrived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArrivedState {
    /// The state.
    pub state: VehicleState,
    /// Uptime at its arrival (ticks).
    pub uptime: u32,
}

impl ArrivedState {
    /// The sample with its age at tick `uptime`.
    #[must_use]
    pub const fn at(&self, uptime: u32) -> StateSample {
        StateSample { state: self.state, age_ticks: uptime.wrapping_sub(self.uptime) }
    }
}

/// Order of the tick numbers of one kind of frame, within a flight.
///
/// The link drops frames that its own sequence numbers show to be late. A router or a host that
/// numbers frames anew can still deliver an old sample behind a newer one; its tick shows that. A
/// tick equal to the newest is accepted: a sample may be repeated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickOrder {
    newest: Option<u64>,
    late: u32,
}

impl TickOrder {
    /// No tick has been taken.
    #[must_use]
    pub const fn new() -> Self {
        Self { newest: None, late: 0 }
    }

    /// `true` if a frame of `tick` is to be used after `flight_tick` ticks of flight. Numbers are
    /// compared in flight only, since they count from Start; they may wrap.
    pub fn accept(&mut self, tick: u64, flight_tick: u32) -> bool {
        if flight_tick == 0 {
            self.newest = None;
            return true;
        }
        if self.newest.is_some_and(|newest| tick.wrapping_sub(newest) > u64::MAX / 2) {
            self.late = self.late.wrapping_add(1);
            return false;
        }
        self.newest = Some(tick);
        true
    }

    /// Accepts any tick next: the host has begun anew.
    pub fn restart(&mut self) {
        self.newest = None;
    }

    /// Frames dropped as late since the start of the program.
    #[must_use]
    pub const fn late(&self) -> u32 {
        self.late
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// Numbers that are accepted in flight, in order of arrival.
    fn accepted(order: &mut TickOrder, ticks: &[u64]) -> std::vec::Vec<u64> {
        ticks.iter().copied().filter(|tick| order.accept(*tick, 9)).collect()
    }

    #[test]
    fn age_counts_from_the_arrival_and_the_uptime_may_wrap() {
        let arrived = ArrivedState { state: VehicleState::at_rest(Vec3::X), uptime: u32::MAX };
        assert_eq!(arrived.at(u32::MAX).age_ticks, 0);
        assert_eq!(arrived.at(3).age_ticks, 4);
    }

    #[test]
    fn older_ticks_are_dropped_and_counted_repeated_and_skipped_ones_are_not() {
        let mut order = TickOrder::new();
        assert_eq!(accepted(&mut order, &[5, 6, 6, 4, 5, 9, 8, 10]), [5, 6, 6, 9, 10]);
        assert_eq!(order.late(), 3);
    }

    #[test]
    fn numbers_may_wrap() {
        let mut order = TickOrder::new();
        let ticks = [u64::MAX - 1, u64::MAX, 0, u64::MAX, 1];
        assert_eq!(accepted(&mut order, &ticks), [u64::MAX - 1, u64::MAX, 0, 1]);
    }

    #[test]
    fn a_host_that_begins_anew_and_every_flight_may_count_from_zero() {
        let mut order = TickOrder::new();
        assert_eq!(accepted(&mut order, &[500, 0]), [500]);
        order.restart();
        assert_eq!(accepted(&mut order, &[0, 1]), [0, 1]);
        assert!(order.accept(7000, 0) && order.accept(3, 0), "no order on the ground");
        assert_eq!(accepted(&mut order, &[0, 1]), [0, 1], "nor with what came there");
        assert_eq!(order.late(), 1);
    }
}
