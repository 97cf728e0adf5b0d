//! The rate groups of this vehicle.

use crate::pace::Pace;
use crate::rate_loop::{Group, GroupConfig, RateLoop, RateLoopConfig};
use crate::scenario::CONTROL_RATE;

/// Telemetry group (Hz).
pub const TELEMETRY_RATE: u32 = 50;
/// Housekeeping group (Hz).
pub const HOUSEKEEPING_RATE: u32 = 10;
/// Deadline of telemetry at its own rate (us): half its period.
pub const TELEMETRY_DEADLINE: u32 = 500_000 / TELEMETRY_RATE;
/// This many overruns of a group in a row lead to the failsafe.
pub const OVERRUNS_TO_FAILSAFE: u32 = 3;

/// The watchdog is fed so often while lock step waits for its host (Hz).
pub const LOCK_STEP_FEED_RATE: u32 = 10;

/// Who begins a tick, before the first one; lock step ends after `timeout` without a step (s).
#[must_use]
pub const fn pace(timeout: u32) -> Pace {
    Pace::new(timeout.saturating_mul(CONTROL_RATE), CONTROL_RATE / LOCK_STEP_FEED_RATE)
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
/// lock step, which waits for it.
#[must_use]
pub fn telemetry_timing(in_step: bool, subscribed: u16) -> (u32, u32) {
    let own = CONFIG.groups[Group::Telemetry as usize];
    let period = match (in_step, subscribed) {
        (true, _) => 1,
        (false, 0) => own.period,
        (false, subscribed) => u32::from(subscribed),
    };
    (period, period.saturating_mul(TICK).min(own.deadline))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_subscription_gives_a_timing_that_the_rate_loop_accepts() {
        let mut rate_loop = RATE_LOOP;
        for (subscribed, in_step) in (0..=u16::MAX).flat_map(|s| [(s, false), (s, true)]) {
            let (period, deadline) = telemetry_timing(in_step, subscribed);
            assert_eq!(rate_loop.set_period(Group::Telemetry, period, deadline), Ok(()));
        }
    }

    #[test]
    fn without_a_subscription_the_group_runs_at_its_own_rate() {
        assert_eq!(telemetry_timing(false, 0), (CONTROL_RATE / 50, 10_000));
        assert_eq!(telemetry_timing(false, 2), (2, 2 * TICK));
    }

    #[test]
    fn in_lock_step_there_is_telemetry_at_every_tick() {
        assert_eq!(telemetry_timing(true, 0), (1, TICK));
        assert_eq!(telemetry_timing(true, 500), (1, TICK));
    }
}
