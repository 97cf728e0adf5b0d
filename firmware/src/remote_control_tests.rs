//! Tests of the remote control: frames packed here bit by bit, hostile bytes, and flights by sticks.

use std::boxed::Box;
use std::vec::Vec;

use ctrl_core::controller::ControllerConfig;
use ctrl_core::mode::Refusal;

use super::*;
use crate::scenario::BUILT_IN_MISSION;

const MIDDLE: u16 = 992;
const LOW: u16 = 172;
const HIGH: u16 = 1811;

/// CRC-8/DVB-S2, bit by bit.
fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |crc, byte| {
        (0..8).fold(crc ^ byte, |crc, _| if crc & 0x80 != 0 { crc << 1 ^ 0xD5 } else { crc << 1 })
    })
}

fn framed(kind: u8, payload: &[u8]) -> Vec<u8> {
    let mut body = std::vec![kind];
    body.extend(payload);
    let mut frame = std::vec![0xC8, body.len() as u8 + 1];
    frame.push(kind);
    frame.extend(payload);
    frame.push(checksum(&body));
    frame
}

/// Sixteen channels of eleven bits, the lowest bit first.
fn frame(first: [u16; 7]) -> Vec<u8> {
    let mut payload = [0u8; 22];
    let channels = first.into_iter().chain([MIDDLE; 9]);
    for (bit, value) in channels.flat_map(|c| (0..11).map(move |bit| c >> bit & 1)).enumerate() {
        payload[bit / 8] |= (value as u8) << (bit % 8);
    }
    framed(0x16, &payload)
}

fn statistics(quality: u8) -> Vec<u8> {
    framed(0x14, &[60, 60, quality, 8, 0, 2, 3, 60, 100, 8])
}

fn feed(remote: &mut RemoteControl, bytes: &[u8]) -> usize {
    bytes.iter().filter(|byte| remote.receive(**byte)).count()
}

#[test]
fn channels_come_out_as_deflections() {
    let mut remote = RemoteControl::new();
    assert_eq!(remote.silence(0.001), f32::INFINITY);
    let bytes = frame([HIGH, LOW, MIDDLE + 410, MIDDLE + 20, HIGH, MIDDLE, LOW]);
    assert_eq!(feed(&mut remote, &bytes), 1);
    let channels = *remote.channels().unwrap();
    let near = |a: f32, b: f32| (a - b).abs() < 2e-3;
    assert!(near(channels.right, 1.0) && near(channels.forward, -1.0) && near(channels.up, 0.5));
    assert_eq!(channels.turn, 0.0, "within the dead band");
    assert!(near(channels.arm, 1.0) && channels.mode == 0.0 && near(channels.kill, -1.0));
    assert_eq!((remote.silence(0.001), remote.kills()), (0.0, false));
    feed(&mut remote, &statistics(0));
    assert_eq!(remote.silence(0.001), f32::INFINITY);
    feed(&mut remote, &statistics(99));
    assert_eq!(remote.silence(0.001), 0.0);
}

#[test]
fn frames_in_a_row_are_all_taken_and_noise_between_them_costs_at_most_two() {
    let mut remote = RemoteControl::new();
    let one = frame([MIDDLE; 7]);
    let stream: Vec<u8> = (0..100).flat_map(|_| [one.clone(), statistics(90)].concat()).collect();
    assert_eq!(feed(&mut remote, &stream), 100);
    // An address and a length that promise the longest frame.
    let noisy = [&[0xC8, 62][..], &one.repeat(10)].concat();
    assert!(feed(&mut remote, &noisy) >= 7);
    for bit in 0..one.len() * 8 {
        let mut damaged = one.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let mut fresh = RemoteControl::new();
        let taken = feed(&mut fresh, &damaged);
        // Another known address is no damage to the crate.
        assert!(taken == 0 || bit < 8, "bit {bit}");
        let after = feed(&mut fresh, &one.repeat(4));
        assert!(after >= 1, "bit {bit}: {after} of 4 after it");
    }
}

#[test]
fn hostile_bytes_and_short_payloads_with_good_checksums_do_no_harm() {
    let mut remote = RemoteControl::new();
    for kind in 0..=255u8 {
        for length in 0..=59 {
            let taken = feed(&mut remote, &framed(kind, &std::vec![0xA5; length]));
            assert_eq!(taken, usize::from(kind == 0x16 && length == 22));
        }
    }
    let mut bits = 0x9E37_79B9_7F4A_7C15u64;
    for _ in 0..2_000_000 {
        bits ^= bits << 13;
        bits ^= bits >> 7;
        bits ^= bits << 17;
        let byte = [0xC8, 0x16, 24, 0xEE, (bits >> 24) as u8][(bits >> 40) as usize % 5];
        remote.receive(byte);
    }
    assert!(remote.channels().is_none_or(|channels| channels.up.abs() <= 1.0));
    feed(&mut remote, &[0; 64]);
    assert_eq!(feed(&mut remote, &frame([MIDDLE; 7])), 1);
}

/// A vehicle that is where its reference is.
struct World {
    remote: RemoteControl,
    pilot: Pilot,
    mode: Mode,
    vehicle: VehicleState,
    channels: [u16; 7],
}

impl World {
    fn new() -> Self {
        let law = ControllerConfig::Saturated(BUILT_IN_MISSION.tuning.saturated).build().unwrap();
        let pilot = Pilot::new(&Pilot::moderate(&law), &law).unwrap();
        let mut world = Self {
            remote: RemoteControl::new(),
            pilot,
            mode: Mode::Disarmed,
            vehicle: VehicleState::at_rest(Vec3::ZERO),
            channels: [MIDDLE, MIDDLE, LOW, MIDDLE, LOW, LOW, LOW],
        };
        world.run(0.5);
        world
    }

