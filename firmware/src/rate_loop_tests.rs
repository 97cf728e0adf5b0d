//! Simulated time only: each test is a short history of ticks and finishes.

use std::vec::Vec;

use super::*;

const CONFIG: RateLoopConfig = RateLoopConfig {
    control_rate: 1000,
    groups: [
        GroupConfig { period: 1, phase: 0, deadline: 500 },
        GroupConfig { period: 1, phase: 0, deadline: 1000 },
        GroupConfig { period: 20, phase: 3, deadline: 10_000 },
        GroupConfig { period: 100, phase: 7, deadline: 50_000 },
    ],
    overruns_to_failsafe: 3,
};

/// Runs `ticks` ticks of 1 ms from `start` (us); every group that is due takes `cost` (us).
fn run(rate_loop: &mut RateLoop, start: u32, ticks: u32, cost: [u32; GROUPS]) -> u32 {
    for tick in 0..ticks {
        let now = start.wrapping_add(tick * 1000);
        let due = rate_loop.tick(now);
        for group in Group::ALL.into_iter().filter(|group| due.contains(*group)) {
            rate_loop.finish(group, now.wrapping_add(cost[group as usize]));
        }
    }
    start.wrapping_add(ticks * 1000)
}

fn new() -> RateLoop {
    RateLoop::new(CONFIG).unwrap()
}

#[test]
fn every_group_is_due_at_its_rate_and_phase() {
    let mut rate_loop = new();
    let mut releases = [const { Vec::new() }; GROUPS];
    for tick in 0..1000u32 {
        let due = rate_loop.tick(tick * 1000);
        for group in Group::ALL.into_iter().filter(|group| due.contains(*group)) {
            releases[group as usize].push(tick);
            rate_loop.finish(group, tick * 1000 + 10);
        }
    }
    assert_eq!(releases.each_ref().map(Vec::len), [1000, 1000, 50, 10]);
    assert_eq!(releases[Group::Telemetry as usize][..3], [3, 23, 43]);
    assert_eq!(releases[Group::Housekeeping as usize][..2], [7, 107]);
    assert_eq!(rate_loop.ticks(), 1000);
}

#[test]
fn the_worst_time_is_kept_and_a_timely_group_never_overruns() {
    let mut rate_loop = new();
    let start = run(&mut rate_loop, 0, 200, [20, 30, 40, 50]);
    let start = run(&mut rate_loop, start, 1, [480, 30, 40, 50]);
    run(&mut rate_loop, start, 200, [20, 30, 40, 50]);
    let control = rate_loop.health(Group::Control);
    assert_eq!(control, GroupHealth { completed: 401, worst_time: 480, overruns: 0 });
    assert_eq!(rate_loop.health(Group::Housekeeping).worst_time, 50);
    assert!(!rate_loop.failsafe_required());
}

#[test]
fn a_deadline_ends_on_its_last_microsecond() {
    let mut rate_loop = new();
    rate_loop.tick(0);
    rate_loop.finish(Group::Control, 500);
    assert_eq!(rate_loop.health(Group::Control).overruns, 0);
    rate_loop.tick(1000);
    rate_loop.finish(Group::Control, 1501);
    assert_eq!(rate_loop.health(Group::Control).overruns, 1);
}

#[test]
fn overruns_in_a_row_lead_to_failsafe_and_a_timely_finish_ends_the_row() {
    let (slow, fast) = ([501, 10, 10, 10], [10; GROUPS]);
    let mut rate_loop = new();
    let start = run(&mut rate_loop, 0, 2, slow);
    assert!(!rate_loop.failsafe_required());
    let start = run(&mut rate_loop, start, 1, fast);
    let start = run(&mut rate_loop, start, 2, slow);
    assert!(!rate_loop.failsafe_required());
    run(&mut rate_loop, start, 1, slow);
    assert!(rate_loop.failsafe_required());
    assert_eq!(rate_loop.health(Group::Control).overruns, 5);
}

#[test]
fn a_group_that_never_finishes_is_counted_once_late_and_once_for_each_missed_release() {
    let mut rate_loop = new();
    for tick in 0..64u32 {
        let due = rate_loop.tick(tick * 1000);
        assert_eq!(due.contains(Group::Telemetry), tick == 3, "tick {tick}");
        rate_loop.finish(Group::Control, tick * 1000 + 10);
        rate_loop.finish(Group::StateInput, tick * 1000 + 10);
        // Released at tick 3 with 10 ms; missed at 23, 43 and 63.
        let expected = match tick {
            0..=13 => 0,
            14..=22 => 1,
            23..=42 => 2,
            43..=62 => 3,
            _ => 4,
        };
        assert_eq!(rate_loop.health(Group::Telemetry).overruns, expected, "tick {tick}");
    }
    assert!(rate_loop.failsafe_required());
}

