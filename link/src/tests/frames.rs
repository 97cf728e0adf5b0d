//! Framing, numbering and counting.

use super::*;
use ctrl_core::mode::{Command, Refusal};

fn stream(messages: &[Uplink]) -> Vec<Vec<u8>> {
    let mut encoder = Encoder::default();
    let mut frame = [0; MAX_FRAME];
    messages.iter().map(|message| encoder.encode(message, &mut frame).unwrap().to_vec()).collect()
}

fn samples(count: u64) -> Vec<Vec<u8>> {
    stream(&(0..count).map(example_reference).collect::<Vec<_>>())
}

#[test]
fn messages_arrive_in_order_with_their_numbers() {
    let messages = [Uplink::Hello, Uplink::Command(Command::Arm), example_state()];
    let mut decoder = Decoder::<Uplink>::default();
    let received = feed(&mut decoder, &stream(&messages).concat());
    for (i, (received, message)) in received.iter().zip(&messages).enumerate() {
        assert_eq!((usize::from(received.sequence), &received.message), (i, message));
    }
    assert_eq!(decoder.statistics(), LinkStatistics { delivered: 3, ..Default::default() });
}

#[test]
fn a_frame_holds_no_zero_but_the_last_byte() {
    for frame in samples(600) {
        let (last, rest) = frame.split_last().unwrap();
        assert!(*last == 0 && !rest.contains(&0) && frame.len() <= MAX_FRAME);
    }
}

#[test]
fn resynchronises_at_the_next_zero() {
    let frames = samples(3);
    let mut decoder = Decoder::<Uplink>::default();
    let mut bytes = frames[0][20..].to_vec();
    bytes.extend_from_slice(&frames[1]);
    bytes.extend_from_slice(&[0, 0, 0]);
    bytes.extend_from_slice(&frames[2]);
    assert_eq!(feed(&mut decoder, &bytes).len(), 2);
    let expected = LinkStatistics { delivered: 2, damaged: 1, ..Default::default() };
    assert_eq!(decoder.statistics(), expected, "zeros between frames are no frames");
}

#[test]
fn an_endless_frame_costs_no_memory_and_is_dropped() {
    let mut decoder = Decoder::<Uplink>::default();
    assert!(feed(&mut decoder, &[0x55; 100_000]).is_empty());
    assert!(feed(&mut decoder, &[0]).is_empty());
    assert_eq!(feed(&mut decoder, &frame_of(&Uplink::Hello)).len(), 1);
    let expected = LinkStatistics { delivered: 1, damaged: 1, ..Default::default() };
    assert_eq!(decoder.statistics(), expected);
}

#[test]
fn skipped_numbers_are_counted_as_lost() {
    let frames = samples(10);
    let mut decoder = Decoder::<Uplink>::default();
    feed(&mut decoder, &[frames[0].as_slice(), &frames[1], &frames[5], &frames[9]].concat());
    let expected = LinkStatistics { delivered: 4, lost: 6, ..Default::default() };
    assert_eq!(decoder.statistics(), expected);
}

#[test]
fn doubled_and_late_frames_are_dropped() {
    let frames = samples(40);
    let mut decoder = Decoder::<Uplink>::default();
    for (i, delivered) in
        [(0, true), (0, false), (32, true), (1, false), (31, false), (33, true), (32, false)]
    {
        assert_eq!(feed(&mut decoder, &frames[i]).len(), usize::from(delivered), "{i}");
    }
    assert_eq!((decoder.statistics().late, decoder.statistics().lost), (4, 31));
}

#[test]
fn numbers_wrap_without_loss() {
    let mut encoder = Encoder::default();
    let mut decoder = Decoder::<Uplink>::default();
    let mut frame = [0; MAX_FRAME];
    for _ in 0..65_600 {
        let bytes = encoder.encode(&Uplink::ParametersPersist, &mut frame).unwrap();
        assert_eq!(feed(&mut decoder, bytes).len(), 1);
    }
    assert_eq!(decoder.statistics(), LinkStatistics { delivered: 65_600, ..Default::default() });
    assert_eq!(encoder.next_sequence(), 64);
}