    fn run(&mut self, seconds: f32) {
        let bytes = frame(self.channels);
        for tick in 0..(seconds * 1000.0) as u32 {
            if tick % 7 == 0 {
                feed(&mut self.remote, &bytes);
            }
            self.tick();
        }
    }

    fn tick(&mut self) {
        self.remote.step(&mut self.pilot, self.mode, Some(&self.vehicle), 0.5);
        let reference = self.pilot.step(self.mode, Some(&self.vehicle)).reference;
        if let Some(command) = self.pilot.next_command(false) {
            let next = match (self.mode, command) {
                (Mode::Disarmed, Command::Arm) => Ok(Mode::Armed),
                (Mode::Armed, Command::Start) => Ok(Mode::Flying),
                (_, Command::Disarm) => Ok(Mode::Disarmed),
                _ => Err(Refusal::NotArmed),
            };
            self.mode = next.unwrap_or(self.mode);
            self.pilot.answered(next);
        }
        if self.mode == Mode::Flying {
            let p = reference.position_world;
            self.vehicle.position_world = p.with_z(p.z.max(0.0));
            self.vehicle.velocity_world = reference.velocity_world * f32::from(p.z > 0.0);
        }
    }

    fn set(&mut self, channel: usize, value: u16, seconds: f32) {
        self.channels[channel] = value;
        self.run(seconds);
    }

    /// Armed, taken off, sticks in the middle.
    fn flying() -> Box<Self> {
        let mut world = Box::new(Self::new());
        world.set(4, HIGH, 0.5);
        assert_eq!(world.mode, Mode::Armed);
        world.set(2, HIGH, 12.0);
        world.set(2, MIDDLE, 20.0);
        assert_eq!(
            (world.mode, world.pilot.navigator().mode()),
            (Mode::Flying, NavigationMode::Hold)
        );
        assert!(world.vehicle.position_world.z > 2.0, "{}", world.vehicle.position_world);
        world
    }
}

#[test]
fn sticks_take_off_fly_by_velocity_and_hold_when_they_are_let_go() {
    let mut world = World::flying();
    world.set(1, HIGH, 30.0);
    assert_eq!(world.pilot.navigator().mode(), NavigationMode::Offboard);
    let velocity = world.vehicle.velocity_world;
    let limits = world.pilot.navigator().config().shaper;
    assert!((velocity.x - limits.speed_max).abs() < 0.02 && velocity.y.abs() < 1e-3, "{velocity}");
    world.set(1, MIDDLE, 40.0);
    assert_eq!(world.pilot.navigator().mode(), NavigationMode::Hold);
    assert!(world.vehicle.velocity_world.length() < 0.02);
    // To the right is body -y.
    world.set(0, HIGH, 10.0);
    assert!(world.vehicle.velocity_world.y < -0.5);
    world.set(0, MIDDLE, 40.0);
    world.set(2, LOW, 3.0);
    assert!(world.vehicle.velocity_world.z < -0.05);
}

#[test]
fn the_arm_switch_lands_in_the_air_and_disarms_on_the_ground() {
    let mut world = World::flying();
    world.set(4, LOW, 60.0);
    assert_eq!(world.mode, Mode::Disarmed);
    assert!(world.vehicle.position_world.z < 0.1);
    world.set(2, LOW, 0.1);
    world.set(4, HIGH, 0.5);
    assert_eq!(world.mode, Mode::Armed);
    world.set(4, LOW, 0.5);
    assert_eq!(world.mode, Mode::Disarmed);
}

#[test]
fn the_mode_switch_returns_and_switches_that_stand_do_nothing() {
    let mut world = World::flying();
    world.set(1, HIGH, 10.0);
    world.set(1, MIDDLE, 10.0);
    // A station commands beside the standing switches.
    world.pilot.request(Mode::Flying, Request::Land(None)).unwrap();
    world.run(1.0);
    assert_eq!(world.pilot.navigator().mode(), NavigationMode::Land);
    world.set(5, HIGH, 0.1);
    assert_eq!(world.pilot.navigator().mode(), NavigationMode::Return);
}

#[test]
fn a_throttle_that_is_up_while_arming_does_not_take_off() {
    let mut world = World::new();
    world.set(2, HIGH, 0.5);
    world.set(4, HIGH, 2.0);
    assert_eq!((world.mode, world.vehicle.position_world.z), (Mode::Armed, 0.0));
    world.set(2, LOW, 0.5);
    world.set(2, HIGH, 8.0);
    assert_eq!(world.mode, Mode::Flying);
}

#[test]
fn a_lost_remote_control_commands_nothing_and_keeps_its_kill_switch() {
    let mut world = World::flying();
    world.set(1, HIGH, 2.0);
    assert_eq!(world.pilot.navigator().mode(), NavigationMode::Offboard);
    for _ in 0..2000 {
        world.tick();
    }
    assert!((world.remote.silence(0.001) - 2.0).abs() < 0.01);
    assert_eq!(world.pilot.navigator().mode(), NavigationMode::Hold);
    // Back with the arm switch down: nothing moves by itself.
    world.channels = [MIDDLE, MIDDLE, MIDDLE, MIDDLE, LOW, HIGH, LOW];
    world.run(1.0);
    assert_eq!((world.mode, world.pilot.navigator().mode()), (Mode::Flying, NavigationMode::Hold));
    world.set(6, HIGH, 0.1);
    assert!(world.remote.kills());
    for _ in 0..5000 {
        world.tick();
    }
    assert!(world.remote.kills());
}
