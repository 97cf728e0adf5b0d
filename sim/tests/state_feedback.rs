//! Flights on a noisy or late state: off by default to the bit, seeded, judged on the truth, faults named.

use sim::guarantee::Requirement;
use sim::guarantee::activity::TorqueActivity;
use sim::plant::PlantState;
use sim::scenario::{BuiltIn, LoadedScenario, ScenarioError};

const NAME: &str = "paper-robust-adaptive";

/// A built-in scenario with `section` at its end.
fn with(name: &str, section: &str) -> Result<LoadedScenario, ScenarioError> {
    let text = BuiltIn::named(name).expect("a built-in scenario").text;
    LoadedScenario::parse("my.toml", &format!("{text}\n{section}"), &[])
}

fn fault(name: &str, section: &str) -> String {
    match with(name, section) {
        Ok(_) => panic!("`{section}` was accepted"),
        Err(error) => error.to_string(),
    }
}

fn after_two_seconds(section: &str, seed: u64) -> PlantState {
    let loaded = with(NAME, section).expect("valid");
    let mut scenario = loaded.scenario().clone();
    scenario.seed = seed;
    let mut flight = scenario.flight().expect("valid");
    flight.advance(2_000);
    *flight.truth()
}

const NOISE: &str = "[state_feedback.rate_body]\nwhite_noise = 0.02\n\
    band_limited_noise = { deviation = 0.05, center = 120.0, bandwidth = 10.0 }\nlatency = 0.002\n";

#[test]
fn nothing_and_zeros_leave_the_bits_of_a_flight() {
    let zeros = "[state_feedback]\nposition = { white_noise = 0.0, latency = 0.0 }\n\
        rate_body = { band_limited_noise = { deviation = 0.0, bandwidth = 20.0 } }\n";
    assert_eq!(after_two_seconds(zeros, 1), after_two_seconds("", 1));
}

#[test]
fn flights_repeat_to_the_bit_with_their_seed_only() {
    assert_eq!(after_two_seconds(NOISE, 1), after_two_seconds(NOISE, 1));
    assert_ne!(after_two_seconds(NOISE, 1), after_two_seconds(NOISE, 2));
    assert_ne!(after_two_seconds(NOISE, 1), after_two_seconds("", 1));
}

#[test]
fn nothing_of_v_is_judged_and_the_report_names_the_assumption() {
    let loaded = with(NAME, NOISE).expect("valid");
    let scenario = loaded.scenario();
    assert_eq!(
        scenario.broken_assumptions(),
        ["the controller receives the state with noise or latency"]
    );
    let mut monitors = scenario.monitors();
    loaded.flight().expect("valid").observe(5_000, &mut monitors);
    let verdicts = monitors.verdicts();
    let of_v = verdicts.iter().filter(|row| row.name.starts_with('V'));
    let rows: Vec<_> = of_v.map(|row| row.requirement).collect();
    assert!(rows.len() > 1 && rows.iter().all(|it| *it == Requirement::Information), "{rows:?}");
}

#[test]
fn faults_name_file_line_key_and_bound() {
    let line = BuiltIn::named(NAME).expect("built in").text.lines().count() + 3;
    for (section, expected) in [
        ("position.white_noise = -1.0", "position.white_noise: -1 must be zero or positive"),
        ("velocity.latency = 0.6", "velocity.latency: 0.6 must be in [0, 0.5] s"),
        (
            "attitude.band_limited_noise = { deviation = nan, bandwidth = 2.0 }",
            "attitude.band_limited_noise.deviation: NaN must be zero or positive",
        ),
        (
            "rate_body.band_limited_noise = { deviation = 1.0, bandwidth = 0.0 }",
            "rate_body.band_limited_noise.bandwidth: 0 must be in (0, 500] Hz, half the control rate",
        ),
        (
            "rate_body.band_limited_noise = { deviation = 1.0, center = 501.0, bandwidth = 3.0 }",
            "rate_body.band_limited_noise.center: 501 must be in [0, 500] Hz, half the control rate",
        ),
    ] {
        let message = fault(NAME, &format!("[state_feedback]\n{section}\n"));
        assert_eq!(message, format!("my.toml:{line}: state_feedback.{expected}"));
    }
    let message = fault(NAME, "[state_feedback.rate]\nwhite_noise = 1.0\n");
    assert!(message.contains("state_feedback.rate: unknown field `rate`"), "{message}");
}

