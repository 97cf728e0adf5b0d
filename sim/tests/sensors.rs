//! Flights by sensors: guarantees on the truth, consistency of the estimate, faults in flight.

use sim::scenario::{BuiltIn, LoadedScenario};
use sim::sensor::consistency::{bounds, normalised_error};

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

/// Sums over flights.
#[derive(Clone, Copy, Debug, Default)]
struct Consistency {
    /// Normalised errors per sample and state.
    nees: f64,
    nees_degrees: f64,
    nis: f64,
    nis_degrees: f64,
    refused: u64,
    /// Squares of each state's error per variance.
    each: [f64; 15],
}

impl Consistency {
    /// Flies one flight per seed; errors are sampled at its end, innovations over all of it.
    fn of(text: &str, seeds: std::ops::Range<u64>, seconds: f64) -> Self {
        let mut sums = Self::default();
        for seed in seeds {
            let loaded = parse(text, seed);
            let mut flight = loaded.flight().expect("valid");
            flight.advance((seconds * 1e3) as u64);
            let navigation = flight.navigation().expect("by sensors");
            // The state after `advance` is the estimate of the last tick, the truth that of the next:
            // one more step of the sensors brings them together.
            let mut navigation = navigation.clone();
            navigation.measure(flight.truth());
            let covariance = navigation.state().covariance_matrix();
            let errors = navigation.errors(flight.truth());
            for k in 0..15 {
                sums.each[k] += errors[k] * errors[k] / f64::from(covariance[k][k]);
            }
            sums.nees += normalised_error(&errors, &covariance).expect("positive");
            sums.nees_degrees += 15.0;
            let innovations = navigation.innovations();
            sums.nis += innovations.sum;
            sums.nis_degrees += innovations.components as f64;
            sums.refused += innovations.refused;
        }
        sums
    }

    fn means(&self) -> [(f64, (f64, f64)); 2] {
        [(self.nees, self.nees_degrees), (self.nis, self.nis_degrees)]
            .map(|(sum, degrees)| (sum / degrees, bounds(degrees)))
    }

    fn holds(&self) -> bool {
        self.means().into_iter().all(|(x, (lower, upper))| lower <= x && x <= upper)
    }

    fn print(&self, name: &str) {
        let [(nees, (a, b)), (nis, (c, d))] = self.means();
        let flights = self.nees_degrees / 15.0;
        println!("{name}, {flights} flights, {} measurements refused", self.refused);
        println!("  NEES {nees:.4} in [{a:.4}, {b:.4}], NIS {nis:.4} in [{c:.4}, {d:.4}]");
        println!("  each state {:.2?}", self.each.map(|sum| sum / flights));
    }
}

const INDOORS: &str = "sensors-indoors";
const OUTDOORS: &str = "sensors-outdoors";
const OUTDOOR_PARTS: &str = "barometer = \"bmp388\"\nmagnetometer = \"lis3mdl\"\ngnss = \"m9n\"\n";

/// Every preset: name, scenario's text.
fn presets() -> [(&'static str, String); 4] {
    let indoors =
        |imu: &str| with_sensors(INDOORS, &format!("imu = \"{imu}\"\ncapture = \"vicon\"\n"));
    let outdoors = |imu: &str| with_sensors(OUTDOORS, &format!("imu = \"{imu}\"\n{OUTDOOR_PARTS}"));
    [
        ("BMI088, motion capture", indoors("bmi088")),
        ("ICM-42688-P, motion capture", indoors("icm-42688-p")),
        ("BMI088, GNSS, barometer, magnetometer", outdoors("bmi088")),
        ("ICM-42688-P, GNSS, barometer, magnetometer", outdoors("icm-42688-p")),
    ]
}

/// Flights of each preset: few in a plain `cargo test`, `GYRFALCON_CONSISTENCY_FLIGHTS` for more.
fn flights() -> u64 {
    let variable = std::env::var("GYRFALCON_CONSISTENCY_FLIGHTS");
    variable.ok().and_then(|text| text.parse().ok()).unwrap_or(12)
}

fn first() -> u64 {
    std::env::var("FIRST").ok().and_then(|text| text.parse().ok()).unwrap_or(0)
}

#[test]
fn estimates_are_as_good_as_they_claim_with_every_preset() {
    let results: Vec<_> = std::thread::scope(|scope| {
        let flown: Vec<_> = presets()
            .into_iter()
            .map(|(name, text)| {
                scope.spawn(move || {
                    (name, Consistency::of(&text, first()..first() + flights(), 15.0))
                })
            })
            .collect();
        flown.into_iter().map(|thread| thread.join().expect("flown")).collect()
    });
    let mut good = true;
    for (name, consistency) in results {
        consistency.print(name);
        good &= consistency.holds();
    }
    assert!(good, "NEES or NIS outside its 95 % bounds, see above");
}
