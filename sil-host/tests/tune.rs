//! `tune`: proposals keep every inequality with margin, reach what was wanted at every corner, and fly;
//! what cannot be reached is refused with what would help.

use std::path::Path;
use std::process::{Command, Output};

use ctrl_core::controller::ControllerConfig;
use ctrl_core::filter::RateFilterConfig;
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::saturated::Saturated;
use glam::DVec3;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use sil_host::tune::check::check;
use sil_host::tune::design::{accept, audit, with_margin};
use sil_host::tune::hover::Hover;
use sil_host::tune::margin::{Rotors, margins_at};
use sil_host::tune::proposal::Proposal;
use sil_host::tune::request::{Request, WantedOptions};
use sil_host::tune::returning::{return_speeds, settling_times};
use sil_host::tune::survey::{Which, nominal};
use sim::guarantee::tracking::rotation_angle;
use sim::guarantee::{Guarantees, Requirement};
use sim::observer::Observer;
use sim::scenario::{BUILT_IN, LoadedScenario};
use sim::tick::Tick;

/// A vehicle of 20 kg with a fourfold interval of inertia.
const HEAVY: &str = "
name = \"heavy\"
mass = { lower = 15.0, upper = 20.0 }
inertia = { lower = 0.6, upper = 2.2 }
disturbance_acceleration = 0.5
disturbance_torque = 0.5
reference_acceleration_max = 1.0
thrust_max = 450.0
torque_max = 25.0
step_period = 0.0025
[wanted]
position_bandwidth = 0.8
damping = 0.6
";

fn request(text: &str) -> Request {
    Request::parse("vehicle.toml", text, WantedOptions::default())
        .unwrap_or_else(|error| panic!("{error}"))
}

fn proposal(text: &str) -> Proposal {
    Proposal::new(request(text)).unwrap_or_else(|error| panic!("{error}"))
}

