//! A conversation with a vehicle, in the link's messages.

use std::path::Path;

use ctrl_core::vehicle::VehicleState;
use link::{
    Decoder, Downlink, Encoder, Health, Identity, LinkStatistics, MAX_FRAME, Rejection, Telemetry,
    Uplink,
};

use super::PilError;
use super::cost::CostUnit;
use super::emulator::Emulator;
use super::fault::LinkFaults;
use super::line::{Line, Wire};
use super::lockstep::Lockstep;
use super::recording::{Direction, Recording};

/// Releases of telemetry within which an answer must come: storing waits for housekeeping.
const ANSWER_WITHIN: usize = 200;
/// As many waits over a wire, a minute: a vehicle may be booting, or its emulator waiting for time.
const ANSWER_WITHIN_WIRE: usize = 3000;
/// Releases of telemetry within which a health report must come.
const HEALTH_WITHIN: usize = 200;
/// A message that has no answer after so many is sent again.
const AGAIN_AFTER: usize = 20;
/// Telemetry of a vehicle by the clock over a wire, which has room for every tick in lock step only
/// (ticks).
const SUBSCRIPTION: u16 = 20;

/// See the module's documentation.
#[derive(Debug)]
pub struct Session {
    line: Line,
    encoder: Encoder<Uplink>,
    decoder: Decoder<Downlink>,
    cost_unit: CostUnit,
    /// The vehicle's uptime (ticks), in the link's lock step.
    uptime: Option<u64>,
    recording: Option<Recording>,
    to_vehicle: Option<LinkFaults>,
    from_vehicle: Option<LinkFaults>,
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
        let line = Line::Fifos(Lockstep::start(emulator, directives)?);
        let mut session = Self::over(line, emulator.cost_unit(), recording);
        let greeting = session.listen()?;
        Ok((session, greeting))
    }

    /// Speaks to the vehicle at a serial port at `rate` bits a second, and ends a lock step that an
    /// earlier host has left it in.
    ///
    /// # Errors
    /// When the port cannot be opened, or nobody answers.
    pub fn attach(
        port: &Path,
        rate: u32,
        cost_unit: CostUnit,
        recording: Option<Recording>,
    ) -> Result<Self, PilError> {
        let line = Line::Serial(Wire::open(port, rate)?);
        let mut session = Self::over(line, cost_unit, recording);
        session.line.send(&[0])?; // ends what an earlier host may have begun
        let board = session.greet()?.board;
        session.cost_unit = cost_unit.on(&board);
        session.leave_lock_step()?;
        Ok(session)
    }

    fn over(line: Line, cost_unit: CostUnit, recording: Option<Recording>) -> Self {
        let (encoder, decoder) = (Encoder::default(), Decoder::default());
        let (to_vehicle, from_vehicle) = (None, None);
        let uptime = None;
        Self { line, encoder, decoder, cost_unit, uptime, recording, to_vehicle, from_vehicle }
    }

    /// How often to listen for an answer.
    fn patience(&self) -> usize {
        match self.line {
            Line::Fifos(_) => ANSWER_WITHIN,
            Line::Serial(_) => ANSWER_WITHIN_WIRE,
        }
    }

    /// Sends messages, lets the vehicle go on to its next release of telemetry, or in lock step by one
    /// tick, and returns what it has sent until then.
    ///
    /// # Errors
    /// When the vehicle is gone or silent.
    pub fn say(&mut self, messages: &[Uplink]) -> Result<Vec<Downlink>, PilError> {
        let frames = self.frames(messages);
        let mut bytes = match &mut self.to_vehicle {
            Some(faults) => faults.pass(frames),
            None => frames.concat(),
        };
        let Some(uptime) = self.uptime else { return self.say_bytes(&bytes) };
        bytes.push(0); // ends what is left of a damaged frame
        bytes.extend(step(&mut self.encoder, uptime + 1));
        self.send(&bytes)?;
        self.listen_for_step(uptime + 1)
    }

    /// Damages frames of a direction from now on; `None` ends it. What makes the lock step is spared.
    /// Returns what did so until now.
    pub fn inject(
        &mut self,
        direction: Direction,
        faults: Option<LinkFaults>,
    ) -> Option<LinkFaults> {
        let line = match direction {
            Direction::ToVehicle => &mut self.to_vehicle,
            Direction::FromVehicle => &mut self.from_vehicle,
        };
        std::mem::replace(line, faults)
    }

    /// Whether what the vehicle says may not arrive.
    #[must_use]
    pub fn hears_badly(&self) -> bool {
        self.from_vehicle.is_some()
    }

    /// Lets this host decide when the vehicle's control ticks begin, with its rotors off.
    ///
    /// # Errors
    /// When the vehicle refuses or is silent.
    pub fn enter_lock_step(&mut self) -> Result<(), PilError> {
        let mut heard = self.say(&[Uplink::LockStep(true)])?;
        let mut refused = None;
        for round in 1..=self.patience() {
            for message in heard {
                match message {
                    Downlink::Stepped { uptime_ticks } => {
                        self.uptime = Some(uptime_ticks);
                        return Ok(());
                    }
                    Downlink::Acknowledgement(answer) => refused = answer.result.err(),
                    _ => {}
                }
            }
            let again = [Uplink::LockStep(true)];
            heard = self.say(if round % AGAIN_AFTER == 0 { &again } else { &[] })?;
        }
        let what = "lock step".to_owned();
        Err(match refused {
            Some(rejection) => PilError::Refused(what, rejection),
            None => PilError::Answer(what, "nothing".to_owned()),
        })
    }

    /// Lets the vehicle's clock decide again; it is disarmed.
    ///
    /// # Errors
    /// When the vehicle is silent.
    pub fn leave_lock_step(&mut self) -> Result<(), PilError> {
        self.uptime = None;
        let mut asked = Vec::new();
        for round in 0..self.patience() {
            let again = [Uplink::LockStep(false)];
            let ask = round % AGAIN_AFTER == 0;
            if ask {
                asked.push(self.encoder.next_sequence());
            }
            let heard = self.say(if ask { &again } else { &[] })?;
            if asked.iter().any(|sequence| answer_to(*sequence, &heard).is_some()) {
                return Ok(());
            }
        }
        Err(PilError::Answer("to leave lock step".to_owned(), "nothing".to_owned()))
    }

    /// The frames that carry messages, with the next numbers.
    pub fn frames(&mut self, messages: &[Uplink]) -> Vec<Vec<u8>> {
        let mut frame = [0; MAX_FRAME];
        let encoded = messages.iter().filter_map(|message| {
            self.encoder.encode(message, &mut frame).ok().map(<[u8]>::to_vec) // every one fits
        });
        encoded.collect()
    }

    /// Sends bytes, whatever they are, in place of frames, to a vehicle by its clock.
    ///
    /// # Errors
    /// As [`say`](Self::say).
    pub fn say_bytes(&mut self, bytes: &[u8]) -> Result<Vec<Downlink>, PilError> {
        self.send(bytes)?;
        self.listen()
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), PilError> {
        self.record(Direction::ToVehicle, bytes);
        self.line.send(bytes)
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
        let packet = self.line.listen()?;
        self.record(Direction::FromVehicle, &packet);
        let line = match &mut self.from_vehicle {
            Some(faults) => faults.pass(whole_frames(&packet)),
            None => packet,
        };
        Ok(self.hear(&line))
    }

    /// Listens until the vehicle's uptime is `wanted`.
    fn listen_for_step(&mut self, wanted: u64) -> Result<Vec<Downlink>, PilError> {
        let encoder = &mut self.encoder;
        let again = || [&[0][..], &step(encoder, wanted)].concat();
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
        Ok(self.hear(&line))
    }

    fn hear(&mut self, line: &[u8]) -> Vec<Downlink> {
        let received = line.iter().filter_map(|byte| self.decoder.push(*byte));
        received.map(|received| received.message).collect()
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
        for _ in 0..self.patience() {
            if let Some(result) = answer_to(sequence, &heard) {
                return Ok(result);
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
        let identity = self.greet()?;
        // In lock step any subscription gives every tick.
        let period = if self.uptime.is_some() { SUBSCRIPTION } else { 1 };
        self.demand("telemetry at every tick", Uplink::Subscribe { period }, state)?;
        Ok(identity)
    }

    /// Greets the vehicle; returns who it is.
    fn greet(&mut self) -> Result<Identity, PilError> {
        let mut heard = self.say(&[Uplink::Hello])?;
        for round in 1..=self.patience() {
            let identity = heard.into_iter().find_map(|message| match message {
                Downlink::Identity(identity) => Some(identity),
                _ => None,
            });
            if let Some(identity) = identity {
                return Ok(identity);
            }
            let again = [Uplink::Hello];
            heard = self.say(if round % AGAIN_AFTER == 0 { &again } else { &[] })?;
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

    /// What the vehicle counts the cost of a tick in.
    #[must_use]
    pub fn cost_unit(&self) -> CostUnit {
        self.cost_unit
    }

    /// The line below the messages.
    pub fn line(&mut self) -> &mut Line {
        &mut self.line
    }
}

/// The frame that asks for the tick after which the uptime is `uptime_ticks`.
fn step(encoder: &mut Encoder<Uplink>, uptime_ticks: u64) -> Vec<u8> {
    let mut frame = [0; MAX_FRAME];
    let encoded = encoder.encode(&Uplink::Step { uptime_ticks }, &mut frame);
    encoded.map(<[u8]>::to_vec).unwrap_or_default() // it fits
}

/// The uptime that the last frame of `bytes` tells, if it is whole and does.
fn stepped(bytes: &[u8]) -> Option<u64> {
    let (_, before) = bytes.split_last().filter(|(last, _)| **last == 0)?;
    let start = before.iter().rposition(|byte| *byte == 0).map_or(0, |zero| zero + 1);
    let mut decoder = Decoder::<Downlink>::default();
    let heard = bytes[start..].iter().filter_map(|byte| decoder.push(*byte)).last()?;
    match heard.message {
        Downlink::Stepped { uptime_ticks } => Some(uptime_ticks),
        _ => None,
    }
}

/// Frames with their zeros; what is behind the last zero is one, too.
fn whole_frames(bytes: &[u8]) -> Vec<Vec<u8>> {
    bytes.split_inclusive(|byte| *byte == 0).map(<[u8]>::to_vec).collect()
}

/// The answer to the frame with a number.
fn answer_to(sequence: u16, heard: &[Downlink]) -> Option<Result<(), Rejection>> {
    heard.iter().find_map(|message| match message {
        Downlink::Acknowledgement(answer) if answer.sequence == sequence => {
            Some(answer.result.clone())
        }
        _ => None,
    })
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
