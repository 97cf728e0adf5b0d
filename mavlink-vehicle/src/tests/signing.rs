//! Signatures: those that are sent, those that are demanded, and the message that sets the key.

use mavlink::dialects::common::{HEARTBEAT_DATA, MavCmd, SETUP_SIGNING_DATA};

use super::*;

/// SHA-256 of "gyrfalcon".
const KEY: [u8; 32] = [
    0xc2, 0xeb, 0x71, 0xc5, 0x67, 0x33, 0x48, 0x2a, 0xd4, 0x3d, 0xb8, 0xf9, 0xb5, 0xd5, 0x17, 0xf4,
    0xee, 0xb2, 0xf6, 0x36, 0x58, 0x77, 0xaa, 0xc8, 0xc1, 0x3d, 0xe0, 0x32, 0x2b, 0x3f, 0x6f, 0xb1,
];
/// Some day in 2026 (10 us).
const NOW: u64 = 37_500_000_000_000;
/// One minute (10 us).
const MINUTE: u64 = 6_000_000;
/// `HEARTBEAT` of system 255 over link 7 at the moment after [`NOW`], signed by pymavlink 2.4.50.
const BY_PYMAVLINK: [u8; 34] = [
    0xfd, 0x09, 0x01, 0x00, 0x09, 0xff, 0xbe, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x06, 0x08,
    0x00, 0x00, 0x03, 0x6f, 0x0d, 0x07, 0x01, 0xd8, 0x2d, 0x26, 0x1b, 0x22, 0x43, 0xf3, 0xcb, 0x91,
    0xe0, 0x2a,
];

fn key() -> SigningKey {
    SigningKey::new(KEY).unwrap()
}

fn station(key: [u8; 32], link: u8, timestamp: u64) -> Signing {
    let mut signing = Signing::new(SigningKey::new(key), link);
    signing.follow_clock(timestamp);
    signing
}

/// A vehicle with a key and its clock, and a station that signs with the same.
fn signed() -> Air {
    let config = ProtocolConfig { signing_key: Some(key()), ..ProtocolConfig::default() };
    let mut air = Air::of(&config);
    air.protocol.follow_clock(NOW);
    air.signing = station(KEY, 7, NOW);
    air
}

