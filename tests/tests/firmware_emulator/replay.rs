//! The replay image against the same law on the host: every bit of every reply.

use std::cell::RefCell;
use std::path::Path;
use std::{env, fs};

use ctrl_core::controller::TrackingController;
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::VehicleState;
use firmware::replay::{ReplayReply, ReplaySample};
use firmware::scenario::Scenario;
use glam::{Quat, Vec3};

use crate::closed_loop::{RecordingController, advance};
use crate::emulator::{run, text};
use crate::{PAPER, TICKS};

/// Replies of the emulated firmware to `samples`, flown with a scenario's controller.
fn replay(scenario: &str, test: &str, samples: &[ReplaySample]) -> Vec<ReplayReply> {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let input = directory.join(format!("{test}-{scenario}-samples"));
    let output = directory.join(format!("{test}-{scenario}-replies"));
    let bytes: Vec<u8> = samples.iter().flat_map(|sample| sample.encode().unwrap()).collect();
    fs::write(&input, bytes).unwrap();
    let directives = [
        format!("scenario={scenario}"),
        format!("input={}", input.display()),
        format!("output={}", output.display()),
    ];
    let run = run("replay", &directives);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let bytes = fs::read(&output).unwrap();
    let (records, rest) = bytes.as_chunks();
    assert!(rest.is_empty(), "a reply was cut");
    records.iter().map(|record| ReplayReply::decode(record).unwrap()).collect()
}

/// Replies of the same law on the host.
fn replay_on_host(scenario: &str, samples: &[ReplaySample]) -> Vec<ReplayReply> {
    let controller = Scenario::named(scenario).unwrap().load().unwrap().controller.build().unwrap();
    let mut state = controller.initial_state();
    samples.iter().map(|sample| sample.step(&controller, &mut state)).collect()
}

/// Asserts that every reply has the same bits.
fn assert_same_bits(scenario: &str, emulated: &[ReplayReply], host: &[ReplayReply]) {
    assert_eq!(emulated.len(), host.len(), "{scenario}");
    for (tick, (emulated, host)) in emulated.iter().zip(host).enumerate() {
        let (left, right) = (emulated.encode().unwrap(), host.encode().unwrap());
        assert_eq!(left, right, "{scenario}, tick {tick}: {emulated:?} is not {host:?}");
    }
}

/// Numbers that a broken sensor may send, between good ones.
fn hostile_samples() -> Vec<ReplaySample> {
    let hostile = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        f32::MIN_POSITIVE,
        1e-40,
        -0.0,
        1e30,
        -1e8,
    ];
    let mut samples = Vec::new();
    for index in 0..37 {
        for number in hostile {
            samples.extend([good_sample(samples.len()); 3]);
            let mut bytes = good_sample(samples.len()).encode().unwrap();
            bytes[4 * index..4 * index + 4].copy_from_slice(&number.to_le_bytes());
            samples.push(ReplaySample::decode(&bytes).unwrap());
        }
    }
    samples
}

/// A large but lawful error, different at every tick.
fn good_sample(tick: usize) -> ReplaySample {
    let phase = tick as f32 * 0.37;
    let wave = |k: f32| (phase * k) % 2.0 - 1.0;
    let attitude = Quat::from_xyzw(wave(1.0), wave(1.3), wave(1.7), wave(2.1) + 0.1).normalize();
    let vehicle = VehicleState {
        position_world: Vec3::new(wave(0.9), wave(1.1), wave(0.7)) * 5.0,
        velocity_world: Vec3::new(wave(1.9), wave(0.3), wave(2.7)) * 2.0,
        attitude,
        rate_body: Vec3::new(wave(2.9), wave(1.2), wave(0.8)) * 3.0,
    };
    ReplaySample { vehicle, reference: Reference::hover(Vec3::ZERO) }
}

/// Inputs of the controller in SIL's flight of a scenario.
fn recorded(scenario: &str) -> Vec<ReplaySample> {
    let samples = RefCell::new(Vec::new());
    let law = Scenario::named(scenario).unwrap().load().unwrap().controller.build().unwrap();
    advance(scenario, TICKS, RecordingController { law, samples: &samples });
    samples.into_inner()
}

#[test]
fn ten_seconds_of_each_paper_scenario_give_the_same_bits_as_on_the_host() {
    for scenario in PAPER {
        let samples = recorded(scenario);
        assert_eq!(samples.len() as u64, TICKS);
        let emulated = replay(scenario, "recorded", &samples);
        assert_same_bits(scenario, &emulated, &replay_on_host(scenario, &samples));
    }
}

#[test]
fn hostile_inputs_give_the_same_bits_as_on_the_host() {
    let samples = hostile_samples();
    for scenario in PAPER {
        let emulated = replay(scenario, "hostile", &samples);
        let host = replay_on_host(scenario, &samples);
        assert_same_bits(scenario, &emulated, &host);
        assert!(host.iter().any(|reply| reply.status != 0));
        assert!(host.windows(2).any(|pair| pair[0].wrench != pair[1].wrench));
    }
}