#[test]
fn rate_filters_fly_and_their_faults_name_the_key() {
    let filter = "[rate_filter]\nlow_pass = { frequency = 60.0, quality = 0.7071 }\n\
        notches = [{ frequency = 120.0, quality = 4.0 }]\n";
    assert_ne!(after_two_seconds(filter, 1), after_two_seconds("", 1));
    assert_eq!(after_two_seconds("[rate_filter]\n", 1), after_two_seconds("", 1));
    let broken = with(NAME, filter).expect("valid").scenario().broken_assumptions();
    assert_eq!(broken, ["the controller receives the body rate behind filters"]);

    let line = BuiltIn::named(NAME).expect("built in").text.lines().count() + 3;
    for (old, new, expected) in [
        (
            "frequency = 60.0",
            "frequency = 470.0",
            "low_pass.frequency: rate_filter.low_pass.frequency = 470 must be in [1, 450] \
             (0.001 to 0.45 of the sample rate (Hz))",
        ),
        (
            "quality = 0.7071",
            "quality = 0.1",
            "low_pass.quality: rate_filter.low_pass.quality = 0.1 must be in [0.3, 10] \
             (quality of the filter)",
        ),
    ] {
        let message = fault(NAME, &filter.replace(old, new));
        assert_eq!(message, format!("my.toml:{line}: rate_filter.{expected}"));
    }
    let message = fault(NAME, &filter.replace("quality = 4.0", "quality = 400.0"));
    let start =
        format!("my.toml:{}: rate_filter.notches: rate_filter.notches.quality = 400", line + 1);
    assert!(message.starts_with(&start), "{message}");
    let four = "[rate_filter]\nnotches = [{ frequency = 9.0, quality = 4.0 }, { frequency = 9.0, \
        quality = 4.0 }, { frequency = 9.0, quality = 4.0 }, { frequency = 9.0, quality = 4.0 }]\n";
    let message = fault(NAME, four);
    assert!(
        message.contains("rate_filter.notches: ") && message.contains("at most 3"),
        "{message}"
    );
}

#[test]
fn a_notch_takes_vibration_off_the_torque() {
    let rms = |section: &str| {
        let loaded = with(NAME, section).expect("valid");
        let mut activity = TorqueActivity::default();
        let mut flight = loaded.flight().expect("valid");
        flight.advance(4_000);
        flight.observe(8_000, &mut activity);
        activity.rms().expect("flown")
    };
    let vibration = "[state_feedback.rate_body.band_limited_noise]\ndeviation = 0.1\n\
        center = 150.0\nbandwidth = 1.0\n";
    let notch = "[rate_filter]\nnotches = [{ frequency = 150.0, quality = 2.0 }]\n";
    let (calm, shaken, filtered) = (rms(""), rms(vibration), rms(&format!("{vibration}{notch}")));
    // The notch is 75 Hz wide, the vibration's band 2 Hz; the rest are the flanks of that band.
    assert!(shaken > 20.0 * calm && filtered < shaken / 5.0, "{calm}, {shaken}, {filtered}");
}

#[test]
fn beside_sensors_it_is_refused() {
    let line = BuiltIn::named("sensors-indoors").expect("built in").text.lines().count() + 2;
    let message = fault("sensors-indoors", "[state_feedback.position]\nwhite_noise = 0.1\n");
    assert!(
        message.starts_with(&format!(
            "my.toml:{line}: state_feedback: must be absent beside [sensors]"
        )),
        "{message}"
    );
}
