//! Any values for any parameters, through the session that judges them.
//!
//! The first byte chooses the controller. Then records of five bytes: place of the parameter, value
//! as little-endian `f32`. A place past the end of the list stands for a name that is none.
#![no_main]

use ctrl_core::mode::Mode;
use ctrl_core::reference::Reference;
use firmware::exchange::ControlStatus;
use firmware::session::{HostSession, SessionMemory};
use fuzz::{GROUND, ask, assert_bounded, send, session};
use glam::Vec3;
use libfuzzer_sys::fuzz_target;
use link::{ControllerKind, Downlink, ParameterValue, Rejection, Uplink};

fuzz_target!(|data: &[u8]| {
    let Some((kind, records)) = data.split_first() else { return };
    let mut memory = SessionMemory::new();
    let mut session = session(&mut memory);
    let kind =
        if kind % 2 == 0 { ControllerKind::RobustAdaptive } else { ControllerKind::Saturated };
    ask(&mut session, Uplink::SelectController(kind), GROUND).unwrap();
    session.take_law();
    let mut list = read_all(&mut session);
    for record in records.as_chunks::<5>().0 {
        let [place, value @ ..] = *record;
        write(&mut session, &mut list, usize::from(place), f32::from_le_bytes(value));
    }
    for (parameter, now) in list.iter().zip(&read_all(&mut session)) {
        assert_same(parameter, now);
    }
});

/// The whole list, as a host reads it.
fn read_all(session: &mut HostSession) -> Vec<ParameterValue> {
    let mut list = Vec::new();
    loop {
        let Downlink::Parameter(parameter) = read(session, list.len() as u16) else { panic!() };
        assert_eq!(usize::from(parameter.index), list.len());
        let count = usize::from(parameter.count);
        list.push(parameter);
        if list.len() == count {
            return list;
        }
    }
}

fn read(session: &mut HostSession, index: u16) -> Downlink {
    send(session, Uplink::ParameterAt { index }, GROUND)
}

/// Writes one value: it is taken, and the law is still bounded, or it is refused, and nothing changes.
fn write(session: &mut HostSession, list: &mut [ParameterValue], place: usize, value: f32) {
    let known = place < list.len();
    let name = list.get(place).map_or("no such name".try_into().unwrap(), |p| p.name.clone());
    let message = Uplink::ParameterWrite { name, value };
    let flying = ControlStatus { mode: Mode::Flying, ..GROUND };
    assert_eq!(ask(session, message.clone(), flying), Err(Rejection::NotNow));
    match ask(session, message, GROUND) {
        Ok(()) => {
            assert!(known && value.is_finite());
            list[place].value = value;
            let law = session.take_law().expect("a changed law");
            for position in [Vec3::ZERO, Vec3::splat(1e3)] {
                assert_bounded(law, &Reference::hover(position));
            }
        }
        Err(Rejection::UnknownParameter) => assert!(!known),
        Err(Rejection::Invalid { parameter, .. }) => assert!(known && !parameter.is_empty()),
        Err(other) => panic!("{other:?}"),
    }
    assert!(session.take_law().is_none());
    if let (Some(parameter), Downlink::Parameter(now)) =
        (list.get(place), read(session, place as u16))
    {
        assert_same(parameter, &now);
    }
}

fn assert_same(parameter: &ParameterValue, now: &ParameterValue) {
    assert_eq!(parameter.name, now.name);
    assert_eq!(parameter.value.to_bits(), now.value.to_bits(), "{}", parameter.name);
}
