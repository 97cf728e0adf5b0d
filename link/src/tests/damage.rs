//! Damaged streams: nothing panics, and nothing is delivered that was not sent.

use proptest::prelude::*;

use super::*;
use ctrl_core::mode::Command;

/// Messages of several lengths.
fn messages() -> Vec<Uplink> {
    let name = heapless::String::try_from("cascade.k1").unwrap();
    std::vec![
        Uplink::Hello,
        Uplink::Command(Command::Start),
        example_state(),
        example_reference(7),
        Uplink::Subscribe { period: 20 },
        Uplink::ParameterWrite { name, value: 0.5 },
    ]
}

/// The frames of `count` messages in a row.
fn frames(count: usize) -> Vec<(Uplink, Vec<u8>)> {
    let mut encoder = Encoder::default();
    let mut frame = [0; MAX_FRAME];
    let message = |message: Uplink| {
        let bytes = encoder.encode(&message, &mut frame).unwrap().to_vec();
        (message, bytes)
    };
    messages().into_iter().cycle().take(count).map(message).collect()
}

/// Feeds `bytes` and asserts that every delivery is one of `sent`, unchanged.
fn assert_no_false_accept(bytes: &[u8], sent: &[(Uplink, Vec<u8>)]) -> usize {
    let mut decoder = Decoder::<Uplink>::default();
    let received = feed(&mut decoder, bytes);
    for Received { sequence, message } in &received {
        assert_eq!(*message, sent[usize::from(*sequence)].0);
    }
    assert_eq!(decoder.statistics().delivered as usize, received.len());
    received.len()
}

/// One way to damage a frame; the numbers choose the place.
#[derive(Clone, Copy, Debug)]
enum Damage {
    None,
    Lost,
    Doubled,
    Truncated(usize),
    BeginningLost(usize),
    BitFlipped(usize),
    BytesReplaced(usize, u8, usize),
    SwappedWithNext,
}

fn damage() -> impl Strategy<Value = Damage> {
    let place = 0usize..1000;
    prop_oneof![
        Just(Damage::None),
        Just(Damage::Lost),
        Just(Damage::Doubled),
        place.clone().prop_map(Damage::Truncated),
        place.clone().prop_map(Damage::BeginningLost),
        (0usize..10_000).prop_map(Damage::BitFlipped),
        (place, any::<u8>(), 1usize..12)
            .prop_map(|(at, byte, n)| Damage::BytesReplaced(at, byte, n)),
        Just(Damage::SwappedWithNext),
    ]
}

fn apply(damage: Damage, frame: &[u8]) -> Vec<u8> {
    let mut bytes = frame.to_vec();
    let length = bytes.len();
    match damage {
        Damage::None | Damage::SwappedWithNext => {}
        Damage::Lost => bytes.clear(),
        Damage::Doubled => bytes.extend_from_slice(frame),
        Damage::Truncated(at) => bytes.truncate(at % length),
        Damage::BeginningLost(at) => drop(bytes.drain(..at % length)),
        Damage::BitFlipped(bit) => bytes[bit / 8 % length] ^= 1 << (bit % 8),
        Damage::BytesReplaced(at, byte, n) => {
            let at = at % length;
            bytes[at..length.min(at + n)].fill(byte);
        }
    }
    bytes
}

proptest! {
    #[test]
    fn any_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..2000)) {
        let mut up = Decoder::<Uplink>::default();
        let mut down = Decoder::<Downlink>::default();
        // 2^-32 a frame: a random checksum that fits is not seen here.
        prop_assert!(feed(&mut up, &bytes).is_empty() && feed(&mut down, &bytes).is_empty());
    }

    #[test]
    fn any_message_bytes_parse_or_not(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        // Behind the checksum: whatever parses also encodes, within the bounds.
        if let Ok((message, _)) = postcard::take_from_bytes::<Uplink>(&bytes) {
            prop_assert!(Encoder::default().encode(&message, &mut [0; MAX_FRAME]).is_ok());
        }
        if let Ok((message, _)) = postcard::take_from_bytes::<Downlink>(&bytes) {
            prop_assert!(Encoder::default().encode(&message, &mut [0; MAX_FRAME]).is_ok());
        }
    }

    #[test]
    fn damaged_streams(damages in proptest::collection::vec(damage(), 1..40)) {
        let sent = frames(damages.len());
        let mut pieces: Vec<Vec<u8>> = Vec::new();
        for (damage, (_, frame)) in damages.iter().zip(&sent) {
            pieces.push(apply(*damage, frame));
        }
        for i in 1..pieces.len() {
            if matches!(damages[i - 1], Damage::SwappedWithNext) {
                pieces.swap(i - 1, i);
            }
        }
        assert_no_false_accept(&pieces.concat(), &sent);
    }

    #[test]
    fn every_undamaged_frame_behind_a_zero_arrives(
        garbage in proptest::collection::vec(any::<u8>(), 0..300)
    ) {
        let sent = frames(6);
        let mut bytes = garbage;
        bytes.push(0);
        sent.iter().for_each(|(_, frame)| bytes.extend_from_slice(frame));
        prop_assert_eq!(assert_no_false_accept(&bytes, &sent), 6);
    }
}

#[test]
fn every_single_bit_flip_of_a_frame_is_caught() {
    let sent = frames(6);
    for (_, frame) in &sent {
        for bit in 0..8 * (frame.len() - 1) {
            let mut bytes = apply(Damage::BitFlipped(bit), frame);
            bytes.push(0);
            assert_eq!(assert_no_false_accept(&bytes, &sent), 0, "bit {bit}");
        }
    }
}

#[test]
fn every_truncation_of_a_frame_is_caught() {
    let sent = frames(6);
    for (_, frame) in &sent {
        for length in 1..frame.len() - 1 {
            let bytes = [&frame[..length], &[0]].concat();
            assert_eq!(assert_no_false_accept(&bytes, &sent), 0, "cut to {length}");
            assert_eq!(assert_no_false_accept(&frame[frame.len() - length..], &sent), 0);
        }
    }
}
