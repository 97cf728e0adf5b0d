//! Flights by sensors: guarantees on the truth, consistency of the estimate, faults in flight.

use sim::observer::Observer;
use sim::scenario::{BuiltIn, LoadedScenario};
use sim::sensor::consistency::{bounds, normalised_error};
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

#[test]
fn estimates_are_as_good_as_they_claim_with_every_preset() {
    let results: Vec<_> = std::thread::scope(|scope| {
        let flown: Vec<_> = presets()
            .into_iter()
            .map(|(name, text)| {
                scope.spawn(move || (name, Consistency::of(&text, 0..flights(), 15.0)))
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
    for name in [INDOORS, OUTDOORS] {
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