#[test]
fn a_late_finish_of_a_counted_release_is_not_counted_twice_and_ends_no_row() {
    let mut rate_loop = new();
    run(&mut rate_loop, 0, 3, [10; GROUPS]);
    for tick in 3..15u32 {
        rate_loop.tick(tick * 1000);
        rate_loop.finish(Group::Control, tick * 1000 + 10);
        rate_loop.finish(Group::StateInput, tick * 1000 + 10);
    }
    assert_eq!(rate_loop.health(Group::Telemetry).overruns, 1);
    rate_loop.finish(Group::Telemetry, 14_500);
    assert_eq!(
        rate_loop.health(Group::Telemetry),
        GroupHealth { completed: 1, worst_time: 11_500, overruns: 1 }
    );
    assert_eq!(rate_loop.records[Group::Telemetry as usize].in_a_row, 1);
}

#[test]
fn lost_ticks_are_control_overruns_and_small_jitter_is_not() {
    let mut rate_loop = new();
    for now in [0, 1400, 2000, 3000] {
        rate_loop.tick(now);
        rate_loop.finish(Group::Control, now + 10);
        rate_loop.finish(Group::StateInput, now + 10);
    }
    assert_eq!((rate_loop.lost_ticks(), rate_loop.health(Group::Control).overruns), (0, 0));
    rate_loop.tick(6000);
    assert_eq!((rate_loop.lost_ticks(), rate_loop.health(Group::Control).overruns), (2, 1));
}

#[test]
fn the_watchdog_is_fed_only_when_every_group_met_its_deadline() {
    let mut rate_loop = new();
    let start = run(&mut rate_loop, 0, 7, [10; GROUPS]);
    assert!(!rate_loop.feed_watchdog(), "housekeeping has not run yet");
    let start = run(&mut rate_loop, start, 100, [10; GROUPS]);
    assert!(rate_loop.feed_watchdog());
    assert!(!rate_loop.feed_watchdog(), "nothing has run since");
    let start = run(&mut rate_loop, start, 99, [10; GROUPS]);
    let start = run(&mut rate_loop, start, 1, [501, 10, 10, 10]);
    assert!(!rate_loop.feed_watchdog(), "control overran");
    run(&mut rate_loop, start, 100, [10; GROUPS]);
    assert!(rate_loop.feed_watchdog(), "a window without overrun follows");
}

#[test]
fn each_group_that_hangs_starves_the_watchdog() {
    for hung in Group::ALL {
        let mut rate_loop = new();
        let mut fed = 0;
        for tick in 0..1000u32 {
            let due = rate_loop.tick(tick * 1000);
            for group in Group::ALL.into_iter().filter(|g| due.contains(*g) && *g != hung) {
                rate_loop.finish(group, tick * 1000 + 10);
            }
            fed += u32::from(tick % 100 == 99 && rate_loop.feed_watchdog());
        }
        assert_eq!(fed, 0, "{hung:?}");
    }
}

#[test]
fn a_period_may_change_while_running() {
    let mut rate_loop = new();
    run(&mut rate_loop, 0, 10, [10; GROUPS]);
    assert_eq!(rate_loop.set_period(Group::Telemetry, 2, 1500), Ok(()));
    let released = |rate_loop: &mut RateLoop, tick: u32| {
        let due = rate_loop.tick(tick * 1000).contains(Group::Telemetry);
        Group::ALL.into_iter().for_each(|group| rate_loop.finish(group, tick * 1000 + 10));
        due
    };
    let due: Vec<_> = (10..16).map(|tick| released(&mut rate_loop, tick)).collect();
    assert_eq!(due, [false, true, false, true, false, true]);
    let error = rate_loop.set_period(Group::Telemetry, 2, 2001);
    assert_eq!(error, Err(RateLoopError::Deadline(Group::Telemetry)));
    let error = rate_loop.set_period(Group::Control, 2, 500);
    assert_eq!(error, Err(RateLoopError::Period(Group::Control)));
}

