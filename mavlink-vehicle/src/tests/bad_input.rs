//! Bad input: wrong addresses, floods, random messages and bytes.

use mavlink::dialects::common::{MavCmd, PARAM_REQUEST_LIST_DATA, PARAM_VALUE_DATA};
use proptest::prelude::*;

use super::*;

fn arming(target_system: u8, target_component: u8) -> COMMAND_LONG_DATA {
    COMMAND_LONG_DATA {
        param1: 1.0,
        command: MavCmd::MAV_CMD_COMPONENT_ARM_DISARM,
        target_system,
        target_component,
        ..COMMAND_LONG_DATA::default()
    }
}

#[test]
fn messages_for_others_and_echoes_of_our_own_are_ignored() {
    let mut air = Air::new();
    air.send(&arming(2, 1));
    air.send(&arming(1, 100));
    let echo = Sender { system: 1, component: 1, sequence: 0 };
    let frame = framed(echo, &arming(1, 1), &[], &mut air.signing);
    air.bytes(frame.as_bytes());
    air.run(0.2);
    assert!(!air.vehicle.armed_ever);
    assert!(air.take::<COMMAND_ACK_DATA>().is_empty());
    air.send(&arming(0, 0));
    air.run(0.2);
    assert!(air.vehicle.armed_ever, "for everyone is for us, too");
}

#[test]
fn a_flood_of_requests_drops_answers_and_nothing_else() {
    let mut air = Air::new();
    for _ in 0..5_000 {
        air.send(&PARAM_REQUEST_LIST_DATA { target_system: 1, target_component: 1 });
        air.send(&arming(1, 1));
    }
    assert!(air.protocol.dropped() > 0);
    air.received.clear();
    air.run(1.0);
    assert_eq!(air.take::<PARAM_VALUE_DATA>().len(), 11, "one list");
    use mavlink::dialects::common::HEARTBEAT_DATA;
    air.run(1.0);
    assert!(!air.take::<HEARTBEAT_DATA>().is_empty());
}

#[test]
fn a_flood_does_not_silence_the_heartbeat_of_a_slow_line() {
    use mavlink::dialects::common::HEARTBEAT_DATA;
    let mut air = Air::new();
    air.received.clear();
    for _ in 0..1_000 {
        // More requests than the line has room to answer: two frames a period.
        air.send(&PARAM_REQUEST_LIST_DATA { target_system: 1, target_component: 1 });
        air.send(&arming(1, 1));
        air.vehicle.tick();
        for _ in 0..2 {
            let frame = air.protocol.next_frame(&mut air.vehicle);
            air.received.extend(frame.as_ref().map(sent));
        }
    }
    assert!(air.take::<HEARTBEAT_DATA>().len() >= 9, "one a second");
    assert!(air.take::<PARAM_VALUE_DATA>().len() + air.take::<COMMAND_ACK_DATA>().len() > 400);
}

#[test]
fn a_replayed_session_arms_no_more_than_once_and_never_takes_off_alone() {
    let mut air = Air::new();
    let frames: Vec<_> = (0..3)
        .map(|_| framed(air.sender(), &arming(1, 1), &[], &mut Signing::new(None, 0)))
        .collect();
    for frame in frames.iter().chain(&frames) {
        air.bytes(frame.as_bytes());
        air.run(0.1);
    }
    assert_eq!(air.vehicle.mode, Mode::Armed);
}

/// Numbers of the messages that are understood.
const KNOWN: [u32; 26] = [
    0, 4, 11, 20, 21, 23, 40, 43, 44, 45, 47, 51, 73, 75, 76, 82, 84, 86, 110, 111, 117, 119, 121,
    122, 41, 256,
];

fn payloads() -> impl Strategy<Value = Vec<(usize, Vec<u8>)>> {
    let special = prop::sample::select(std::vec![0u8, 1, 2, 0x7f, 0x80, 0xff]);
    let byte = prop_oneof![any::<u8>(), special];
    prop::collection::vec((0..KNOWN.len(), prop::collection::vec(byte, 0..255)), 1..60)
}

proptest! {
    #[test]
    fn no_payload_of_any_message_panics_or_breaks_the_bound(messages in payloads()) {
        let mut air = Air::flying();
        for (kind, mut payload) in messages {
            let id = KNOWN[kind];
            // For us, where the message has an address: the rest is as random as before.
            let at = [(76, 30), (75, 30), (84, 52), (86, 52), (73, 32)];
            if let Some((_, at)) = at.iter().find(|(known, _)| *known == id)
                && payload.len() > at + 1
            {
                payload[*at] = 1;
                payload[at + 1] = 1;
            }
            let extra = message::extra_crc(id).unwrap();
            let frame = Frame::of_payload(air.sender(), (id, extra), &payload, false);
            air.bytes(frame.as_bytes());
            air.run(0.05);
            let reference = air.vehicle.navigator.reference();
            prop_assert!(reference.acceleration_world.length() <= 1.0);
            prop_assert!(reference.position_world.is_finite());
        }
    }

    #[test]
    fn no_bytes_arm_a_vehicle(bytes in prop::collection::vec(any::<u8>(), 0..3000)) {
        let mut air = Air::new();
        air.bytes(&bytes);
        air.run(0.2);
        prop_assert!(!air.vehicle.armed_ever);
    }
}
