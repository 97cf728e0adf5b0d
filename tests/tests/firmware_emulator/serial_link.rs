//! The whole image in lock step with a test, which fails where a [`VehicleSession`] reports an error.

use std::thread;
use std::time::{Duration, Instant};

use ctrl_core::vehicle::VehicleState;
use link::{Downlink, Health, Rejection, Telemetry, Uplink};
use sil_host::pil::line::Line;
use sil_host::pil::lockstep::PATIENCE;
use sil_host::pil::session::VehicleSession;

use crate::emulator::{emulator, read_all};

/// A running image that waits for the test after each release of its telemetry group.
pub struct Vehicle(pub VehicleSession);

impl Vehicle {
    /// Boots the image and waits for its first.
    pub fn boot(directives: &[&str]) -> (Self, Vec<Downlink>) {
        let directives: Vec<_> = directives.iter().map(ToString::to_string).collect();
        let (session, first) = VehicleSession::boot(&emulator("firmware"), &directives).unwrap();
        (Self(session), first)
    }

    /// Sends messages, lets the vehicle go on to its next release of telemetry, and returns what
    /// it has sent until then.
    pub fn send(&mut self, messages: &[Uplink]) -> Vec<Downlink> {
        let received = self.0.send(messages).unwrap();
        assert_eq!(self.0.statistics().damaged, 0);
        received
    }

    /// Sends a message and, at each release, a state, until the message is acknowledged.
    pub fn ask(&mut self, message: Uplink, state: VehicleState) -> Result<(), Rejection> {
        self.0.ask(message, state).unwrap()
    }

    /// Greets the vehicle and has it send telemetry at every tick.
    pub fn subscribe(&mut self, state: VehicleState) {
        self.0.subscribe(state).unwrap();
    }

    /// Sends messages for one tick and returns its telemetry.
    pub fn tick(&mut self, messages: &[Uplink]) -> Telemetry {
        self.0.tick(messages).unwrap()
    }

    /// The next health report.
    pub fn health(&mut self, state: VehicleState) -> Health {
        self.0.health(state).unwrap()
    }

    /// Sends messages at each release until the run ends, and returns its report.
    pub fn send_until_the_end(mut self, messages: &[Uplink]) -> String {
        let bytes = self.0.frames(messages).concat();
        let end = Instant::now() + PATIENCE;
        let Line::Fifos(fifos) = self.0.line() else { panic!("of an emulator") };
        while fifos.emulator().try_wait().unwrap().is_none() {
            assert!(Instant::now() < end, "the run does not end");
            fifos.send(&bytes).unwrap();
            // Silent once the run has ended.
            let _ = fifos.receive(Duration::from_millis(500));
            thread::yield_now();
        }
        read_all(fifos.emulator().stderr.take().unwrap())
    }
}
