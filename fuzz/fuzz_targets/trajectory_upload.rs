//! Any messages that upload or select a trajectory, through the session that judges them.
//!
//! The input is postcard messages to the vehicle, one after the other, as far as they parse.
#![no_main]

use ctrl_core::mode::Mode;
use ctrl_core::reference::Reference;
use firmware::exchange::ControlStatus;
use firmware::session::{HostSession, SessionMemory};
use fuzz::{GROUND, ask, assert_bounded, session};
use libfuzzer_sys::fuzz_target;
use link::{Rejection, TrajectorySelection, Uplink};

/// Ticks of flight at which a selected trajectory is looked at.
const TICKS: [u32; 5] = [0, 1, 777, 20_000, u32::MAX];

fuzz_target!(|data: &[u8]| {
    let mut memory = SessionMemory::new();
    let mut session = session(&mut memory);
    let mut rest = data;
    while let Ok((message, after)) = postcard::take_from_bytes::<Uplink>(rest) {
        rest = after;
        match message {
            Uplink::PathBegin { .. } | Uplink::PathLeg { .. } => upload(&mut session, message),
            Uplink::SelectTrajectory(selection) => select(&mut session, selection),
            _ => {}
        }
    }
});

/// A piece of a path is accepted, or refused by its number alone; the selected trajectory does not change.
fn upload(session: &mut HostSession, message: Uplink) {
    let before = references(session);
    match ask(session, message, GROUND) {
        Ok(()) | Err(Rejection::NoPath | Rejection::LegOrder { .. }) => {}
        Err(other) => panic!("{other:?}"),
    }
    assert_eq!(references(session), before);
}

/// An accepted trajectory can be flown at every tick; a refused one changes nothing.
fn select(session: &mut HostSession, selection: TrajectorySelection) {
    let message = Uplink::SelectTrajectory(selection);
    let flying = ControlStatus { mode: Mode::Flying, ..GROUND };
    let before = references(session);
    assert_eq!(ask(session, message.clone(), flying), Err(Rejection::NotNow));
    assert_eq!(references(session), before);
    match ask(session, message, GROUND) {
        Ok(()) => {}
        Err(Rejection::Invalid { .. }) => return assert_eq!(references(session), before),
        Err(Rejection::NoPath) => {
            assert_eq!(selection, TrajectorySelection::UploadedPath);
            return assert_eq!(references(session), before);
        }
        Err(other) => panic!("{other:?}"),
    }
    for reference in references(session) {
        if selection == TrajectorySelection::UploadedPath {
            assert!(reference.position_world.is_finite() && reference.snap_world.is_finite());
            assert!(reference.left_world.is_finite() && reference.left_rate_world.is_finite());
        }
        assert_bounded(session.law(), &reference);
    }
}

fn references(session: &mut HostSession) -> [Reference; TICKS.len()] {
    TICKS.map(|flight_tick| session.reference(ControlStatus { flight_tick, ..GROUND }))
}
