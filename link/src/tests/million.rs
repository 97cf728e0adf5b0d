//! A million damaged frames, of every kind of damage and of message, through the decoders of both
//! directions: each frame is judged by its checksum alone, as a decoder written from
//! `docs/protocol.md` judges it.

use super::*;
use crate::Telemetry;
use ctrl_core::mode::{Command, Mode};

/// Damaged frames in a direction.
const FRAMES: u32 = 550_000;
/// An undamaged frame follows so many damaged ones.
const GOOD_EVERY: u32 = 16;

/// xorshift64
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() >> 16) as usize % end.max(1)
    }

    /// Any but zero.
    fn byte(&mut self) -> u8 {
        (self.next() >> 24) as u8 | 1 << self.below(8)
    }
}

/// Damages a frame without its zero.
type Damage = fn(&mut Random, Vec<u8>) -> Vec<u8>;

const KINDS: [Damage; 12] = [
    bit_flipped,
    bits_flipped,
    byte_replaced,
    burst,
    zeroed,
    truncated,
    beginning_lost,
    byte_deleted,
    byte_inserted,
    halves_exchanged,
    checksum_replaced,
    prolonged,
];

fn bit_flipped(random: &mut Random, mut frame: Vec<u8>) -> Vec<u8> {
    let bit = random.below(8 * frame.len());
    frame[bit / 8] ^= 1 << (bit % 8);
    frame
}

fn bits_flipped(random: &mut Random, frame: Vec<u8>) -> Vec<u8> {
    (0..2 + random.below(6)).fold(frame, |frame, _| bit_flipped(random, frame))
}

fn byte_replaced(random: &mut Random, mut frame: Vec<u8>) -> Vec<u8> {
    let place = random.below(frame.len());
    frame[place] = frame[place].wrapping_add(random.byte());
    frame
}

fn burst(random: &mut Random, mut frame: Vec<u8>) -> Vec<u8> {
    let (place, length) = (random.below(frame.len()), 1 + random.below(32));
    frame.iter_mut().skip(place).take(length).for_each(|byte| *byte = random.byte());
    frame
}

fn zeroed(random: &mut Random, mut frame: Vec<u8>) -> Vec<u8> {
    let (place, length) = (random.below(frame.len()), 1 + random.below(8));
    frame.iter_mut().skip(place).take(length).for_each(|byte| *byte = 0);
    frame
}

fn truncated(random: &mut Random, mut frame: Vec<u8>) -> Vec<u8> {
    frame.truncate(random.below(frame.len()));
    frame
}

fn beginning_lost(random: &mut Random, mut frame: Vec<u8>) -> Vec<u8> {
    frame.drain(..1 + random.below(frame.len() - 1));
    frame
}

fn byte_deleted(random: &mut Random, mut frame: Vec<u8>) -> Vec<u8> {
    frame.remove(random.below(frame.len()));
    frame
}

fn byte_inserted(random: &mut Random, mut frame: Vec<u8>) -> Vec<u8> {
    frame.insert(random.below(frame.len()), random.byte());
    frame
}

fn halves_exchanged(random: &mut Random, mut frame: Vec<u8>) -> Vec<u8> {
    let place = 1 + random.below(frame.len() - 1);
    frame.rotate_left(place);
    frame
}

/// The content stays whole, so that nothing but the checksum can tell.
fn checksum_replaced(random: &mut Random, mut frame: Vec<u8>) -> Vec<u8> {
    let length = frame.len();
    frame[length - 4..].iter_mut().for_each(|byte| *byte = random.byte());
    frame
}

/// Longer than any frame may be.
fn prolonged(random: &mut Random, mut frame: Vec<u8>) -> Vec<u8> {
    for _ in 0..random.below(2 * MAX_FRAME) {
        frame.push(random.byte());
    }
    frame
}

/// The table of CRC-32/ISO-HDLC, from its polynomial.
fn table() -> [u32; 256] {
    core::array::from_fn(|byte| {
        let step = |crc: u32| crc >> 1 ^ if crc & 1 == 1 { 0xEDB8_8320 } else { 0 };
        (0..8).fold(byte as u32, |crc, _| step(crc))
    })
}

