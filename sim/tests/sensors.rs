//! Flights by sensors: guarantees on the truth, consistency of the estimate, faults in flight.

use ctrl_core::estimator::{Fault, Source};
use sim::observer::Observer;
use sim::scenario::{BuiltIn, LoadedScenario};
use sim::sensor::consistency::Consistency;
use sim::sensor::{PRESETS, SensorPreset};
use sim::tick::Tick;

/// The text of a built-in scenario with its `[sensors]` replaced.
fn with_sensors(name: &str, sensors: &str) -> String {
    let text = BuiltIn::named(name).expect("built in").text;
    let start = text.find("[sensors]").expect("sensors");
    let end = start + text[start..].find("\n\n").expect("an end");
    format!("{}[sensors]\n{sensors}{}", &text[..start], &text[end..])
}

fn parse(text: &str, seed: u64) -> LoadedScenario {
    let changes = [format!("seed={seed}")];
    LoadedScenario::parse("test", text, &changes).unwrap_or_else(|error| panic!("{error}"))
}

const INDOORS: &str = "sensors-indoors";
const OUTDOORS: &str = "sensors-outdoors";
const NEAR_GROUND: &str = "sensors-near-ground";

/// Of flights with `seeds`, each 15 s.
fn flown(preset: &SensorPreset, seeds: std::ops::Range<u64>) -> Consistency {
    let scenario = preset.open().expect("built in");
    seeds
        .map(|seed| Consistency::of_flight(&scenario, seed, 15.0).expect("flown"))
        .fold(Consistency::default(), |sum, flight| sum.plus(&flight))
}

#[test]
fn estimates_are_as_good_as_they_claim_with_every_preset() {
    let results: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = PRESETS
            .iter()
            .map(|preset| scope.spawn(|| (preset.name, flown(preset, 0..12))))
            .collect();
        threads.into_iter().map(|thread| thread.join().expect("flown")).collect()
    });
    for (name, consistency) in &results {
        println!("{name}: NEES {:?}, NIS {:?}", consistency.nees(), consistency.nis());
    }
    let outside: Vec<_> =
        results.iter().filter(|(_, consistency)| !consistency.holds()).map(|it| it.0).collect();
    assert!(outside.is_empty(), "NEES or NIS outside its 95 % bounds: {outside:?}");
}

/// Largest errors of an estimate and of tracking over a flight's second half, from the truth.
struct Flown {
    position_error: f64,
    tracking_error: f64,
    restarts: u16,
    refused: u64,
}

/// Flies the whole scenario before its monitors; every guarantee must hold.
fn fly_guarded(loaded: &LoadedScenario) -> Flown {
    let scenario = loaded.scenario();
    let mut flight = loaded.flight().expect("valid");
    let mut monitors = scenario.monitors();
    let mut flown = Flown { position_error: 0.0, tracking_error: 0.0, restarts: 0, refused: 0 };
    let half = scenario.ticks() / 2;
    for tick in 0..scenario.ticks() {
        let mut seen = LastTick(None);
        flight.observe(1, &mut (&mut monitors, &mut seen));
        let seen = seen.0.expect("observed");
        if tick >= half {
            let state = flight.navigation().expect("by sensors").state().vehicle();
            let error = (seen.truth.position_world - state.position_world.as_dvec3()).length();
            flown.position_error = flown.position_error.max(error);
            flown.tracking_error = flown.tracking_error.max(seen.position_error().length());
        }
    }
    for verdict in monitors.verdicts() {
        if verdict.equation == "guarantees.md" {
            println!("{}: {verdict}", scenario.name);
        }
        assert!(verdict.pass, "{}: {verdict}", scenario.name);
    }
    let navigation = flight.navigation().expect("by sensors");
    flown.restarts = navigation.estimator().estimate(navigation.state()).restart.count;
    flown.refused = navigation.innovations().refused;
    flown
}

/// The tick that was observed last.
struct LastTick(Option<Tick>);

impl Observer for LastTick {
    fn observe(&mut self, tick: &Tick) {
        self.0 = Some(*tick);
    }
}

#[test]
fn built_in_flights_by_sensors_keep_their_guarantees_on_the_truth() {
    for name in [INDOORS, OUTDOORS, NEAR_GROUND] {
        let flown = fly_guarded(&LoadedScenario::open(name, &[]).expect("valid"));
        println!(
            "{name}: estimate within {:.4} m, tracking within {:.4} m",
            flown.position_error, flown.tracking_error
        );
        assert_eq!(flown.restarts, 0);
        assert!(flown.position_error > 1e-5, "the estimate is the truth");
    }
}

