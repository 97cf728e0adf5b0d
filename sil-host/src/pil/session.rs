//! A conversation with a vehicle in lock step, in the link's messages.

use ctrl_core::link::{
    Decoder, Downlink, Encoder, Health, Identity, LinkStatistics, MAX_FRAME, Rejection, Telemetry,
    Uplink,
};
use ctrl_core::vehicle::VehicleState;

use super::PilError;
use super::emulator::Emulator;
use super::fault::LinkFaults;
use super::lockstep::{Lockstep, PATIENCE};
use super::recording::{Direction, Recording};

/// Releases of telemetry within which an answer must come: storing waits for housekeeping.
const ANSWER_WITHIN: usize = 200;
/// Releases of telemetry within which a health report must come.
const HEALTH_WITHIN: usize = 200;

/// See the module's documentation.
#[derive(Debug)]
pub struct Session {
    line: Lockstep,
    encoder: Encoder<Uplink>,
    decoder: Decoder<Downlink>,
    cost_of_instruction: u32,
    recording: Option<Recording>,
    faults: Option<LinkFaults>,
}

impl Session {
    /// Boots the image with `directives` and waits for its greeting.
    ///
    /// # Errors
    /// When the image does not start or stays silent.
    pub fn boot(
        emulator: &Emulator,
        directives: &[String],
    ) -> Result<(Self, Vec<Downlink>), PilError> {
        Self::boot_recorded(emulator, directives, None)
    }

    /// As [`boot`](Self::boot); every byte goes into `recording` as well.
    ///
    /// # Errors
    /// As [`boot`](Self::boot).
    pub fn boot_recorded(
        emulator: &Emulator,
        directives: &[String],
        recording: Option<Recording>,
    ) -> Result<(Self, Vec<Downlink>), PilError> {
        let line = Lockstep::start(emulator, directives)?;
        let cost_of_instruction = emulator.cost_of_instruction();
        let (encoder, decoder) = (Encoder::default(), Decoder::default());
        let mut session =
            Self { line, encoder, decoder, cost_of_instruction, recording, faults: None };
        let greeting = session.listen()?;
        Ok((session, greeting))
    }

    /// Sends messages, lets the vehicle go on to its next release of telemetry, and returns what it
    /// has sent until then.
    ///
    /// # Errors
    /// When the vehicle is gone or silent.
    pub fn say(&mut self, messages: &[Uplink]) -> Result<Vec<Downlink>, PilError> {
        let frames = self.frames(messages);
        let bytes = match &mut self.faults {
            Some(faults) => faults.pass(frames),
            None => frames.concat(),
        };
        self.say_bytes(&bytes)
    }

    /// Damages what is said from now on; `None` ends it. Returns what did so until now.
    pub fn inject(&mut self, faults: Option<LinkFaults>) -> Option<LinkFaults> {
        std::mem::replace(&mut self.faults, faults)
    }

    /// The frames that carry messages, with the next numbers.
    pub fn frames(&mut self, messages: &[Uplink]) -> Vec<Vec<u8>> {
        let mut frame = [0; MAX_FRAME];
        let encoded = messages.iter().filter_map(|message| {
            self.encoder.encode(message, &mut frame).ok().map(<[u8]>::to_vec) // every one fits
        });
        encoded.collect()
    }

    /// Sends bytes, whatever they are, in place of frames.
    ///
    /// # Errors
    /// As [`say`](Self::say).
    pub fn say_bytes(&mut self, bytes: &[u8]) -> Result<Vec<Downlink>, PilError> {
        self.record(Direction::ToVehicle, bytes);
        self.line.send(bytes)?;
        self.listen()
    }

    fn record(&mut self, direction: Direction, bytes: &[u8]) {
        if let Some(recording) = &mut self.recording {
            recording.packets.push((direction, bytes.to_vec()));
        }
    }

    /// What has been recorded, if anything is; nothing is from now on.
    pub fn take_recording(&mut self) -> Option<Recording> {
        self.recording.take()
    }

