//! A session with a vehicle, in the link's messages.

mod handshake;
mod lock_step;
mod transport;

use std::path::Path;

use ctrl_core::vehicle::VehicleState;
use link::{Decoder, Downlink, Encoder, Health, LinkStatistics, Rejection, Telemetry, Uplink};

use super::PilError;
use super::cost::CostUnit;
use super::emulator::Emulator;
use super::fault::LinkFaults;
use super::line::{Line, Wire};
use super::lockstep::Lockstep;
use super::recording::{Direction, Recording};

/// Releases of telemetry within which an answer must come: storing is done by housekeeping.
const ANSWER_WITHIN: usize = 200;
/// As many waits over a wire, a minute: a vehicle may be booting, or its emulator may be slow.
const ANSWER_WITHIN_WIRE: usize = 3000;
/// Releases of telemetry within which a health report must come.
const HEALTH_WITHIN: usize = 200;
/// Releases of telemetry without an answer after which a message is sent again.
const AGAIN_AFTER: usize = 20;

/// See the module's documentation.
#[derive(Debug)]
pub struct VehicleSession {
    line: Line,
    encoder: Encoder<Uplink>,
    decoder: Decoder<Downlink>,
    cost_unit: CostUnit,
    /// The vehicle's uptime (ticks), in the link's lock step.
    uptime: Option<u64>,
    /// Tick of the latest state sample: a vehicle in flight drops older ones.
    latest_tick: u64,
    recording: Option<Recording>,
    to_vehicle: Option<LinkFaults>,
    from_vehicle: Option<LinkFaults>,
    /// The vehicle estimates its state from sensors.
    by_sensors: bool,
}

impl VehicleSession {
    /// Boots the image with `directives` and receives its first messages.
    ///
    /// # Errors
    /// When the image does not start or stays silent.
    pub fn boot(
        emulator: &Emulator,
        directives: &[String],
    ) -> Result<(Self, Vec<Downlink>), PilError> {
        Self::boot_recorded(emulator, directives, None)
    }

    /// As [`boot`](Self::boot), with `mavlink` as QEMU's character device behind the ground station's port.
    ///
    /// # Errors
    /// As [`boot`](Self::boot).
    pub fn boot_with_mavlink(
        emulator: &Emulator,
        directives: &[String],
        mavlink: &str,
    ) -> Result<Self, PilError> {
        let line = Line::Fifos(Lockstep::start_with(emulator, directives, mavlink)?);
        let mut session = Self::over(line, emulator.cost_unit(), None);
        session.receive_packet()?;
        Ok(session)
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
        let first = session.receive_packet()?;
        Ok((session, first))
    }

    /// Attaches to the vehicle at a serial port at `rate` (bit/s), and ends a lock step that an
    /// earlier host has left it in.
    ///
    /// # Errors
    /// When the port cannot be opened, or no vehicle answers.
    pub fn attach(
        port: &Path,
        rate: u32,
        cost_unit: CostUnit,
        recording: Option<Recording>,
    ) -> Result<Self, PilError> {
        let line = Line::Serial(Wire::open(port, rate)?);
        let mut session = Self::over(line, cost_unit, recording);
        session.line.send(&[0])?; // ends what an earlier host may have begun
        let board = session.handshake()?.board;
        session.cost_unit = cost_unit.on(&board);
        session.leave_lock_step()?;
        Ok(session)
    }

    fn over(line: Line, cost_unit: CostUnit, recording: Option<Recording>) -> Self {
        Self {
            line,
            encoder: Encoder::default(),
            decoder: Decoder::default(),
            cost_unit,
            uptime: None,
            latest_tick: 0,
            recording,
            to_vehicle: None,
            from_vehicle: None,
            by_sensors: false,
        }
    }

    /// Releases of telemetry, or waits of a wire, within which an answer must come.
    fn patience(&self) -> usize {
        match self.line {
            Line::Fifos(_) => ANSWER_WITHIN,
            Line::Serial(_) => ANSWER_WITHIN_WIRE,
        }
    }

    /// Damages frames of a direction from now on; `None` ends it. The frames of the lock step are
    /// spared. Returns the faults of the direction until now.
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