#[test]
fn a_late_control_period_is_known_until_a_timely_one() {
    let mut rate_loop = new();
    let start = run(&mut rate_loop, 0, 1, [501, 10, 10, 10]);
    assert!(rate_loop.control_overran());
    let start = run(&mut rate_loop, start, 1, [500, 1001, 10, 10]);
    assert!(!rate_loop.control_overran(), "another group is not control");
    rate_loop.tick(start + 2000);
    assert!(rate_loop.control_overran(), "ticks were lost");
}

#[test]
fn the_clock_may_wrap() {
    let mut rate_loop = new();
    let end = run(&mut rate_loop, u32::MAX - 50_000, 100, [20; GROUPS]);
    assert!(end < u32::MAX - 50_000);
    let control = rate_loop.health(Group::Control);
    assert_eq!(control, GroupHealth { completed: 100, worst_time: 20, overruns: 0 });
    assert_eq!(rate_loop.lost_ticks(), 0);
}

#[test]
fn a_finish_without_release_changes_nothing() {
    let mut rate_loop = new();
    rate_loop.finish(Group::Telemetry, 5);
    assert_eq!(rate_loop.health(Group::Telemetry), GroupHealth::default());
}

#[test]
fn bad_configurations_are_refused_by_name() {
    let refused = |change: fn(&mut RateLoopConfig)| {
        let mut config = CONFIG;
        change(&mut config);
        RateLoop::new(config).map(|_| ()).unwrap_err()
    };
    assert_eq!(refused(|c| c.control_rate = 499), RateLoopError::ControlRate(499));
    assert_eq!(refused(|c| c.control_rate = 2001), RateLoopError::ControlRate(2001));
    assert_eq!(refused(|c| c.control_rate = 700), RateLoopError::ControlRate(700));
    assert_eq!(refused(|c| c.groups[0].period = 2), RateLoopError::Period(Group::Control));
    assert_eq!(refused(|c| c.groups[2].period = 0), RateLoopError::Period(Group::Telemetry));
    assert_eq!(refused(|c| c.groups[2].phase = 20), RateLoopError::Phase(Group::Telemetry));
    assert_eq!(refused(|c| c.groups[0].deadline = 1001), RateLoopError::Deadline(Group::Control));
    assert_eq!(refused(|c| c.groups[3].deadline = 0), RateLoopError::Deadline(Group::Housekeeping));
    assert_eq!(refused(|c| c.overruns_to_failsafe = 0), RateLoopError::OverrunsToFailsafe);
}

#[test]
fn in_lock_step_a_tick_comes_one_period_after_the_last_whenever_that_was() {
    let mut rate_loop = RateLoop::new(CONFIG).unwrap();
    rate_loop.tick(5_000);
    rate_loop.finish(Group::Control, 5_010);
    for now in [5_020, 900_000, u32::MAX - 3, 77] {
        rate_loop.step(now);
        rate_loop.finish(Group::Control, now.wrapping_add(30));
        rate_loop.finish(Group::StateInput, now.wrapping_add(40));
    }
    let control = rate_loop.health(Group::Control);
    assert_eq!((control.completed, control.overruns, control.worst_time), (5, 0, 30));
    assert_eq!((rate_loop.ticks(), rate_loop.lost_ticks()), (5, 0));
    // What takes long in a tick is still late, unless it is the wire.
    rate_loop.step(1_000);
    rate_loop.skip(10_000);
    rate_loop.finish(Group::Control, 11_020);
    assert_eq!(rate_loop.health(Group::Control).overruns, 0);
    rate_loop.step(20_000);
    rate_loop.finish(Group::Control, 30_000);
    assert_eq!(rate_loop.health(Group::Control).overruns, 1);
}

#[test]
fn after_lock_step_the_clock_ticks_on_without_a_loss() {
    let mut rate_loop = RateLoop::new(CONFIG).unwrap();
    rate_loop.tick(0);
    rate_loop.finish(Group::Control, 10);
    rate_loop.step(50_000);
    rate_loop.finish(Group::Control, 50_010);
    rate_loop.resume();
    for now in [90_000, 91_000, 92_000] {
        rate_loop.tick(now);
        assert!(rate_loop.is_due(Group::Control));
        rate_loop.finish(Group::Control, now + 20);
        assert!(!rate_loop.is_due(Group::Control));
    }
    let control = rate_loop.health(Group::Control);
    assert_eq!((control.overruns, control.worst_time, rate_loop.lost_ticks()), (0, 20, 0));
}
