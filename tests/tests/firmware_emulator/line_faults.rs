//! A bad line and a lost host: nothing stops the image; the failsafe comes on time and can be left.

use ctrl_core::mode::{Cause, Command, FailsafePolicy, Mode, Refusal};
use ctrl_core::vehicle::VehicleState;
use firmware::vehicle::VEHICLE;
use glam::Vec3;
use link::{Downlink, LinkStatistics, Rejection, Telemetry, Uplink};
use sil_host::pil::fault::{Fault, LinkFaults};
use sil_host::pil::flight::fly;
use sil_host::pil::recording::Direction;
use sil_host::pil::session::{VehicleSession, one_telemetry};
use sil_host::pil::set_up::set_up;
use sim::scenario::LoadedScenario;

use crate::emulator::emulator;

/// A vehicle armed to fly the beginning of a paper scenario.
fn armed(duration: f64, directives: &[&str]) -> (VehicleSession, LoadedScenario, VehicleState) {
    armed_in(duration, directives, false)
}

/// As [`armed`], in the link's lock step or not.
fn armed_in(
    duration: f64,
    directives: &[&str],
    in_step: bool,
) -> (VehicleSession, LoadedScenario, VehicleState) {
    let changes = [format!("duration={duration}")];
    let loaded = LoadedScenario::open("paper-saturated", &changes).unwrap();
    let directives: Vec<_> = directives.iter().map(ToString::to_string).collect();
    let (mut session, _) = VehicleSession::boot(&emulator("firmware"), &directives).unwrap();
    if in_step {
        session.enter_lock_step().unwrap();
    }
    let state = set_up(&mut session, loaded.scenario()).unwrap();
    (session, loaded, state)
}

/// Flies half a second with a fifth of all frames damaged by `kinds`, in closed loop and without
/// leaving flight; how many were damaged, and what the vehicle's decoder had counted in the end.
fn flown_through(kinds: &[Fault], seed: u64) -> (u32, LinkStatistics) {
    let (mut session, loaded, state) = armed(0.5, &[]);
    session.inject(Direction::ToVehicle, Some(LinkFaults::new(seed, kinds, 0.2)));
    let on_board = fly(&loaded, &mut session, &mut (), &|_| ()).unwrap();
    assert_eq!(on_board.ticks, 500);
    let injected = session.inject(Direction::ToVehicle, None).unwrap().injected();
    assert!((50..150).contains(&injected), "{kinds:?}: {injected}");
    // Sent every tenth of a second: the second one counts all of the flight.
    session.health(state).unwrap();
    let health = session.health(state).unwrap();
    assert_eq!(health.groups[0].overruns, 0, "{kinds:?}");
    (injected, health.link)
}

/// Checks the counts of a decoder after `injected` faults of this kind.
fn assert_counted(kind: Fault, injected: u32, link: LinkStatistics) {
    let LinkStatistics { damaged, foreign, malformed, late, lost, .. } = link;
    let what = format!("{kind:?}, {injected} injected: {link:?}");
    assert_eq!((foreign, malformed), (0, 0), "{what}");
    match kind {
        Fault::Lost => assert_eq!((damaged, late, lost), (0, 0, injected), "{what}"),
        Fault::Duplicated => assert_eq!((damaged, late, lost), (0, injected, 0), "{what}"),
        Fault::Reordered | Fault::Delayed => {
            assert!(damaged == 0 && late > injected / 2 && lost > 0, "{what}");
        }
        Fault::Truncated | Fault::Flipped | Fault::Garbage => {
            assert!(damaged >= injected / 2 && late == 0, "{what}");
        }
    }
}

#[test]
fn every_fault_of_the_line_is_counted_dropped_and_flown_through() {
    for (seed, kind) in Fault::ALL.into_iter().enumerate() {
        let (injected, link) = flown_through(&[kind], seed as u64);
        assert_counted(kind, injected, link);
    }
}

#[test]
fn all_faults_at_once_are_flown_through() {
    for seed in 10..13 {
        let (_, link) = flown_through(&Fault::ALL, seed);
        assert!(link.damaged > 0 && link.late > 0 && link.lost > 0, "{link:?}");
    }
}

/// Flies half a second with a fifth of all frames from the vehicle damaged by `kinds`; every telemetry
/// that arrives is SIL's to the bit. How many were damaged, and what the host's decoder counted.
fn flown_half_deaf(kinds: &[Fault], seed: u64, in_step: bool) -> (u32, LinkStatistics) {
    let (mut session, loaded, state) = armed_in(0.5, &[], in_step);
    let before = session.statistics();
    session.inject(Direction::FromVehicle, Some(LinkFaults::new(seed, kinds, 0.2)));
    let on_board = fly(&loaded, &mut session, &mut (), &|_| ()).unwrap();
    assert_eq!((on_board.ticks, on_board.difference), (500, None), "{kinds:?}");
    let injected = session.inject(Direction::FromVehicle, None).unwrap().injected();
    assert!((50..150).contains(&injected), "{kinds:?}: {injected}");
    session.health(state).unwrap(); // shows what was lost last
    let seen = session.statistics();
    assert_eq!((before.damaged, before.late, before.lost), (0, 0, 0));
    (injected, seen)
}