    /// `true` if frames from the vehicle may not arrive.
    #[must_use]
    pub fn is_lossy(&self) -> bool {
        self.from_vehicle.is_some()
    }

    /// Recorded bytes, if there are any; nothing is recorded from now on.
    pub fn take_recording(&mut self) -> Option<Recording> {
        self.recording.take()
    }

    /// A state sample of the same tick as the latest.
    fn repeated(&self, state: VehicleState) -> Uplink {
        if self.by_sensors {
            return Uplink::EstimatorStart(state);
        }
        Uplink::State { tick: self.latest_tick, state }
    }

    /// A sample of the vehicle on the ground.
    #[must_use]
    pub fn on_ground(&self, state: VehicleState) -> Uplink {
        if self.by_sensors {
            Uplink::EstimatorStart(state)
        } else {
            Uplink::State { tick: 0, state }
        }
    }

    /// From now on the vehicle estimates its state from sensors.
    pub fn fly_by_sensors(&mut self) {
        self.by_sensors = true;
    }

    /// Sends a message and, at each release, a state, until the message is acknowledged.
    ///
    /// # Errors
    /// As [`send`](Self::send), and when no acknowledgement comes.
    pub fn ask(
        &mut self,
        message: Uplink,
        state: VehicleState,
    ) -> Result<Result<(), Rejection>, PilError> {
        let asked = format!("{message:?}");
        let sequence = self.encoder.next_sequence();
        let sample = self.repeated(state);
        let mut received = self.send(&[message, sample.clone()])?;
        for _ in 0..self.patience() {
            if let Some(result) = answer_to(sequence, &received) {
                return Ok(result);
            }
            received = self.send(std::slice::from_ref(&sample))?;
        }
        Err(PilError::Answer(asked, "nothing".to_owned()))
    }

    /// As [`ask`](Self::ask), for a message that must be accepted; `what` describes it in the error.
    ///
    /// # Errors
    /// As [`ask`](Self::ask), and when the vehicle refuses.
    pub fn expect_ok(
        &mut self,
        what: &str,
        message: Uplink,
        state: VehicleState,
    ) -> Result<(), PilError> {
        self.ask(message, state)?.map_err(|rejection| PilError::Refused(what.to_owned(), rejection))
    }

    /// Sends messages for one tick and returns its telemetry.
    ///
    /// # Errors
    /// As [`send`](Self::send), and when not exactly one telemetry comes.
    pub fn tick(&mut self, messages: &[Uplink]) -> Result<Telemetry, PilError> {
        let received = self.send(messages)?;
        one_telemetry(&received)
    }

    /// The next health report.
    ///
    /// # Errors
    /// As [`send`](Self::send), and when none comes.
    pub fn health(&mut self, state: VehicleState) -> Result<Health, PilError> {
        for _ in 0..HEALTH_WITHIN {
            for message in self.send(&[self.repeated(state)])? {
                if let Downlink::Health(health) = message {
                    return Ok(health);
                }
            }
        }
        Err(PilError::Answer("a health report".to_owned(), "nothing".to_owned()))
    }

    /// Counts of the host's decoder.
    #[must_use]
    pub fn statistics(&self) -> LinkStatistics {
        self.decoder.statistics()
    }

    /// Unit of the cost of a tick on the vehicle.
    #[must_use]
    pub fn cost_unit(&self) -> CostUnit {
        self.cost_unit
    }

    /// The line below the messages.
    pub fn line(&mut self) -> &mut Line {
        &mut self.line
    }
}

/// The answer to the frame with a number.
fn answer_to(sequence: u16, received: &[Downlink]) -> Option<Result<(), Rejection>> {
    received.iter().find_map(|message| match message {
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
pub fn one_telemetry(received: &[Downlink]) -> Result<Telemetry, PilError> {
    let mut telemetry = received.iter().filter_map(|message| match message {
        Downlink::Telemetry(telemetry) => Some(*telemetry),
        _ => None,
    });
    match (telemetry.next(), telemetry.next()) {
        (Some(telemetry), None) => Ok(telemetry),
        _ => Err(PilError::Answer("one telemetry in a tick".to_owned(), format!("{received:?}"))),
    }
}
