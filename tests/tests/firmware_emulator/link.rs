//! The whole image in lock step with the host, over two FIFOs that carry the link's frames.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;
use std::{env, fs, thread};

use ctrl_core::link::{
    Decoder, Downlink, Encoder, Health, MAX_FRAME, Rejection, Telemetry, Uplink,
};
use ctrl_core::vehicle::VehicleState;

use crate::emulator::{PATIENCE, start, text};

/// A running image that waits for the host after each release of its telemetry group.
pub struct Vehicle {
    emulator: Child,
    to_vehicle: File,
    packets: Receiver<Vec<u8>>,
    encoder: Encoder<Uplink>,
    decoder: Decoder<Downlink>,
}

impl Vehicle {
    /// Boots the image and waits for its greeting; FIFOs are named after `test`.
    pub fn boot(test: &str, directives: &[&str]) -> (Self, Vec<Downlink>) {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{test}-link"));
        let (to_vehicle, from_vehicle) = (fifo(&path, "in"), fifo(&path, "out"));
        let mut all = vec![format!("link={}", path.display())];
        all.extend(directives.iter().map(|directive| (*directive).to_owned()));
        let mut vehicle = Self {
            emulator: start("firmware", &all),
            to_vehicle,
            packets: packets(from_vehicle),
            encoder: Encoder::default(),
            decoder: Decoder::default(),
        };
        let greeting = vehicle.listen();
        (vehicle, greeting)
    }

    /// Sends messages, lets the vehicle go on to its next release of telemetry, and returns what
    /// it has sent until then.
    pub fn say(&mut self, messages: &[Uplink]) -> Vec<Downlink> {
        self.send(messages);
        self.listen()
    }

    fn send(&mut self, messages: &[Uplink]) {
        let mut bytes = Vec::new();
        for message in messages {
            bytes.extend_from_slice(self.encoder.encode(message, &mut [0; MAX_FRAME]).unwrap());
        }
        self.to_vehicle.write_all(&(bytes.len() as u16).to_le_bytes()).unwrap();
        self.to_vehicle.write_all(&bytes).unwrap();
    }

    /// Sends a message and, at each release, a state, until the message is acknowledged.
    pub fn ask(&mut self, message: Uplink, state: VehicleState) -> Result<(), Rejection> {
        let sequence = self.encoder.next_sequence();
        let mut heard = self.say(&[message, Uplink::State { tick: 0, state }]);
        for _ in 0..20 {
            for message in heard {
                if let Downlink::Acknowledgement(answer) = message
                    && answer.sequence == sequence
                {
                    return answer.result;
                }
            }
            heard = self.say(&[Uplink::State { tick: 0, state }]);
        }
        panic!("no acknowledgement");
    }

    /// Greets the vehicle and has it send telemetry at every tick.
    pub fn subscribe(&mut self, state: VehicleState) {
        self.say(&[Uplink::Hello]);
        self.ask(Uplink::Subscribe { period: 1 }, state).unwrap();
    }

    /// Sends messages for one tick and returns its telemetry.
    pub fn tick(&mut self, messages: &[Uplink]) -> Telemetry {
        let heard = self.say(messages);
        let mut telemetry = heard.iter().filter_map(|message| match message {
            Downlink::Telemetry(telemetry) => Some(*telemetry),
            _ => None,
        });
        match (telemetry.next(), telemetry.next()) {
            (Some(telemetry), None) => telemetry,
            _ => panic!("not one telemetry in a tick: {heard:?}"),
        }
    }

    /// The next health report.
    pub fn health(&mut self, state: VehicleState) -> Health {
        for _ in 0..200 {
            for message in self.say(&[Uplink::State { tick: 0, state }]) {
                if let Downlink::Health(health) = message {
                    return health;
                }
            }
        }
        panic!("no health report");
    }

    /// Sends messages at each release until the run ends, and returns its report.
    pub fn say_until_the_end(mut self, messages: &[Uplink]) -> String {
        while self.emulator.try_wait().unwrap().is_none() {
            self.send(messages);
            // Silent once the run has ended.
            let _ = self.packets.recv_timeout(Duration::from_millis(500));
        }
        text(&self.emulator.wait_with_output().unwrap().stderr)
    }

    /// Ends the run now.
    pub fn stop(mut self) {
        self.emulator.kill().unwrap();
        self.emulator.wait().unwrap();
    }

    fn listen(&mut self) -> Vec<Downlink> {
        let packet = self.packets.recv_timeout(PATIENCE).expect("the vehicle is silent");
        let messages: Vec<_> = packet
            .into_iter()
            .filter_map(|byte| self.decoder.push(byte).map(|received| received.message))
            .collect();
        assert_eq!(self.decoder.statistics().damaged, 0);
        messages
    }
}

/// Makes a FIFO; opened for both directions, neither side waits for the other to open it.
fn fifo(path: &Path, ending: &str) -> File {
    let path = PathBuf::from(format!("{}.{ending}", path.display()));
    let _ = fs::remove_file(&path);
    assert!(Command::new("mkfifo").arg(&path).status().expect("mkfifo").success());
    OpenOptions::new().read(true).write(true).open(path).unwrap()
}

/// Reads packets in a thread of its own, so that waiting for one can end.
fn packets(mut from_vehicle: File) -> Receiver<Vec<u8>> {
    let (sender, receiver) = channel();
    thread::spawn(move || {
        let mut length = [0; 2];
        while from_vehicle.read_exact(&mut length).is_ok() {
            let mut packet = vec![0; usize::from(u16::from_le_bytes(length))];
            if from_vehicle.read_exact(&mut packet).is_err() || sender.send(packet).is_err() {
                return;
            }
        }
    });
    receiver
}