/// `HEAVY` with one line replaced.
fn heavy_but(key: &str, value: &str) -> String {
    let lines = HEAVY.lines().map(|line| {
        if line.starts_with(key) { format!("{key} = {value}") } else { line.to_owned() }
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// Everything that a proposal promises before it is flown.
fn assert_as_wanted(proposal: &Proposal) {
    let wanted = &proposal.request.wanted;
    let name = &proposal.request.name;
    accept(&proposal.law).unwrap_or_else(|error| panic!("{name}: {error}"));
    with_margin(&proposal.law, wanted.margin).unwrap_or_else(|error| panic!("{name}: {error}"));
    for survey in &proposal.surveys {
        let (bandwidth, damping) = match survey.which {
            which if which.learns() => (0.0, 0.5 * wanted.damping),
            Which::Attitude => (wanted.attitude_bandwidth, wanted.damping),
            Which::Heading => (wanted.heading_bandwidth, wanted.damping),
            _ => (wanted.position_bandwidth, wanted.damping),
        };
        assert!(survey.bandwidth.value >= bandwidth, "{name}: {:?}", survey);
        assert!(survey.damping.value >= damping, "{name}: {:?}", survey);
        assert!(survey.decay.value > 0.0 && survey.sampled_modulus < 1.0, "{name}: {survey:?}");
    }
    LoadedScenario::parse(name, &proposal.scenario(), &[]).unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn the_first_condition_that_fails_is_the_constructors_error() {
    let loaded = LoadedScenario::open("paper-saturated", &[]).expect("built in");
    let ControllerConfig::Saturated(good) = loaded.scenario().controller else { panic!() };
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    let mut refused = 0;
    for _ in 0..300 {
        let mut config = good;
        let factor = [0.0, -1.0, f32::NAN, 3.0, 30.0, 3e3][random.next_u64() as usize % 6];
        let cascade = &mut config.cascade;
        let fields = [
            &mut config.step_period,
            &mut config.k4.x,
            &mut config.k5,
            &mut config.gamma2.z,
            &mut config.torque_max.y,
            &mut config.uncertainty.mass.upper,
            &mut config.uncertainty.inertia.lower.y,
            &mut cascade.m1,
            &mut cascade.k3.z,
            &mut cascade.delta_min_rotation,
        ];
        let count = fields.len();
        *fields.into_iter().nth(random.next_u64() as usize % count).expect("in range") *= factor;
        let failing =
            audit(&ControllerConfig::Saturated(config)).into_iter().find(|it| !it.holds());
        match (Saturated::new(&config), failing) {
            (Ok(_), None) => {}
            (Err(error), Some(condition)) => {
                refused += 1;
                assert_eq!(error.parameter, condition.parameter);
                assert_eq!(error.value.to_bits(), condition.value.to_bits());
                assert_eq!((error.bound, error.source), (condition.bound, condition.source));
            }
            other => panic!("{other:?} for {config:?}"),
        }
    }
    assert!(refused > 100, "{refused}");
    let loaded = LoadedScenario::open("paper-robust-adaptive", &[]).expect("built in");
    let ControllerConfig::RobustAdaptive(good) = loaded.scenario().controller else { panic!() };
    let mut seen = 0;
    RobustAdaptive::audit(&good, |condition| {
        assert!(condition.holds(), "{condition:?}");
        seen += 1;
    });
    assert!(seen > 20, "{seen}");
}

#[test]
fn every_shipped_vehicle_gets_gains_as_wanted() {
    for scenario in BUILT_IN {
        let wanted = WantedOptions::default();
        let request = Request::open(scenario.name, wanted).expect("built in");
        let proposal = Proposal::new(request).unwrap_or_else(|e| panic!("{}: {e}", scenario.name));
        assert_as_wanted(&proposal);
    }
}

/// The scenarios' own gains are not looked at.
#[test]
fn gains_of_the_scenario_do_not_matter() {
    let with = |changes: &[String]| {
        let loaded = LoadedScenario::open("paper-saturated", changes).expect("it flies");
        let wanted = WantedOptions::default();
        let request = Request::parse("paper-saturated", loaded.text(), wanted).expect("read");
        Proposal::new(request).expect("feasible").law
    };
    let changed = ["controller.saturated.k4=9".to_owned()];
    assert_eq!(with(&[]), with(&changed));
}

fn assert_check_passes(proposal: &Proposal) {
    let found = check(proposal).unwrap_or_else(|error| panic!("{error}"));
    assert!(found.passed(), "{}: {found:#?}", proposal.request.name);
    assert_eq!(found.flights, 40);
    for comparison in &found.comparisons {
        let observed = comparison.observed.expect("flown");
        assert!(observed <= comparison.predicted, "{comparison:?}");
        // A bound that is never approached would be no prediction.
        assert!(observed > 0.05 * comparison.predicted, "{comparison:?}");
    }
}

#[test]
fn the_papers_vehicle_flies_with_limits() {
    let request = Request::open("paper-saturated", WantedOptions::default()).expect("built in");
    assert_check_passes(&Proposal::new(request).expect("feasible"));
}

#[test]
fn the_papers_vehicle_flies_without_limits() {
    let wanted = WantedOptions { position_bandwidth: Some(1.0), ..WantedOptions::default() };
    let request = Request::open("paper-robust-adaptive", wanted).expect("built in");
    assert_check_passes(&Proposal::new(request).expect("feasible"));
}

#[test]
fn a_heavy_vehicle_flies() {
    let proposal = proposal(HEAVY);
    assert_as_wanted(&proposal);
    assert_check_passes(&proposal);
}

/// Ultimate errors of a flight.
#[derive(Default)]
struct Errors {
    from: f64,
    ticks: f64,
    peak: [f64; 3],
    squares: [f64; 3],
}

impl Observer for Errors {
    fn observe(&mut self, tick: &Tick) {
        if tick.time < self.from {
            return;
        }
        let seen = &tick.intermediates;
        let position = tick.truth.position_world.distance(tick.reference.position_world.as_dvec3());
        let errors = [
            position,
            rotation_angle(seen.attitude_error.as_dquat()),
            f64::from(seen.rate_error.length()),
        ];
        self.ticks += 1.0;
        for (i, error) in errors.into_iter().enumerate() {
            self.peak[i] = self.peak[i].max(error);
            self.squares[i] += error * error;
        }
    }
}

/// Predicted bounds against flights under the worst that may last and under noise.
#[test]
fn predicted_bounds_hold_what_is_observed() {
    for name in ["paper-saturated", "hover-gusts"] {
        let wanted = WantedOptions { position_bandwidth: Some(0.7), ..WantedOptions::default() };
        let proposal =
            Proposal::new(Request::open(name, wanted).expect("built in")).expect("feasible");
        let campaign = sil_host::tune::check::campaign(&proposal).expect("read");
        for variant in campaign.variants() {
            let loaded = campaign.scenario(5, variant).expect("flies");
            let mut errors = Errors { from: proposal.settle_time, ..Errors::default() };
            loaded.flight().expect("flies").observe(loaded.scenario().ticks(), &mut errors);
            let (mean, peak) = (proposal.ultimate.mean, proposal.ultimate.peak);
            let peaks = [peak.position, peak.attitude, peak.rate_error];
            let means = [mean.position, mean.attitude, mean.rate_error];
            for i in 0..3 {
                let rms = (errors.squares[i] / errors.ticks).sqrt();
                let what = format!("{name}, {}, error {i}", variant.name);
                assert!(
                    errors.peak[i] <= peaks[i].expect("predicted"),
                    "{what}: {}",
                    errors.peak[i]
                );
                assert!(means[i].is_none_or(|mean| rms <= mean), "{what}: rms {rms}");
            }
        }
    }
}

/// A vehicle drawn at random: 0.1 to 20 kg, arms in proportion, thrust for 1.6 to 3 times its weight.
fn random_vehicle(random: &mut Xoshiro256PlusPlus, index: usize) -> String {
    let mut between = |lower: f64, upper: f64| {
        lower + (upper - lower) * (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    };
    let mass = 0.1 * 200f64.powf(between(0.0, 1.0));
    let arm = 0.2 * mass.cbrt() * between(0.7, 1.4);
    let inertia = 0.3 * mass * arm * arm;
    let (lighter, thinner) = (between(0.7, 0.95), between(0.35, 0.8));
    let thrust = mass * 9.81 * between(1.6, 3.0);
    let torque = 0.2 * thrust * arm;
    let limits = format!("thrust_max = {thrust}\ntorque_max = {torque}");
    format!(
        "name = \"random-{index}\"
mass = {{ lower = {}, upper = {mass} }}
inertia = {{ lower = {}, upper = {inertia} }}
disturbance_acceleration = {}
disturbance_torque = {}
reference_acceleration_max = {}
step_period = {}
{}
[wanted]
position_bandwidth = {}
",
        lighter * mass,
        thinner * inertia,
        between(0.0, 0.3),
        between(0.0, 0.1) * torque,
        between(0.0, 0.5),
        between(0.0005, 0.002),
        if index.is_multiple_of(3) { "" } else { &limits },
        between(0.4, 1.2),
    )
}

/// Flies a second and more of hover with noise; every guarantee but those on settled errors must hold.
fn assert_short_hover(proposal: &Proposal) {
    let duration = 3.0 / proposal.request.wanted.position_bandwidth;
    let changes = [format!("duration={duration}")];
    let loaded = LoadedScenario::parse("hover", &proposal.scenario(), &changes).expect("flies");
    let scenario = loaded.scenario();
    let parameters = scenario.plant_parameters();
    let mut monitors = Guarantees::new(
        &scenario.guarantees,
        &scenario.controller,
        &parameters,
        &scenario.actuation,
    );
    let mut farthest = 0.0_f64;
    let mut each_tick = EachTick(|tick: &Tick| {
        farthest = farthest.max(tick.evaluation.position_error.length());
        monitors.observe(tick);
    });
    loaded.flight().expect("flies").observe(scenario.ticks(), &mut each_tick);
    for verdict in monitors.verdicts() {
        let settled = verdict.name.ends_with("after settling");
        let information = verdict.requirement == Requirement::Information;
        assert!(settled || information || verdict.pass, "{}: {verdict:?}", proposal.request.name);
    }
    assert!(farthest.is_finite() && farthest < 20.0, "{}: {farthest}", proposal.request.name);
}

struct EachTick<F>(F);

impl<F: FnMut(&Tick)> Observer for EachTick<F> {
    fn observe(&mut self, tick: &Tick) {
        (self.0)(tick);
    }
}

#[test]
fn random_vehicles_get_gains_that_fly_or_a_reason() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(2024);
    let mut feasible = 0;
    for index in 0..60 {
        let text = random_vehicle(&mut random, index);
        match Proposal::new(request(&text)) {
            Ok(proposal) => {
                feasible += 1;
                assert_as_wanted(&proposal);
                assert_short_hover(&proposal);
            }
            Err(error) => {
                assert!(error.left > error.right, "{text}{error}");
                assert!(!error.remedies.is_empty(), "{text}{error}");
            }
        }
    }
    assert!(feasible >= 40, "{feasible} of 60");
}

/// Text of the error after `key >= ` or `key <= `.
fn remedy(error: &str, key: &str) -> String {
    let (_, after) = error.split_once(key).unwrap_or_else(|| panic!("{key} in: {error}"));
    after.split_whitespace().next().expect("a number").trim_end_matches(',').to_owned()
}

#[test]
fn what_is_infeasible_says_what_would_help() {
    for (key, value, relation, inequality) in [
        ("thrust_max", "240.0", "thrust_max >= ", "upper thrust bound (54)"),
        ("torque_max", "0.9", "torque_max >= ", "within torque_max"),
        ("step_period", "0.09", "step_period <= ", "stability of the fixed step"),
    ] {
        let text = heavy_but(key, value);
        let error = Proposal::new(request(&text)).expect_err("infeasible");
        let message = error.to_string();
        assert!(message.contains(inequality) && error.left > error.right, "{message}");
        let changed_text = heavy_but(key, &remedy(&message, relation));
        let changed = Proposal::new(request(&changed_text));
        assert_as_wanted(&changed.unwrap_or_else(|next| panic!("{message}\n{next}")));
    }
}

/// Largest body rate (rad/s) over the first and the last quarter of a calm flight near hover, of the vehicle that the law
/// takes it for, with rotors of this lag.
fn ringing(proposal: &Proposal, lag: f64) -> [f64; 2] {
    let initial = proposal.request.initial;
    let inertia = initial.inertia;
    let changes = [
        "duration=60".to_owned(),
        format!("vehicle.mass={:?}", initial.mass),
        format!("vehicle.inertia=[{:?}, {:?}, {:?}]", inertia.x, inertia.y, inertia.z),
        "initial.position=[0.002, -0.002, 5.002]".to_owned(),
        "disturbance.noise.acceleration=0".to_owned(),
        "disturbance.noise.torque=0".to_owned(),
        format!("actuation={{rotor_lag={lag:?}}}"),
    ];
    let loaded = LoadedScenario::parse("ringing", &proposal.scenario(), &changes);
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    let mut rates = [0.0f64; 2];
    let mut each_tick = EachTick(|tick: &Tick| {
        let rate = tick.truth.rate_body.length();
        if (5.0..20.0).contains(&tick.time) {
            rates[0] = rates[0].max(rate);
        } else if tick.time >= 45.0 {
            rates[1] = rates[1].max(rate);
        }
    });
    loaded.flight().expect("flies").observe(loaded.scenario().ticks(), &mut each_tick);
    rates
}

/// The largest lag of the linearisation is where flights begin to ring, with the model of the rotors and without.
#[test]
fn flights_ring_beyond_the_predicted_lag_and_not_before() {
    for name in ["paper-saturated", "paper-robust-adaptive"] {
        for lead in [None, Some(1.0), Some(4.0)] {
            let wanted =
                WantedOptions { position_bandwidth: Some(1.0), ..WantedOptions::default() };
            let mut request = Request::open(name, wanted).expect("built in");
            if lead.is_some() {
                request.rotors.lag = 0.05;
                request.options.rotor_lead = lead;
                request.options.phase_margin_deg = Some(5.0);
                // What the model closes inside the law is seen with fast attitudes.
                request.options.attitude_bandwidth = Some(request.wanted.attitude_bandwidth);
            }
            let request = request.completed();
            let (rotors, mut proposal) =
                (request.rotors, Proposal::new(request).expect("feasible"));
            let hover = Hover::new(&proposal.law);
            let lags = [(Which::Lateral, 0), (Which::Attitude, 0), (Which::Heading, 2)].map(
                |(which, axis)| {
                    let corner = nominal(&proposal.law, axis);
                    let filter = RateFilterConfig::default();
                    margins_at(which, &hover, &corner, &rotors, &filter).lag
                },
            );
            let lag = lags.into_iter().fold(f64::INFINITY, f64::min);
            proposal.request.rotors = Rotors::default(); // the flights bring their own
            let (below, beyond) = (ringing(&proposal, 0.9 * lag), ringing(&proposal, 1.1 * lag));
            println!("{name} {lead:?}: {lags:?} s, {below:?} below, {beyond:?} beyond");
            assert!(below[1] < 0.2 * below[0], "{name}, 0.9 of {lag} s: {below:?}");
            assert!(
                beyond[1] > below[1] * 5.0 && beyond[1] > 1e-3,
                "{name}, 1.1 of {lag} s: {beyond:?}"
            );
        }
    }
}

/// Time (s) from which on a calm flight that starts `offset` (m) away stays within half a metre.
fn returned(proposal: &Proposal, offset: DVec3) -> f64 {
    let position = (DVec3::new(0.0, 0.0, 5.0) + offset).to_array();
    let initial = proposal.request.initial;
    let changes = [
        "duration=60".to_owned(),
        format!("vehicle.mass={:?}", initial.mass),
        format!("initial.position={position:?}"),
        "disturbance.noise.acceleration=0".to_owned(),
        "disturbance.noise.torque=0".to_owned(),
    ];
    let loaded = LoadedScenario::parse("return", &proposal.scenario(), &changes);
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    let mut outside = 0.0;
    let mut each_tick = EachTick(|tick: &Tick| {
        if tick.position_error().length() > 0.5 {
            outside = tick.time;
        }
    });
    loaded.flight().expect("flies").observe(loaded.scenario().ticks(), &mut each_tick);
    outside
}

/// A vehicle comes back from far away as fast as it was asked to and as was predicted.
#[test]
fn a_speed_of_return_is_met_and_flown() {
    let asked = |speed: f64| {
        let wanted = WantedOptions { return_speed: Some(speed), ..WantedOptions::default() };
        Request::parse("small.toml", example_of_the_documentation(), wanted).expect("valid")
    };
    let mut latest = f64::INFINITY;
    // A quarter: an overshoot that just touches half a metre is outside in one of both only.
    for speed in [0.0, 1.0] {
        let proposal = Proposal::new(asked(speed)).expect("feasible");
        assert_as_wanted(&proposal);
        assert!(return_speeds(&proposal.law).iter().all(|&it| it >= speed));
        let predicted = settling_times(&proposal.law, 10.0);
        let flown = [DVec3::X, DVec3::Z].map(|axis| returned(&proposal, 10.0 * axis));
        println!("{speed} m/s: {predicted:?} s predicted, {flown:?} s flown");
        for axis in 0..2 {
            assert!((flown[axis] / predicted[axis] - 1.0).abs() < 0.25, "{predicted:?} {flown:?}");
        }
        assert!(flown[1] < 0.8 * latest, "{flown:?} s, {latest} s before");
        latest = flown[1];
    }
    let message = Proposal::new(asked(3.0)).expect_err("too fast").to_string();
    let bandwidth = remedy(&message, "wanted.position_bandwidth <= ");
    let mut slower = asked(3.0);
    slower.options.position_bandwidth = Some(bandwidth.parse().expect("a number"));
    assert!(Proposal::new(slower.completed()).is_ok(), "{message}");
}

/// Gains for slow rotors keep their phase margin and fly the check behind them; where none do, the refusal names
/// a bandwidth that does.
#[test]
fn rotors_that_lag_and_delay_get_slower_gains_or_a_refusal_with_a_remedy() {
    let slow = HEAVY
        .replace("[wanted]", "rotor_lag = 0.03\ndelay = 0.005\n[wanted]")
        .replace("{ lower = 0.6, upper = 2.2 }", "{ lower = 0.9, upper = 1.3 }")
        .replace("disturbance_torque = 0.5", "disturbance_torque = 0.1")
        .replace("disturbance_acceleration = 0.5", "disturbance_acceleration = 0.2")
        .replace("torque_max = 25.0", "torque_max = 200.0");
    let proposal = proposal(&slow);
    assert_as_wanted(&proposal);
    for margins in &proposal.margins {
        assert!(margins.phase.to_degrees() >= 30.0 && margins.lag > 0.03, "{margins:?}");
    }
    assert!(proposal.scenario().contains("rotor_lag = 0.03"));
    let flown = check(&proposal).unwrap_or_else(|error| panic!("{error}"));
    assert!(flown.passed(), "{flown:#?}");
    let fast = slow.replace("damping = 0.6", "damping = 0.6\nattitude_bandwidth = 16.0");
    let message = Proposal::new(request(&fast)).expect_err("too fast").to_string();
    assert!(message.contains("phase margin") && message.contains("lag of 0.03 s"), "{message}");
    let bandwidth = remedy(&message, "wanted.attitude_bandwidth <= ");
    let changed = fast.replace("bandwidth = 16.0", &format!("bandwidth = {bandwidth}"));
    assert_as_wanted(&self::proposal(&changed));
    let lead = remedy(&message, "wanted.rotor_lead >= ");
    let led = self::proposal(&format!("{fast}\nrotor_lead = {lead}\n"));
    assert_as_wanted(&led);
    assert!(led.scenario().contains("[controller.saturated.rotors]"), "{}", led.scenario());
    let flown = check(&led).unwrap_or_else(|error| panic!("{error}"));
    assert!(flown.passed(), "{flown:#?}");
    let prompt = format!("{HEAVY}rotor_lead = 4.0\n");
    let error = Request::parse("vehicle.toml", &prompt, WantedOptions::default());
    let message = error.expect_err("no lag").to_string();
    assert!(message.contains("wanted.rotor_lead: needs a rotor_lag"), "{message}");
}

/// More speed than the torque gives is answered with more torque, or less speed; either passes.
#[test]
fn a_bandwidth_beyond_the_torque_is_answered_with_one_within() {
    let fast = format!("{HEAVY}attitude_bandwidth = 13\n");
    let message = Proposal::new(request(&fast)).expect_err("too fast").to_string();
    let bandwidth = remedy(&message, "wanted.attitude_bandwidth <= ");
    let slower =
        fast.replace("attitude_bandwidth = 13", &format!("attitude_bandwidth = {bandwidth}"));
    assert_as_wanted(&proposal(&slower));
    let torque = remedy(&message, "torque_max >= ");
    assert_as_wanted(&proposal(
        &fast.replace("torque_max = 25.0", &format!("torque_max = {torque}")),
    ));
}

#[test]
fn values_out_of_range_name_line_key_and_bound() {
    let refused = |text: &str| {
        Request::parse("vehicle.toml", text, WantedOptions::default()).expect_err("bad").to_string()
    };
    assert_eq!(
        refused(&heavy_but("step_period", "0.5")),
        "vehicle.toml:10: step_period: 0.5 must be in [0.0001, 0.1] s"
    );
    let message = refused(&heavy_but("damping", "1.5"));
    assert!(
        message.starts_with("vehicle.toml:13: wanted.damping: 1.5 must be in [0.1, "),
        "{message}"
    );
    let message = refused(&HEAVY.replace("torque_max = 25.0\n", ""));
    assert!(message.contains("vehicle.toml:8: thrust_max: needs torque_max"), "{message}");
    let message = refused(&HEAVY.replace("torque_max", "torqe_max"));
    assert!(message.contains("did you mean `torque_max`"), "{message}");
}

/// The vehicle file of `docs/tune.md`.
fn example_of_the_documentation() -> &'static str {
    let page = include_str!("../../docs/tune.md");
    let (_, example) = page.split_once("```toml\n").expect("an example");
    example.split_once("```").expect("its end").0
}

/// The vehicle file of `docs/tune.md`, whose `lasting_torque` is all of its `disturbance_torque`.
#[test]
fn the_example_of_the_documentation_gets_gains() {
    let example = example_of_the_documentation();
    let proposal = proposal(example);
    assert_eq!(proposal.request.name, "small");
    assert_eq!(proposal.request.lasting_torque, DVec3::splat(f64::from(2e-4_f32)));
    assert_as_wanted(&proposal);
    let more = example.replace("lasting_torque = 2e-4", "lasting_torque = 2.1e-4");
    let error =
        Request::parse("small.toml", &more, WantedOptions::default()).expect_err("too much");
    assert!(error.to_string().starts_with("small.toml:6: lasting_torque: "), "{error}");
}

fn sil_host(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sil-host")).args(arguments).output().expect("it starts")
}

#[test]
fn the_command_line_proposes_writes_and_refuses() {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let (vehicle, written) = (directory.join("heavy.toml"), directory.join("heavy-tuned.toml"));
    std::fs::write(&vehicle, HEAVY).expect("written");
    let (vehicle, written) = (vehicle.to_str().expect("UTF-8"), written.to_str().expect("UTF-8"));
    let output = sil_host(&["tune", vehicle, "--no-check", "--json", "--write", written]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(value["passed"], true);
    let conditions = value["conditions"].as_array().expect("an array");
    assert!(conditions.iter().all(|it| it["holds"] == true && it["holds_with_margin"] == true));
    assert!(conditions.len() > 30 && value["loops"].as_array().is_some_and(|it| it.len() == 4));
    assert!(value["controller"]["saturated"]["k4"].is_number(), "{value}");

    let out = directory.join("heavy-out");
    let out = out.to_str().expect("UTF-8");
    let output = sil_host(&["run", written, "--out", out, "--quiet"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");

    let output = sil_host(&["tune", vehicle, "--no-check", "--quiet"]);
    assert!(output.status.success() && output.stdout.is_empty() && output.stderr.is_empty());
    let output = sil_host(&["tune", vehicle, "--no-check"]);
    let table = String::from_utf8(output.stdout).expect("UTF-8");
    for piece in ["[controller.saturated.cascade]", "(>= 0.8) rad/s", "margin", "peak", "|z|"] {
        assert!(table.contains(piece), "{piece} in {table}");
    }
    let output = sil_host(&["tune", vehicle, "--position-bandwidth", "30"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("no gains meet the request"));
    let output = sil_host(&["tune", "no-such-vehicle"]);
    assert_eq!(output.status.code(), Some(2));
    let output = sil_host(&["tune", vehicle, "--no-check", "--write", "/no/such/place.toml"]);
    assert_eq!(output.status.code(), Some(3));
}
