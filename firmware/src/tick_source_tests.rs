//! Short histories of calls and lock-step requests.

use super::*;
use crate::rates::RATE_LOOP;

const CONFIG: LockStepConfig = LockStepConfig { silent_max: 10, feed_every: 4 };

fn by_timer() -> TickSource {
    TickSource::new(RATE_LOOP, CONFIG)
}

/// A source in lock step after `ticks` ticks by the timer.
fn in_lock_step(ticks: u32) -> TickSource {
    let mut source = by_timer();
    for tick in 0..ticks {
        source.begin(tick * 1000);
        source.finish(Group::Control, tick * 1000 + 10);
        source.finish(Group::StateInput, tick * 1000 + 20);
    }
    assert_eq!(source.apply(LockStepRequest::Enter), Pend::Answers);
    assert_eq!(source.take_announcement(), Some(u64::from(ticks)));
    assert_eq!((source.take_announcement(), source.origin()), (None, TickOrigin::LockStep));
    source
}

fn origin(begin: Begin) -> Option<(TickOrigin, bool)> {
    match begin {
        Begin::Tick(tick) => Some((tick.origin, tick.lock_step_ended)),
        Begin::FeedWatchdog | Begin::Wait => None,
    }
}

const TIMER: Option<(TickOrigin, bool)> = Some((TickOrigin::Timer, false));
const STEP: Option<(TickOrigin, bool)> = Some((TickOrigin::LockStep, false));
const ENDED: Option<(TickOrigin, bool)> = Some((TickOrigin::Timer, true));

#[test]
fn by_the_timer_every_call_is_a_tick_and_no_step_is_granted() {
    let mut source = by_timer();
    assert_eq!(source.apply(LockStepRequest::Step(1)), Pend::Answers);
    assert_eq!(source.apply(LockStepRequest::Leave), Pend::Answers);
    assert_eq!((origin(source.begin(0)), origin(source.begin(1000))), (TIMER, TIMER));
    assert_eq!((source.take_announcement(), source.take_lock_step_ended()), (None, false));
}

#[test]
fn in_lock_step_each_request_is_one_tick_and_is_announced() {
    let mut source = in_lock_step(7);
    for uptime in 8..20 {
        assert_eq!(source.begin(0), Begin::Wait);
        assert_eq!(source.apply(LockStepRequest::Step(uptime)), Pend::Control);
        assert_eq!(source.apply(LockStepRequest::Step(uptime)), Pend::Control, "before it began");
        let Begin::Tick(tick) = source.begin(0) else { panic!() };
        assert_eq!((tick.origin, u64::from(tick.uptime)), (TickOrigin::LockStep, uptime));
        assert_eq!(source.take_announcement(), Some(uptime));
    }
}

#[test]
fn a_step_that_has_passed_or_is_not_the_next_is_only_answered() {
    for wanted in [0, 7, 9, u64::MAX] {
        let mut source = in_lock_step(7);
        assert_eq!(source.apply(LockStepRequest::Step(wanted)), Pend::Answers);
        assert_eq!(source.take_announcement(), Some(7));
        assert_eq!(source.begin(0), Begin::Wait);
    }
}

#[test]
fn entering_again_is_announced_again() {
    let mut source = in_lock_step(3);
    assert_eq!(source.apply(LockStepRequest::Enter), Pend::Answers);
    assert_eq!(source.take_announcement(), Some(3));
    assert_eq!(source.begin(0), Begin::Wait);
}

#[test]
fn a_silent_host_is_awaited_with_a_fed_watchdog_until_the_timeout() {
    let mut source = in_lock_step(1);
    let calls: [_; 9] = core::array::from_fn(|_| source.begin(5000));
    let (w, f) = (Begin::Wait, Begin::FeedWatchdog);
    assert_eq!(calls, [w, w, w, f, w, w, w, f, w]);
    assert_eq!(origin(source.begin(9000)), ENDED);
    assert!(source.take_lock_step_ended() && !source.take_lock_step_ended(), "once");
    assert_eq!((source.origin(), source.take_announcement()), (TickOrigin::Timer, None));
    assert_eq!(origin(source.begin(10_000)), TIMER);
}

#[test]
fn a_step_restarts_the_timeout() {
    let mut source = in_lock_step(0);
    for uptime in 1..4 {
        (0..9).for_each(|_| assert_eq!(origin(source.begin(0)), None));
        source.apply(LockStepRequest::Step(uptime));
        assert_eq!(origin(source.begin(0)), STEP);
    }
}

#[test]
fn a_host_may_leave_and_enter_again() {
    let mut source = in_lock_step(2);
    source.apply(LockStepRequest::Leave);
    assert_eq!(source.origin(), TickOrigin::LockStep, "until the next call");
    assert_eq!(origin(source.begin(90_000)), ENDED);
    source.finish(Group::Control, 90_010);
    let Begin::Tick(tick) = source.begin(91_000) else { panic!() };
    assert_eq!((tick.origin, tick.overrun), (TickOrigin::Timer, false), "no tick counts as lost");
    source.apply(LockStepRequest::Enter);
    assert_eq!(source.begin(92_000), Begin::Wait);
}

#[test]
fn telemetry_is_released_at_every_tick_of_lock_step() {
    let mut source = in_lock_step(0);
    source.time_telemetry(20);
    for uptime in 1..10 {
        source.apply(LockStepRequest::Step(uptime));
        let Begin::Tick(tick) = source.begin(0) else { panic!() };
        assert!(tick.due.contains(Group::Telemetry), "{uptime}");
        source.finish(Group::Control, 10);
        source.finish_telemetry(1_000_000, 1_000_000 - 20);
    }
    let telemetry = source.health(LinkStatistics::default(), 0).groups[Group::Telemetry as usize];
    assert_eq!((telemetry.completed, telemetry.overruns), (9, 0), "the wire does not count");
}

#[test]
fn health_lists_the_groups_in_order() {
    let mut source = by_timer();
    for tick in 0..4 {
        source.begin(tick * 1000);
        source.finish(Group::Control, tick * 1000 + 11);
        source.finish(Group::StateInput, tick * 1000 + 22);
        source.finish_telemetry(tick * 1000 + 33, 5);
    }
    let health = source.health(LinkStatistics::default(), 9);
    assert_eq!(health.groups.map(|group| group.worst_time), [11, 22, 33, 0]);
    assert_eq!(health.groups.map(|group| group.completed), [4, 4, 1, 0]);
    assert_eq!((health.uptime_ticks, health.transmit_dropped), (4, 9));
}
