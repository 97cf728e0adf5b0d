//! MAVLink on a port of its own: bytes of a ground station in, frames out, with the session and its pilot as the
//! vehicle.
//!
//! Pure: the task that owns it gives bytes, time and state, and takes frames. Work of one release is bounded by
//! [`BYTES_PER_RELEASE`] and [`SENT_PER_RELEASE`], whatever comes.

use core::mem::MaybeUninit;

use ctrl_core::controller::AdaptiveController;
use mavlink_vehicle::{
    Decoder, Frame, Line, Packet, Protocol, ProtocolConfig, ProtocolMemory, SigningKey, View,
};

use crate::exchange::{ControlStatus, ControlView};
use crate::pilot::{Pilot, PilotedVehicle};
use crate::rates::TICK;
use crate::session::{HostSession, SigningChange};
use crate::stored_signing::{AHEAD, StartedSigning, StoredSigning};

/// Ticks from one release of the task to the next.
pub const RELEASE_EVERY: u32 = 4;
/// Most bytes that one release handles; a port of 921,600 bit/s brings 369 in 4 ms.
pub const BYTES_PER_RELEASE: usize = 384;
/// Most frames that one release sends.
pub const SENT_PER_RELEASE: usize = 4;

/// Major, minor and patch of this package's version as `AUTOPILOT_VERSION` has them.
const VERSION: u32 = version(env!("CARGO_PKG_VERSION").as_bytes());

const fn version(text: &[u8]) -> u32 {
    let (mut packed, mut part, mut place) = (0, 0, 0);
    while place < text.len() {
        if text[place] == b'.' {
            (packed, part) = (packed << 8 | part, 0);
        } else {
            part = part * 10 + (text[place] - b'0') as u32;
        }
        place += 1;
    }
    (packed << 8 | part) << 8
}

/// See the module's documentation.
#[derive(Debug)]
pub struct GroundStation {
    decoder: Decoder,
    protocol: Protocol<'static>,
    /// Releases in a row without a byte.
    silent: u32,
    /// Time of signatures that has been stored, and the uptime at which the clock was told last.
    stored: u64,
    told: u32,
}

/// Time by which signatures may come near the stored one before a later one is stored (10 us).
const NEAR: u64 = AHEAD / 2;
/// Units of a signature's time in a tick (10 us).
const TICK_TIME: u64 = TICK as u64 / 10;

/// Releases without a byte after which a frame that has begun will not go on: 40 ms.
const SILENT: u32 = 10;

/// The session and the pilot behind a message, and the state that they belong to.
#[derive(Debug)]
pub struct Behind<'a, 'm> {
    /// The session.
    pub session: &'a mut HostSession<'m>,
    /// The pilot.
    pub pilot: &'a mut Pilot,
    /// State of the control group.
    pub status: ControlStatus,
    /// The same, for telemetry.
    pub view: ControlView,
}

/// Time since the start of the program (us).
fn time(status: ControlStatus) -> u64 {
    u64::from(status.uptime) * u64::from(TICK)
}

impl<'a, 'm> Behind<'a, 'm> {
    fn vehicle(self) -> PilotedVehicle<'a, 'a, 'm> {
        let Self { session, pilot, status, view } = self;
        let ControlView { ready, thrust, cause, lasting } = view;
        let view = View {
            time: time(status),
            mode: status.mode,
            cause,
            state: session.sample(status.uptime).map(|sample| sample.state),
            ready,
            thrust: thrust / session.law().bounds().thrust_max,
            load: 0.0, // not measured
            battery: None,
            lasting,
        };
        PilotedVehicle { pilot, session, status, view }
    }
}

impl GroundStation {
    /// Nothing has come yet; `signing` is what was stored before the start, if there is a key.
    #[inline(never)]
    pub fn new_in<'p>(
        place: &'p mut MaybeUninit<Self>,
        memory: &'static mut ProtocolMemory,
        signing: Option<&StartedSigning>,
    ) -> &'p mut Self {
        let config = ProtocolConfig { version: VERSION, ..ProtocolConfig::default() };
        let mut protocol = Protocol::new(&config, memory);
        let mut stored = 0;
        if let Some(signing) = signing {
            stored = signing.stored;
            let StoredSigning { key, timestamp } = signing.from;
            protocol.set_signing_key(SigningKey::new(key), timestamp);
        }
        let decoder = Decoder::new();
        place.write(Self { decoder, protocol, silent: 0, stored, told: 0 })
    }

    /// Takes signatures that have been stored and tells their clock; what is to be stored before the clock comes to the
    /// stored time. Once per release; needs no lock.
    #[inline(never)]
    pub fn keep_time(
        &mut self,
        change: Option<SigningChange>,
        status: ControlStatus,
    ) -> Option<StoredSigning> {
        if let Some(SigningChange { stored, timestamp }) = change {
            self.stored = stored.map_or(0, |signing| signing.timestamp);
            if let Some(timestamp) = timestamp {
                let key = stored.and_then(|signing| SigningKey::new(signing.key));
                self.protocol.set_signing_key(key, timestamp);
            }
        }
        let passed = status.uptime.wrapping_sub(core::mem::replace(&mut self.told, status.uptime));
        let key = self.protocol.signing_key()?;
        let now = self.protocol.signing_time().saturating_add(u64::from(passed) * TICK_TIME);
        self.protocol.follow_clock(now);
        let near = now.saturating_add(NEAR) > self.stored;
        near.then(|| StoredSigning::ahead(key.to_bytes(), now))
    }

    /// Takes the next byte; the packet that it completes, if any.
    #[inline(never)]
    pub fn push(&mut self, byte: u8) -> Option<Packet> {
        self.silent = 0;
        self.decoder.push(byte)
    }

    /// Counts a release without a byte; the packet behind a frame that was cut short, if any.
    #[inline(never)]
    pub fn silence(&mut self) -> Option<Packet> {
        self.silent = self.silent.saturating_add(1);
        if self.silent >= SILENT { self.decoder.resume() } else { None }
    }

    /// `true` if a packet is signed as it must be. Needs no lock: a hash takes long.
    #[inline(never)]
    pub fn check(&mut self, packet: &Packet, status: ControlStatus) -> bool {
        self.protocol.check(packet, time(status))
    }

    /// Carries out a packet that has passed the [`check`](Self::check). The line may be a radio: no key is set over it.
    #[inline(never)]
    pub fn handle(&mut self, packet: &Packet, behind: Behind<'_, '_>) {
        self.protocol.obey(packet, Line::Open, &mut behind.vehicle());
    }

    /// The next frame to send, which is to be [signed](Self::sign).
    #[inline(never)]
    pub fn next_frame(&mut self, behind: Behind<'_, '_>) -> Option<Frame> {
        self.protocol.next_unsigned_frame(&mut behind.vehicle())
    }

    /// Signs a frame, if there is a key. Needs no lock, as [`check`](Self::check).
    #[inline(never)]
    pub fn sign(&mut self, frame: &mut Frame) {
        self.protocol.sign(frame);
    }

    /// Answers that found no room.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.protocol.dropped()
    }
}

#[cfg(test)]
#[path = "ground_station_tests.rs"]
mod tests;
