//! MAVLink on a port of its own: bytes of a ground station in, frames out, with the session and its pilot as the
//! vehicle.
//!
//! Pure: the task that owns it gives bytes, time and state, and takes frames. Work of one release is bounded by
//! [`BYTES_PER_RELEASE`] and [`SENT_PER_RELEASE`], whatever comes.

use core::mem::MaybeUninit;

use ctrl_core::controller::AdaptiveController;
use mavlink_vehicle::{
    Decoder, Frame, Line, Packet, Protocol, ProtocolConfig, ProtocolMemory, View,
};

use crate::exchange::{ControlStatus, ControlView};
use crate::pilot::{Pilot, PilotedVehicle};
use crate::rates::TICK;
use crate::session::HostSession;

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
}

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

impl<'a, 'm> Behind<'a, 'm> {
    fn vehicle(self) -> PilotedVehicle<'a, 'a, 'm> {
        let Self { session, pilot, status, view: ControlView { ready, thrust, cause } } = self;
        let view = View {
            time: u64::from(status.uptime) * u64::from(TICK),
            mode: status.mode,
            cause,
            state: session.sample(status.uptime).map(|sample| sample.state),
            ready,
            thrust: thrust / session.law().bounds().thrust_max,
            load: 0.0, // not measured
            battery: None,
        };
        PilotedVehicle { pilot, session, status, view }
    }
}

impl GroundStation {
    /// Nothing has come yet.
    #[inline(never)]
    pub fn new_in<'p>(
        place: &'p mut MaybeUninit<Self>,
        memory: &'static mut ProtocolMemory,
    ) -> &'p mut Self {
        let config = ProtocolConfig { version: VERSION, ..ProtocolConfig::default() };
        let protocol = Protocol::new(&config, memory);
        place.write(Self { decoder: Decoder::new(), protocol, silent: 0 })
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

    /// Carries out a packet. The line may be a radio: no key is set over it.
    #[inline(never)]
    pub fn handle(&mut self, packet: &Packet, behind: Behind<'_, '_>) {
        self.protocol.handle(packet, Line::Open, &mut behind.vehicle());
    }

    /// The next frame to send.
    #[inline(never)]
    pub fn next_frame(&mut self, behind: Behind<'_, '_>) -> Option<Frame> {
        self.protocol.next_frame(&mut behind.vehicle())
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
