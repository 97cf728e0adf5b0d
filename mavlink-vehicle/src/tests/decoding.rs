//! Framing: both versions, whatever comes between frames.

use proptest::prelude::*;

use super::*;
use mavlink::dialects::common::{PARAM_REQUEST_LIST_DATA, PING_DATA};

fn frame() -> Vec<u8> {
    let sender = Sender { system: 9, component: 8, sequence: 7 };
    let data = PING_DATA { time_usec: 1 << 40, seq: 77, target_system: 1, target_component: 1 };
    framed(sender, &data, &[], &mut Signing::new(None, 0)).as_bytes().to_vec()
}

/// The same message in a frame of MAVLink 1.
fn old_frame() -> Vec<u8> {
    let mut payload = [0; 14];
    let data = PING_DATA { time_usec: 1 << 40, seq: 77, target_system: 1, target_component: 1 };
    data.ser(MavlinkVersion::V1, &mut payload);
    let mut frame = std::vec![0xfe, 14, 7, 9, 8, 4];
    frame.extend(payload);
    let crc = mavlink::calculate_crc(&frame[1..], PING_DATA::EXTRA_CRC);
    frame.extend(crc.to_le_bytes());
    frame
}

fn decoded(decoder: &mut Decoder, bytes: &[u8]) -> Vec<Packet> {
    bytes.iter().filter_map(|byte| decoder.push(*byte)).collect()
}

fn assert_ping(packet: &Packet) {
    assert_eq!((packet.id, packet.system, packet.component), (4, 9, 8));
    let data = PING_DATA::deser(MavlinkVersion::V2, packet.payload()).unwrap();
    assert_eq!((data.time_usec, data.seq), (1 << 40, 77));
}

#[test]
fn frames_of_both_versions_are_taken() {
    let mut decoder = Decoder::new();
    let bytes = [frame(), old_frame(), frame()].concat();
    let packets = decoded(&mut decoder, &bytes);
    assert_eq!(packets.len(), 3);
    packets.iter().for_each(assert_ping);
    assert_eq!((decoder.damaged(), decoder.unknown()), (0, 0));
    let again: Vec<_> =
        packets.iter().flat_map(|packet| packet.frame().as_bytes().to_vec()).collect();
    assert_eq!(again, bytes);
}

#[test]
fn a_signed_frame_is_taken_whole() {
    let mut signed = frame();
    signed[2] = 1;
    let end = signed.len() - 2;
    let crc = mavlink::calculate_crc(&signed[1..end], PING_DATA::EXTRA_CRC);
    signed[end..].copy_from_slice(&crc.to_le_bytes());
    signed.extend([0xfd; 13]); // a signature that looks like starts of frames
    let packets = decoded(&mut Decoder::new(), &[&signed[..], &frame()].concat());
    assert_eq!(packets.len(), 2);
    assert_eq!(packets[0].frame().as_bytes(), signed);
    packets.iter().for_each(assert_ping);
}

#[test]
fn a_frame_cut_anywhere_costs_no_frame_after_it() {
    for frame in [frame(), old_frame()] {
        for cut in 0..frame.len() {
            let mut decoder = Decoder::new();
            // The cut one may claim what follows as its payload, until it proves to be none.
            let more = [0; 280];
            let bytes = [&frame[..cut], &frame, &frame, &frame, &more].concat();
            let packets = decoded(&mut decoder, &bytes);
            assert_eq!(packets.len(), 3, "cut at {cut}: {}", packets.len());
            packets.iter().for_each(assert_ping);
        }
    }
}

#[test]
fn a_changed_byte_is_never_taken() {
    for frame in [frame(), old_frame()] {
        for at in 0..frame.len() {
            for bit in 0..8 {
                let mut bad = frame.clone();
                bad[at] ^= 1 << bit;
                let packets = decoded(&mut Decoder::new(), &bad);
                assert!(packets.is_empty(), "byte {at}, bit {bit}");
            }
        }
    }
}

#[test]
fn flags_that_are_not_understood_and_unknown_messages_are_skipped() {
    let mut flagged = frame();
    flagged[2] = 2;
    let sender = Sender { system: 9, component: 8, sequence: 7 };
    let unknown = Frame::of_payload(sender, (9999, 1), &[1, 2, 3], false);
    let mut decoder = Decoder::new();
    let packets = decoded(&mut decoder, &[&flagged, unknown.as_bytes(), &frame()].concat());
    assert_eq!((packets.len(), decoder.unknown()), (1, 1));
    assert_ping(&packets[0]);
}

#[test]
fn an_empty_payload_is_one_zero_byte() {
    let sender = Sender { system: 9, component: 8, sequence: 7 };
    let data = PARAM_REQUEST_LIST_DATA { target_system: 0, target_component: 0 };
    let frame = framed(sender, &data, &[], &mut Signing::new(None, 0));
    assert_eq!(frame.as_bytes().len(), 10 + 1 + 2);
    let packets = decoded(&mut Decoder::new(), frame.as_bytes());
    assert_eq!(packets[0].payload(), [0]);
}

#[test]
fn a_truncated_frame_does_not_hold_back_the_next_message_of_a_silent_line() {
    for whole in [frame(), old_frame()] {
        for cut in 1..whole.len() {
            let mut decoder = Decoder::new();
            // What was cut off may be as long as the next frame, which then waits with it.
            let came = decoded(&mut decoder, &[&whole[..cut], &frame()[..]].concat());
            let packets: Vec<_> =
                came.into_iter().chain(core::iter::from_fn(|| decoder.resume())).collect();
            assert_eq!(packets.len(), 1, "cut at {cut}");
            assert_ping(&packets[0]);
            assert!(decoder.resume().is_none());
        }
    }
}

proptest! {
    #[test]
    fn after_any_noise_the_third_frame_at_the_latest_is_taken(
        noise in prop::collection::vec(any::<u8>(), 0..600)
    ) {
        let mut decoder = Decoder::new();
        decoded(&mut decoder, &noise);
        // Noise may pretend a frame of 280 bytes.
        let quiet = std::vec![0; 280];
        decoded(&mut decoder, &quiet);
        prop_assert_eq!(decoded(&mut decoder, &frame()).len(), 1);
    }
}
