//! Frames and bytes of a session: encoding, faults, recording, the requests of lock step.

use link::{Decoder, Downlink, Encoder, MAX_FRAME, Uplink};

use super::VehicleSession;
use crate::pil::PilError;
use crate::pil::recording::Direction;

impl VehicleSession {
    /// Sends messages, lets the vehicle proceed to its next release of telemetry, or in lock step by
    /// one tick, and returns the messages that it has sent until then.
    ///
    /// # Errors
    /// When the vehicle is gone or silent.
    pub fn send(&mut self, messages: &[Uplink]) -> Result<Vec<Downlink>, PilError> {
        let bytes = self.packet(messages, 0);
        self.transmit(&bytes)?;
        self.receive()
    }

    /// Bytes that carry messages and let the vehicle proceed as [`send`](Self::send) does, `ahead` ticks after it will
    /// have proceeded by what has been sent before.
    pub fn packet(&mut self, messages: &[Uplink], ahead: u64) -> Vec<u8> {
        let frames = self.frames(messages);
        let mut bytes = match &mut self.to_vehicle {
            Some(faults) => faults.pass(frames),
            None => frames.concat(),
        };
        if let Some(uptime) = self.uptime {
            bytes.push(0); // ends what is left of a damaged frame
            bytes.extend(step_frame(&mut self.encoder, uptime + ahead + 1));
        }
        bytes
    }

    /// Sends packets of several ticks at once. Each is to be [received](Self::receive).
    ///
    /// # Errors
    /// When the line fails.
    pub fn send_ahead(&mut self, packets: &[Vec<u8>]) -> Result<(), PilError> {
        for packet in packets {
            self.record(Direction::ToVehicle, packet);
        }
        self.line.send_all(packets)
    }

    /// The messages that the vehicle has sent until it took the oldest packet that has not been answered.
    ///
    /// # Errors
    /// As [`send`](Self::send).
    pub fn receive(&mut self) -> Result<Vec<Downlink>, PilError> {
        match self.uptime {
            Some(uptime) => self.receive_step(uptime + 1),
            None => self.receive_packet(),
        }
    }

    /// The frames that carry messages, with the next numbers.
    pub fn frames(&mut self, messages: &[Uplink]) -> Vec<Vec<u8>> {
        let mut frame = [0; MAX_FRAME];
        let mut frames = Vec::new();
        for message in messages {
            if let Uplink::State { tick, .. } = message {
                self.latest_tick = *tick;
            }
            // Every message fits a frame.
            frames.extend(self.encoder.encode(message, &mut frame).ok().map(<[u8]>::to_vec));
        }
        frames
    }

    /// Sends any bytes in place of frames, to a vehicle whose ticks begin by its timer.
    ///
    /// # Errors
    /// As [`send`](Self::send).
    pub fn send_bytes(&mut self, bytes: &[u8]) -> Result<Vec<Downlink>, PilError> {
        self.transmit(bytes)?;
        self.receive_packet()
    }

    fn transmit(&mut self, bytes: &[u8]) -> Result<(), PilError> {
        self.record(Direction::ToVehicle, bytes);
        self.line.send(bytes)
    }

    fn record(&mut self, direction: Direction, bytes: &[u8]) {
        if let Some(recording) = &mut self.recording {
            recording.packets.push((direction, bytes.to_vec()));
        }
    }

    pub(super) fn receive_packet(&mut self) -> Result<Vec<Downlink>, PilError> {
        let packet = self.line.listen()?;
        self.record(Direction::FromVehicle, &packet);
        let line = match &mut self.from_vehicle {
            Some(faults) => faults.pass(whole_frames(&packet)),
            None => packet,
        };
        Ok(self.decode(&line))
    }

    /// Receives until the vehicle's uptime is `wanted`.
    fn receive_step(&mut self, wanted: u64) -> Result<Vec<Downlink>, PilError> {
        let encoder = &mut self.encoder;
        let again = || [&[0][..], &step_frame(encoder, wanted)].concat();
        let packet = self.line.listen_until(again, |bytes| stepped(bytes) == Some(wanted))?;
        self.record(Direction::FromVehicle, &packet);
        let stepped = stepped(&packet);
        if stepped != Some(wanted) {
            let came = format!("{stepped:?}, it may have restarted");
            return Err(PilError::Answer(format!("to step to tick {wanted}"), came));
        }
        self.uptime = Some(wanted);
        let mut frames = whole_frames(&packet);
        let line = match (&mut self.from_vehicle, frames.pop()) {
            (Some(faults), Some(last)) => {
                let mut line = faults.pass(frames);
                line.push(0);
                line.extend(last);
                line
            }
            _ => packet,
        };
        Ok(self.decode(&line))
    }

    fn decode(&mut self, line: &[u8]) -> Vec<Downlink> {
        let received = line.iter().filter_map(|byte| self.decoder.push(*byte));
        received.map(|received| received.message).collect()
    }
}

/// The frame that requests the tick after which the uptime is `uptime_ticks`.
fn step_frame(encoder: &mut Encoder<Uplink>, uptime_ticks: u64) -> Vec<u8> {
    let mut frame = [0; MAX_FRAME];
    let encoded = encoder.encode(&Uplink::Step { uptime_ticks }, &mut frame);
    encoded.map(<[u8]>::to_vec).unwrap_or_default() // it fits
}

/// The uptime in the last frame of `bytes`, if that is a whole `Stepped`.
fn stepped(bytes: &[u8]) -> Option<u64> {
    let (_, before) = bytes.split_last().filter(|(last, _)| **last == 0)?;
    let start = before.iter().rposition(|byte| *byte == 0).map_or(0, |zero| zero + 1);
    let mut decoder = Decoder::<Downlink>::default();
    let received = bytes[start..].iter().filter_map(|byte| decoder.push(*byte)).last()?;
    match received.message {
        Downlink::Stepped { uptime_ticks } => Some(uptime_ticks),
        _ => None,
    }
}

/// Frames with their zeros; bytes behind the last zero count as one, too.
fn whole_frames(bytes: &[u8]) -> Vec<Vec<u8>> {
    bytes.split_inclusive(|byte| *byte == 0).map(<[u8]>::to_vec).collect()
}