    fn listen(&mut self) -> Result<Vec<Downlink>, PilError> {
        let packet = self.line.receive(PATIENCE)?;
        self.record(Direction::FromVehicle, &packet);
        let received = packet.into_iter().filter_map(|byte| self.decoder.push(byte));
        Ok(received.map(|received| received.message).collect())
    }

    /// Sends a message and, at each release, a state, until the message is acknowledged.
    ///
    /// # Errors
    /// As [`say`](Self::say), and when no acknowledgement comes.
    pub fn ask(
        &mut self,
        message: Uplink,
        state: VehicleState,
    ) -> Result<Result<(), Rejection>, PilError> {
        let asked = format!("{message:?}");
        let sequence = self.encoder.next_sequence();
        let sample = Uplink::State { tick: 0, state };
        let mut heard = self.say(&[message, sample.clone()])?;
        for _ in 0..ANSWER_WITHIN {
            for message in heard {
                if let Downlink::Acknowledgement(answer) = message
                    && answer.sequence == sequence
                {
                    return Ok(answer.result);
                }
            }
            heard = self.say(std::slice::from_ref(&sample))?;
        }
        Err(PilError::Answer(asked, "nothing".to_owned()))
    }

    /// As [`ask`](Self::ask); `what` the message asks for.
    ///
    /// # Errors
    /// As [`ask`](Self::ask), and when the vehicle refuses.
    pub fn demand(
        &mut self,
        what: &str,
        message: Uplink,
        state: VehicleState,
    ) -> Result<(), PilError> {
        self.ask(message, state)?.map_err(|rejection| PilError::Refused(what.to_owned(), rejection))
    }

    /// Greets the vehicle and has it send telemetry at every tick; returns who it is.
    ///
    /// # Errors
    /// As [`demand`](Self::demand).
    pub fn subscribe(&mut self, state: VehicleState) -> Result<Identity, PilError> {
        let mut heard = self.say(&[Uplink::Hello])?;
        for _ in 0..ANSWER_WITHIN {
            let identity = heard.into_iter().find_map(|message| match message {
                Downlink::Identity(identity) => Some(identity),
                _ => None,
            });
            if let Some(identity) = identity {
                self.demand("telemetry at every tick", Uplink::Subscribe { period: 1 }, state)?;
                return Ok(identity);
            }
            heard = self.say(&[])?;
        }
        Err(PilError::Answer("Hello".to_owned(), "nothing".to_owned()))
    }

    /// Sends messages for one tick and returns its telemetry.
    ///
    /// # Errors
    /// As [`say`](Self::say), and when not exactly one telemetry comes.
    pub fn tick(&mut self, messages: &[Uplink]) -> Result<Telemetry, PilError> {
        let heard = self.say(messages)?;
        one_telemetry(&heard)
    }

    /// The next health report.
    ///
    /// # Errors
    /// As [`say`](Self::say), and when none comes.
    pub fn health(&mut self, state: VehicleState) -> Result<Health, PilError> {
        for _ in 0..HEALTH_WITHIN {
            for message in self.say(&[Uplink::State { tick: 0, state }])? {
                if let Downlink::Health(health) = message {
                    return Ok(health);
                }
            }
        }
        Err(PilError::Answer("a health report".to_owned(), "nothing".to_owned()))
    }

    /// What the host's decoder counted.
    #[must_use]
    pub fn statistics(&self) -> LinkStatistics {
        self.decoder.statistics()
    }

    /// Counts of the image's cost counter in an instruction.
    #[must_use]
    pub fn cost_of_instruction(&self) -> u32 {
        self.cost_of_instruction
    }

    /// The line below the messages.
    pub fn line(&mut self) -> &mut Lockstep {
        &mut self.line
    }
}

/// The only telemetry among messages.
///
/// # Errors
/// When there is none or more than one.
pub fn one_telemetry(heard: &[Downlink]) -> Result<Telemetry, PilError> {
    let mut telemetry = heard.iter().filter_map(|message| match message {
        Downlink::Telemetry(telemetry) => Some(*telemetry),
        _ => None,
    });
    match (telemetry.next(), telemetry.next()) {
        (Some(telemetry), None) => Ok(telemetry),
        _ => Err(PilError::Answer("one telemetry in a tick".to_owned(), format!("{heard:?}"))),
    }
}