#[test]
fn a_sender_that_begins_anew_is_heard() {
    // With Hello at once, wherever the numbers were.
    let mut decoder = Decoder::<Uplink>::default();
    feed(&mut decoder, &samples(10).concat());
    let anew = stream(&[Uplink::Hello, example_state()]).concat();
    assert_eq!(feed(&mut decoder, &anew).len(), 2);
    assert_eq!(decoder.statistics().lost, 0);
    // Without it, once it is out of the window.
    let mut decoder = Decoder::<Uplink>::default();
    feed(&mut decoder, &samples(100).concat());
    assert_eq!(feed(&mut decoder, &samples(3).concat()).len(), 3);
}

#[test]
fn the_other_direction_and_other_versions_are_foreign() {
    let mut decoder = Decoder::<Downlink>::default();
    assert!(feed(&mut decoder, &frame_of(&Uplink::Hello)).is_empty());
    assert_eq!(decoder.statistics(), LinkStatistics { foreign: 1, ..Default::default() });
    // Version 2: the tag changed, the checksum right.
    let mut decoder = Decoder::<Uplink>::default();
    assert!(feed(&mut decoder, &framed(&[2, 0, 0, 0])).is_empty());
    assert_eq!(decoder.statistics(), LinkStatistics { foreign: 1, ..Default::default() });
}

/// A frame around any content, with the right checksum.
fn framed(content: &[u8]) -> Vec<u8> {
    let checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(content);
    let payload = [content, &checksum.to_le_bytes()].concat();
    let mut frame = [0; 300];
    let length = cobs::try_encode(&payload, &mut frame).unwrap();
    frame[..=length].to_vec()
}

#[test]
fn whole_frames_without_a_message_are_malformed() {
    for content in [&[1, 0, 0][..], &[1, 0, 0, 99], &[1, 0, 0, 1, 9], &[1, 0, 0, 0, 0]] {
        let mut decoder = Decoder::<Uplink>::default();
        assert!(feed(&mut decoder, &framed(content)).is_empty(), "{content:?}");
        let expected = LinkStatistics { malformed: 1, ..Default::default() };
        assert_eq!(decoder.statistics(), expected, "{content:?}");
    }
    // An announced text longer than there is, or longer than the field.
    for length in [40, 200] {
        let mut decoder = Decoder::<Uplink>::default();
        let content = [&[1, 0, 0, 9, length][..], &[b'a'; 30]].concat();
        assert!(feed(&mut decoder, &framed(&content)).is_empty());
        assert_eq!(decoder.statistics().malformed, 1);
    }
}

#[test]
fn too_short_a_frame_is_damaged() {
    for bytes in [&[1u8, 0][..], &[2, 7, 0], &[5, 1, 1, 1, 1, 0]] {
        let mut decoder = Decoder::<Uplink>::default();
        assert!(feed(&mut decoder, bytes).is_empty());
        assert_eq!(decoder.statistics(), LinkStatistics { damaged: 1, ..Default::default() });
    }
    // Checksum of nothing, without a header.
    let mut decoder = Decoder::<Uplink>::default();
    assert!(feed(&mut decoder, &framed(&[])).is_empty());
    assert_eq!(decoder.statistics().damaged, 1);
}

#[test]
fn numbers_that_are_not_finite_travel_unchanged() {
    let mut reference = Reference::hover(Vec3::new(f32::NAN, f32::INFINITY, -0.0));
    reference.snap_world = Vec3::new(f32::MIN_POSITIVE / 2.0, f32::MAX, f32::NEG_INFINITY);
    let sent = frame_of(&Uplink::Reference { tick: u64::MAX, reference });
    let received = feed(&mut Decoder::<Uplink>::default(), &sent);
    assert_eq!(frame_of(&received[0].message), sent);
}

#[test]
fn a_refusal_reaches_the_host() {
    let answer = Downlink::Acknowledgement(Acknowledgement {
        sequence: 513,
        result: Err(Rejection::Mode(Refusal::StateStale)),
    });
    let received = feed(&mut Decoder::<Downlink>::default(), &frame_of(&answer));
    assert_eq!(received[0].message, answer);
}
