//! The rate groups of this vehicle.

use crate::rate_loop::{Group, GroupConfig, RateLoop, RateLoopConfig};
use crate::scenario::CONTROL_RATE;
use crate::tick_source::{LockStepConfig, TickOrigin, TickSource};

/// Telemetry group (Hz).
pub const TELEMETRY_RATE: u32 = 50;
/// Housekeeping group (Hz).
pub const HOUSEKEEPING_RATE: u32 = 10;
/// Deadline of telemetry at its own rate (us): half its period.
pub const TELEMETRY_DEADLINE: u32 = 500_000 / TELEMETRY_RATE;
/// Overruns of a group in a row that lead to the failsafe.
pub const OVERRUNS_TO_FAILSAFE: u32 = 3;

/// Feeds of the watchdog while lock step waits for its host (Hz).
pub const LOCK_STEP_FEED_RATE: u32 = 10;

/// The source of control ticks before the first one; lock step ends after `timeout` (s) without a step.
#[must_use]
pub const fn tick_source(timeout: u32) -> TickSource {
    let config = LockStepConfig {
        silent_max: timeout.saturating_mul(CONTROL_RATE),
        feed_every: CONTROL_RATE / LOCK_STEP_FEED_RATE,
    };
    TickSource::new(RATE_LOOP, config)
}

/// One control period (us).
pub const TICK: u32 = 1_000_000 / CONTROL_RATE;

/// Control has half its period, so that the groups below it have the other half; state input has
/// until the next tick, which uses what it prepares. Telemetry and housekeeping start at different
/// ticks.
pub const CONFIG: RateLoopConfig = RateLoopConfig {
    control_rate: CONTROL_RATE,
    groups: [
        GroupConfig { period: 1, phase: 0, deadline: TICK / 2 },
        GroupConfig { period: 1, phase: 0, deadline: TICK },
        GroupConfig {
            period: CONTROL_RATE / TELEMETRY_RATE,
            phase: 3,
            deadline: TELEMETRY_DEADLINE,
        },
        GroupConfig {
            period: CONTROL_RATE / HOUSEKEEPING_RATE,
            phase: 7,
            deadline: 500_000 / HOUSEKEEPING_RATE,
        },
    ],
    overruns_to_failsafe: OVERRUNS_TO_FAILSAFE,
};

/// The rate loop before its first tick; a bad configuration does not compile.
pub const RATE_LOOP: RateLoop = match RateLoop::new(CONFIG) {
    Ok(rate_loop) => rate_loop,
    Err(_) => panic!("rates.rs: the rate loop refuses the configuration"),
};

/// Period (ticks) and deadline (us) of the telemetry group when a host asks for telemetry every
/// `subscribed` ticks; its own rate, which also carries answers, when it asks for none; every tick in
/// lock step, whose announcement follows it.
#[must_use]
pub fn telemetry_timing(origin: TickOrigin, subscribed: u16) -> (u32, u32) {
    let own = CONFIG.groups[Group::Telemetry as usize];
    let period = match (origin, subscribed) {
        (TickOrigin::LockStep, _) => 1,
        (TickOrigin::Timer, 0) => own.period,
        (TickOrigin::Timer, subscribed) => u32::from(subscribed),
    };
    (period, period.saturating_mul(TICK).min(own.deadline))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_subscription_gives_a_timing_that_the_rate_loop_accepts() {
        let mut rate_loop = RATE_LOOP;
        let origins = [TickOrigin::Timer, TickOrigin::LockStep];
        for (subscribed, origin) in (0..=u16::MAX).flat_map(|s| origins.map(|origin| (s, origin))) {
            let (period, deadline) = telemetry_timing(origin, subscribed);
            assert_eq!(rate_loop.set_period(Group::Telemetry, period, deadline), Ok(()));
        }
    }

    #[test]
    fn without_a_subscription_the_group_runs_at_its_own_rate() {
        assert_eq!(telemetry_timing(TickOrigin::Timer, 0), (CONTROL_RATE / 50, 10_000));
        assert_eq!(telemetry_timing(TickOrigin::Timer, 2), (2, 2 * TICK));
    }

    #[test]
    fn in_lock_step_there_is_telemetry_at_every_tick() {
        assert_eq!(telemetry_timing(TickOrigin::LockStep, 0), (1, TICK));
        assert_eq!(telemetry_timing(TickOrigin::LockStep, 500), (1, TICK));
    }
}