fn arm(air: &mut Air) -> Option<u8> {
    air.command(400, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
}

fn disarm(air: &mut Air) -> Option<u8> {
    air.command(400, [0.0; 7])
}

/// Asks to set a key.
fn set_up(air: &mut Air, secret_key: [u8; 32]) -> std::string::String {
    air.texts();
    let (target_system, target_component) = (1, 1);
    air.send(&SETUP_SIGNING_DATA {
        initial_timestamp: NOW,
        target_system,
        target_component,
        secret_key,
    });
    air.run(0.05);
    air.texts().join("\n")
}

#[test]
fn what_is_signed_with_the_key_is_carried_out_and_nothing_else() {
    let mut air = signed();
    assert_eq!(arm(&mut air), result(MavResult::MAV_RESULT_ACCEPTED));
    assert_eq!(disarm(&mut air), result(MavResult::MAV_RESULT_ACCEPTED));
    air.signing = Signing::new(None, 7);
    assert_eq!(arm(&mut air), None);
    let texts = air.texts().join("\n");
    assert!(texts.contains("message 76 refused: not signed"), "{texts}");
    let mut other = KEY;
    other[31] ^= 1;
    air.signing = station(other, 7, NOW + MINUTE);
    assert_eq!(arm(&mut air), None);
    assert!(air.texts().is_empty(), "said at most every five seconds");
    let refusals = air.protocol.signing_refusals();
    assert_eq!((refusals.unsigned, refusals.forged, refusals.replayed), (1, 1, 0));
    air.signing = station(KEY, 7, NOW + MINUTE);
    assert_eq!(arm(&mut air), result(MavResult::MAV_RESULT_ACCEPTED));
}

#[test]
fn any_changed_byte_of_a_signed_frame_is_refused() {
    let mut air = signed();
    let frame = {
        let sender = air.sender();
        framed(sender, &HEARTBEAT_DATA::DEFAULT, &[], &mut air.signing)
    };
    let good = frame.as_bytes();
    for at in 0..good.len() {
        let mut bytes = good.to_vec();
        bytes[at] ^= 0x10;
        // Everything but link, timestamp and signature is also under the checksum.
        let end = bytes.len() - 13;
        let crc = mavlink::calculate_crc(&bytes[1..end - 2], 50);
        bytes[end - 2..end].copy_from_slice(&crc.to_le_bytes());
        let Some(packet) = bytes.iter().find_map(|byte| air.uplink.push(*byte)) else {
            air.uplink = Decoder::new();
            continue; // not a frame of this length or message any more
        };
        if bytes != good {
            let refused = air.protocol.signing.accept(&packet);
            assert!(refused.is_err(), "byte {at}");
        }
    }
    air.bytes(good);
    assert!(air.protocol.signing_refusals().forged > 20);
    assert_eq!(air.protocol.signing_refusals().replayed, 0);
}

#[test]
fn a_frame_signed_by_pymavlink_is_accepted_and_signed_the_same() {
    let mut air = signed();
    air.bytes(&BY_PYMAVLINK);
    assert_eq!(air.protocol.signing_refusals(), SigningRefusals::default());
    air.bytes(&BY_PYMAVLINK);
    assert_eq!(air.protocol.signing_refusals().replayed, 1);
    use mavlink::dialects::common::{MavAutopilot, MavModeFlag, MavState, MavType};
    let data = HEARTBEAT_DATA {
        custom_mode: 0,
        mavtype: MavType::MAV_TYPE_GCS,
        autopilot: MavAutopilot::MAV_AUTOPILOT_INVALID,
        base_mode: MavModeFlag::empty(),
        system_status: MavState::MAV_STATE_UNINIT,
        mavlink_version: 3,
    };
    let sender = Sender { system: 255, component: 190, sequence: 9 };
    let frame = framed(sender, &data, &[], &mut station(KEY, 7, NOW));
    assert_eq!(frame.as_bytes(), BY_PYMAVLINK);
}

#[test]
fn a_recorded_session_is_refused_byte_for_byte() {
    let mut air = signed();
    let mut record = Vec::new();
    for _ in 0..3 {
        let order = COMMAND_LONG_DATA {
            param1: 1.0,
            command: MavCmd::MAV_CMD_COMPONENT_ARM_DISARM,
            target_system: 1,
            target_component: 1,
            ..COMMAND_LONG_DATA::default()
        };
        let frame = framed(air.sender(), &order, &[], &mut air.signing);
        record.extend_from_slice(frame.as_bytes());
    }
    air.bytes(&record);
    air.run(0.1);
    assert!(air.vehicle.armed_ever);
    assert_eq!(disarm(&mut air), result(MavResult::MAV_RESULT_ACCEPTED));
    air.vehicle.armed_ever = false;
    air.bytes(&record);
    air.run(0.1);
    assert!(!air.vehicle.armed_ever);
    assert_eq!(air.protocol.signing_refusals().replayed, 3);
}

#[test]
fn each_link_of_each_sender_has_its_own_time_and_an_old_stream_does_not_begin() {
    let mut air = signed();
    assert_eq!(arm(&mut air), result(MavResult::MAV_RESULT_ACCEPTED));
    // Another link of the same station, a little behind; then one that is more than a minute behind.
    air.signing = station(KEY, 8, NOW - MINUTE / 2);
    assert_eq!(disarm(&mut air), result(MavResult::MAV_RESULT_ACCEPTED));
    air.signing = station(KEY, 9, NOW - MINUTE - 10);
    assert_eq!(arm(&mut air), None);
    // The first link goes on from where it was, not from the start.
    air.signing = station(KEY, 7, NOW - 10);
    assert_eq!(arm(&mut air), None);
    assert_eq!(air.protocol.signing_refusals().replayed, 2);
    air.signing = station(KEY, 7, NOW + 10);
    assert_eq!(arm(&mut air), result(MavResult::MAV_RESULT_ACCEPTED));
}

#[test]
fn streams_are_bounded_and_a_forgotten_one_is_not_open_to_replays() {
    let mut air = signed();
    for link in 0..20 {
        let mut signing = station(KEY, link, NOW);
        let frame = framed(air.sender(), &HEARTBEAT_DATA::DEFAULT, &[], &mut signing);
        air.bytes(frame.as_bytes());
    }
    assert_eq!(air.protocol.signing_refusals().streams, 12);
    // Two minutes later there is room, and what was sent before is too old.
    air.protocol.follow_clock(NOW + 2 * MINUTE);
    air.signing = station(KEY, 19, NOW + 2 * MINUTE);
    assert_eq!(arm(&mut air), result(MavResult::MAV_RESULT_ACCEPTED));
    let mut replay = station(KEY, 0, NOW);
    let frame = framed(air.sender(), &HEARTBEAT_DATA::DEFAULT, &[], &mut replay);
    air.bytes(frame.as_bytes());
    assert_eq!(air.protocol.signing_refusals().replayed, 1);
}

#[test]
fn everything_that_is_sent_is_signed_and_its_time_grows() {
    let mut air = signed();
    air.received.clear();
    air.run(2.0);
    let mut receiver = station(KEY, 0, NOW);
    assert!(air.received.len() > 100);
    let before = air.received.len();
    for packet in &air.received {
        assert_eq!(receiver.accept(packet), Ok(()), "message {}", packet.id);
        assert_eq!(packet.trailer.unwrap().link, 0);
    }
    // Answers wait while streams are sent: they are signed when they leave.
    arm(&mut air);
    for packet in &air.received[before..] {
        assert_eq!(receiver.accept(packet), Ok(()), "message {}", packet.id);
    }
}

#[test]
fn without_a_key_signed_messages_are_taken_as_they_come() {
    let mut air = Air::new();
    air.signing = station(KEY, 7, NOW);
    assert_eq!(arm(&mut air), result(MavResult::MAV_RESULT_ACCEPTED));
    assert_eq!(disarm(&mut air), result(MavResult::MAV_RESULT_ACCEPTED));
    air.signing = Signing::new(None, 0);
    assert_eq!(arm(&mut air), result(MavResult::MAV_RESULT_ACCEPTED));
    assert!(air.received.iter().all(|packet| packet.trailer.is_none()));
}

#[test]
fn a_key_is_set_replaced_and_removed_over_a_secure_line_while_disarmed() {
    let mut air = Air::new();
    air.line = Line::Open;
    assert!(set_up(&mut air, KEY).contains("the line is not secure"));
    air.line = Line::Secure;
    assert_eq!(arm(&mut air), result(MavResult::MAV_RESULT_ACCEPTED));
    assert!(set_up(&mut air, KEY).contains("only disarmed"));
    assert_eq!(disarm(&mut air), result(MavResult::MAV_RESULT_ACCEPTED));
    assert!(set_up(&mut air, KEY).contains("signing key set"));
    assert_eq!(arm(&mut air), None, "not signed");
    air.signing = station(KEY, 1, NOW);
    assert!(!set_up(&mut air, KEY).contains("set"), "sent again");
    let mut next = KEY;
    next[0] ^= 1;
    assert!(set_up(&mut air, next).contains("signing key set"));
    assert_eq!(arm(&mut air), None, "the key before");
    air.signing = station(next, 1, NOW);
    assert_eq!(arm(&mut air), result(MavResult::MAV_RESULT_ACCEPTED));
    assert_eq!(disarm(&mut air), result(MavResult::MAV_RESULT_ACCEPTED));
    assert!(set_up(&mut air, [0; 32]).contains("signing is off"));
    air.signing = Signing::new(None, 0);
    assert_eq!(arm(&mut air), result(MavResult::MAV_RESULT_ACCEPTED));
}

#[test]
fn the_key_is_not_shown() {
    assert_eq!(std::format!("{:?}", key()), "SigningKey(..)");
}