#[test]
fn a_flight_survives_lost_and_jumping_poses() {
    let sensors = "imu = \"bmi088\"\ncapture.custom = { rate = 100.0, delay = 0.01, position_deviation = 1.0, \
                   attitude_deviation = 0.3, dropout = 0.3, jump_interval = 5.0, jump_size = 4.0, \
                   jump_duration = 0.05 }\n";
    let loaded = parse(&with_sensors(INDOORS, sensors), 3);
    let flown = fly_guarded(&loaded);
    assert!(flown.refused > 50, "{} poses refused", flown.refused);
    assert_eq!(flown.restarts, 0);
    assert!(flown.position_error < 0.02, "{} m", flown.position_error);
}

/// Flies `name` with a fault of `sensor` from 25 s on for `duration` (s); the faults of `source` that were named.
fn fly_faulty(name: &str, fault: &str, source: Source) -> (Flown, Vec<Fault>) {
    let text = BuiltIn::named(name).expect("built in").text;
    let text = format!("{text}\n[[sensors.faults]]\n{fault}\nstart = 25.0\nduration = 10.0\n");
    let loaded = parse(&text, 5);
    let mut named = Vec::new();
    let mut flight = loaded.flight().expect("valid");
    for _ in 0..40 {
        flight.advance(1_000);
        let navigation = flight.navigation().expect("by sensors");
        let estimate = navigation.estimator().estimate(navigation.state());
        if let Some(fault) = estimate.faults[source as usize]
            && !named.contains(&fault)
        {
            named.push(fault);
        }
    }
    (fly_guarded(&loaded), named)
}

#[test]
fn faults_in_flight_are_named_and_survived_on_the_truth() {
    for (name, fault, source, expected) in [
        (OUTDOORS, "sensor = \"barometer\"\nkind = \"stuck\"", Source::Barometer, Fault::Stuck),
        (
            OUTDOORS,
            "sensor = \"magnetometer\"\nkind = \"missing\"",
            Source::Magnetometer,
            Fault::Missing,
        ),
        (
            OUTDOORS,
            "sensor = \"barometer\"\nkind = { jumping = 20.0 }",
            Source::Barometer,
            Fault::Jumping,
        ),
        (
            OUTDOORS,
            "sensor = \"magnetometer\"\nkind = \"not-finite\"",
            Source::Magnetometer,
            Fault::NotFinite,
        ),
        (
            NEAR_GROUND,
            "sensor = \"rangefinder\"\nkind = { jumping = 0.8 }",
            Source::Rangefinder,
            Fault::Jumping,
        ),
        (
            NEAR_GROUND,
            "sensor = \"rangefinder\"\nkind = \"stuck\"",
            Source::Rangefinder,
            Fault::Stuck,
        ),
    ] {
        let (flown, named) = fly_faulty(name, fault, source);
        println!("{fault:?}: {named:?}, estimate within {:.3} m", flown.position_error);
        assert!(named.contains(&expected), "{fault}: {named:?}");
        assert_eq!(flown.restarts, 0, "{fault}");
    }
}

#[test]
fn flights_by_sensors_repeat_to_the_bit_with_their_seed_only() {
    let text = BuiltIn::named(OUTDOORS).expect("built in").text;
    let end = |seed| {
        let mut flight = parse(text, seed).flight().expect("valid");
        flight.advance(2_000);
        *flight.truth()
    };
    assert_eq!(end(1), end(1));
    assert_ne!(end(1), end(2));
}

#[test]
fn faults_of_sensors_are_named() {
    let fault = |sensors: &str| {
        let text = with_sensors(INDOORS, sensors);
        LoadedScenario::parse("my.toml", &text, &[]).expect_err("refused").to_string()
    };
    let message = fault("imu = \"bmi80\"\n");
    assert!(
        message.contains("sensors.imu") && message.contains("did you mean `bmi088`"),
        "{message}"
    );
    let custom = "imu = \"bmi088\"\nbarometer.custom = { rate = 50.0, delay = 0.01, noise = 1.2, \
                  resolution = 0.016, dropout = 1.5 }\n";
    let message = fault(custom);
    assert!(
        message.contains("sensors.barometer.custom.dropout: 1.5 must be in [0, 1]"),
        "{message}"
    );
    // In range as a barometer, too coarse for the estimator.
    let message = fault(&custom.replace("1.5 }", "0.0 }").replace("noise = 1.2", "noise = 1e9"));
    assert!(message.contains("sensors.barometer") && message.contains("must be in"), "{message}");
}