#[test]
fn every_fault_of_the_line_from_the_vehicle_is_counted_dropped_and_flown_through() {
    for (seed, kind) in (20..).zip(Fault::ALL) {
        let (injected, link) = flown_half_deaf(&[kind], seed, false);
        assert_counted(kind, injected, link);
    }
}

#[test]
fn a_damaged_line_does_not_disturb_the_lock_step() {
    let (_, link) = flown_half_deaf(&Fault::ALL, 30, true);
    assert!(link.damaged > 0 && link.late > 0 && link.lost > 0, "{link:?}");
    // Both directions at once: the bits are not SIL's, for samples are missed, but nothing stops.
    let (mut session, loaded, _) = armed_in(0.5, &[], true);
    for (seed, direction) in (40..).zip(Direction::BOTH) {
        session.inject(direction, Some(LinkFaults::new(seed, &Fault::ALL, 0.2)));
    }
    assert_eq!(fly(&loaded, &mut session, &mut (), &|_| ()).unwrap().ticks, 500);
}

/// Takes off, then `line` gives the bytes of each tick until the failsafe; how many ticks it took,
/// and the telemetry of the last of them.
fn until_failsafe(
    session: &mut VehicleSession,
    state: VehicleState,
    line: &[u8],
) -> (u32, Telemetry) {
    let start = [Uplink::State { tick: 0, state }, Uplink::Command(Command::Start)];
    assert_eq!(session.tick(&start).unwrap().mode, Mode::Flying);
    for tick in 1..100 {
        let telemetry = one_telemetry(&session.send_bytes(line).unwrap()).unwrap();
        if telemetry.mode != Mode::Flying {
            return (tick, telemetry);
        }
    }
    panic!("no failsafe");
}

#[test]
fn when_the_host_is_gone_the_failsafe_comes_on_time_and_a_returning_host_recovers() {
    let config = &VEHICLE;
    let FailsafePolicy::Descend { thrust, .. } = config.supervisor.failsafe else {
        panic!("vehicle.toml descends");
    };
    // The last sample stands for some ticks more; in the period of the last miss the output changes.
    let due = config.link.sample_valid - 1 + u32::from(config.supervisor.missed_samples_max);
    let garbage: Vec<u8> = (0..250_u32).map(|byte| (byte * 37 % 251) as u8).collect();
    for line in [&[][..], &garbage] {
        let (mut session, _, state) = armed(0.5, &[]);
        let (ticks, telemetry) = until_failsafe(&mut session, state, line);
        assert_eq!(ticks, due);
        assert_eq!((telemetry.mode, telemetry.cause), (Mode::Failsafe, Some(Cause::SamplesMissed)));
        let wrench = telemetry.wrench;
        assert_eq!((wrench.thrust, wrench.torque_body), (thrust, Vec3::ZERO));
        recover(&mut session, state, config.supervisor.fresh_samples);
    }
}

/// The host is back: refused at first, flying once the state is fresh.
fn recover(session: &mut VehicleSession, state: VehicleState, fresh_samples: u16) {
    session.send_bytes(&[0]).unwrap(); // ends what was left of the garbage
    let refused = session.ask(Uplink::Command(Command::Start), state).unwrap();
    assert_eq!(refused, Err(Rejection::Mode(Refusal::StateStale)));
    let sample = [Uplink::State { tick: 0, state }];
    for _ in 0..fresh_samples {
        assert_eq!(session.tick(&sample).unwrap().mode, Mode::Failsafe);
    }
    session.expect_ok("to fly on", Uplink::Command(Command::Start), state).unwrap();
    let telemetry = session.tick(&sample).unwrap();
    assert_eq!(telemetry.mode, Mode::Flying);
    assert!(telemetry.wrench.thrust > 1.0);
}

#[test]
fn firmware_that_restarts_in_flight_says_so_and_flies_again_as_in_sil() {
    let (mut session, loaded, state) = armed(0.2, &["provoke=panic"]);
    let start = [Uplink::State { tick: 0, state }, Uplink::Command(Command::Start)];
    session.tick(&start).unwrap();
    let sample = Uplink::State { tick: 0, state };
    let first = (0..1000).find_map(|_| {
        let received = session.send(std::slice::from_ref(&sample)).unwrap();
        received.into_iter().find_map(|message| match message {
            Downlink::Identity(identity) => Some(identity),
            _ => None,
        })
    });
    assert!(first.expect("a second first").fault_pending);
    session.subscribe(state).unwrap();
    let telemetry = session.tick(std::slice::from_ref(&sample)).unwrap();
    assert_eq!((telemetry.mode, telemetry.cause), (Mode::Locked, Some(Cause::Fault)));
    session.expect_ok("to forget the fault", Uplink::FaultAcknowledge, state).unwrap();
    session.expect_ok("to disarm", Uplink::Command(Command::Disarm), state).unwrap();
    set_up(&mut session, loaded.scenario()).unwrap();
    let on_board = fly(&loaded, &mut session, &mut (), &|_| ()).unwrap();
    assert_eq!((on_board.ticks, on_board.difference), (200, None));
}