/// `true` if a frame without its zero has whole COBS runs, an allowed length and a right checksum.
fn is_whole(mut frame: &[u8], table: &[u32; 256]) -> bool {
    let mut payload = Vec::new();
    while let Some((code, rest)) = frame.split_first() {
        let Some((run, rest)) = rest.split_at_checked(usize::from(*code) - 1) else { return false };
        payload.extend_from_slice(run);
        if *code != u8::MAX && !rest.is_empty() {
            payload.push(0);
        }
        frame = rest;
    }
    let Some((content, checksum)) = payload.split_last_chunk() else { return false };
    let crc =
        content.iter().fold(u32::MAX, |crc, byte| crc >> 8 ^ table[usize::from(crc as u8 ^ byte)]);
    content.len() >= 3 && payload.len() <= MAX_FRAME - 2 && !crc == u32::from_le_bytes(*checksum)
}

/// Sends [`FRAMES`] damaged frames; how many of them had a right checksum all the same.
fn damaged_frames_with_a_right_checksum<M: Message>(messages: &[M], seed: u64) -> u32 {
    let (table, mut random) = (table(), Random(seed));
    let (mut encoder, mut decoder) = (Encoder::<M>::default(), Decoder::<M>::default());
    let (mut damaged, mut whole, mut good) = (0, 0, 0);
    while damaged < FRAMES {
        let message = &messages[random.below(messages.len())];
        let mut buffer = [0; MAX_FRAME];
        let sent = encoder.encode(message, &mut buffer).unwrap();
        let (content, _) = sent.split_at(sent.len() - 1);
        if damaged % GOOD_EVERY == GOOD_EVERY - 1 {
            assert!(is_whole(content, &table));
            assert_eq!(feed(&mut decoder, sent).len(), 1, "behind damage");
            good += 1;
        }
        let kind = KINDS[random.below(KINDS.len())];
        let line = kind(&mut random, content.to_vec());
        let pieces = || line.split(|byte| *byte == 0).filter(|piece| !piece.is_empty());
        if pieces().eq([content]) {
            continue; // the damage changed nothing
        }
        damaged += 1;
        let right = pieces().filter(|piece| is_whole(piece, &table)).count() as u32;
        let before = decoder.statistics();
        feed(&mut decoder, &line);
        feed(&mut decoder, &[0]);
        let seen = decoder.statistics();
        assert_eq!(seen.damaged - before.damaged, pieces().count() as u32 - right, "{line:x?}");
        let whole_now =
            |seen: LinkStatistics| seen.delivered + seen.foreign + seen.malformed + seen.late;
        assert_eq!(whole_now(seen) - whole_now(before), right, "{line:x?}");
        whole += right;
    }
    assert_eq!(damaged, FRAMES);
    assert_eq!(decoder.statistics().delivered, good + whole);
    assert!(good > FRAMES / GOOD_EVERY / 2);
    whole
}

fn uplink() -> Vec<Uplink> {
    let name = heapless::String::try_from("cascade.k1").unwrap();
    std::vec![
        Uplink::Hello,
        Uplink::Command(Command::Start),
        example_state(),
        example_reference(7),
        Uplink::SelectTrajectory(TrajectorySelection::UploadedPath),
        Uplink::Subscribe { period: 20 },
        Uplink::ParameterWrite { name, value: 0.5 },
        Uplink::ParametersForget,
    ]
}

fn downlink() -> Vec<Downlink> {
    let telemetry = Telemetry { mode: Mode::Flying, ..sizes::longest_telemetry() };
    let rejection = Rejection::UnknownParameter;
    let acknowledgement = Acknowledgement { sequence: 300, result: Err(rejection) };
    std::vec![
        Downlink::Acknowledgement(acknowledgement),
        Downlink::Telemetry(telemetry),
        Downlink::Lasting(sizes::longest_lasting()),
        Downlink::Health(Health::default()),
        Downlink::ParametersInForce(ParametersInForce::default()),
    ]
}

/// A damaged frame has a right checksum once in 2^32: not among these.
#[test]
fn a_million_damaged_frames_are_judged_by_their_checksums_and_none_passes() {
    let up = damaged_frames_with_a_right_checksum(&uplink(), 0x9E37_79B9_7F4A_7C15);
    let down = damaged_frames_with_a_right_checksum(&downlink(), 0xD1B5_4A32_D192_ED03);
    const { assert!(2 * FRAMES >= 1_000_000) }
    assert_eq!((up, down), (0, 0));
}
