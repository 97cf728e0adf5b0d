//! Any bytes through the decoders of both directions.
//!
//! An even first byte: the rest is the stream. An odd one: the rest is the contents of frames, each
//! behind its length, and gets right checksums, so that the parser behind the checksum is reached.
#![no_main]

use crc::{CRC_32_ISO_HDLC, Crc};
use libfuzzer_sys::fuzz_target;
use link::{
    Decoder, Downlink, Encoder, FaultKind, FaultReport, LinkStatistics, MAX_FRAME, Message,
    REGISTERS, Uplink,
};

const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

fuzz_target!(|data: &[u8]| {
    let Some((kind, bytes)) = data.split_first() else { return };
    let mut stream = if kind % 2 == 0 { bytes.to_vec() } else { framed(bytes) };
    stream.push(0);
    let report = FaultReport {
        kind: FaultKind::Panic,
        uptime_ticks: 1,
        registers: [0; REGISTERS],
        line: 2,
        text: heapless::String::new(),
    };
    let up = decode::<Uplink>(&stream, &Uplink::Hello);
    let down = decode::<Downlink>(&stream, &Downlink::Fault(report));
    // Frames of this version belong to one direction only.
    assert!(up.delivered == 0 || down.foreign >= up.delivered, "{up:?} {down:?}");
});

/// Frames with right checksums around contents that stand behind their lengths.
fn framed(mut contents: &[u8]) -> Vec<u8> {
    let mut stream = Vec::new();
    while let Some((length, rest)) = contents.split_first() {
        let (content, rest) = rest.split_at(usize::from(*length).min(rest.len()));
        let payload = [content, &CRC.checksum(content).to_le_bytes()].concat();
        let mut frame = vec![0; cobs::max_encoding_length(payload.len()) + 1];
        let length = cobs::encode(&payload, &mut frame);
        stream.extend_from_slice(&frame[..=length]);
        contents = rest;
    }
    stream
}

/// Feeds a stream that ends with a zero; every frame of it is counted once, and as what it is.
fn decode<M: Message>(stream: &[u8], last: &M) -> LinkStatistics {
    let mut decoder = Decoder::<M>::default();
    let received: Vec<_> = stream.iter().filter_map(|byte| decoder.push(*byte)).collect();
    let seen = decoder.statistics();
    let frames = || stream.split(|byte| *byte == 0).filter(|frame| !frame.is_empty());
    let whole = frames().filter(|frame| is_whole(frame)).count();
    assert_eq!(seen.damaged as usize, frames().count() - whole, "{seen:?}");
    assert_eq!((seen.delivered + seen.foreign + seen.malformed + seen.late) as usize, whole);
    assert_eq!(seen.delivered as usize, received.len());
    received.iter().for_each(|received| assert_comes_back(&received.message));
    // The next frame is delivered whatever came before, unless its number is behind the last.
    let frame = frame_of(last);
    let delivered = frame.iter().filter_map(|byte| decoder.push(*byte)).count();
    let late = decoder.statistics().late - seen.late;
    assert_eq!(delivered + late as usize, 1);
    seen
}

/// `true` if a frame, without its zero, has whole COBS runs, a length that is allowed and a right
/// checksum; straight from `docs/protocol.md`.
fn is_whole(mut frame: &[u8]) -> bool {
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
    content.len() >= 3
        && payload.len() <= MAX_FRAME - 2
        && CRC.checksum(content) == u32::from_le_bytes(*checksum)
}

/// Whatever is delivered fits a frame, and comes back from it the same to the byte.
fn assert_comes_back<M: Message>(message: &M) {
    let frame = frame_of(message);
    let mut decoder = Decoder::<M>::default();
    let back: Vec<_> = frame.iter().filter_map(|byte| decoder.push(*byte)).collect();
    assert_eq!(back.len(), 1);
    assert_eq!(frame_of(&back[0].message), frame);
}

fn frame_of<M: Message>(message: &M) -> Vec<u8> {
    Encoder::default().encode(message, &mut [0; MAX_FRAME]).unwrap().to_vec()
}
