//! `tune` under noise of the body rate: predicted torque against flights, the trade against bandwidth, filters in the margins.

use ctrl_core::filter::{LowPassConfig, RateFilterConfig};
use sil_host::tune::check::check;
use sil_host::tune::hover::Hover;
use sil_host::tune::margin::margins_at;
use sil_host::tune::noise_flight::fly;
use sil_host::tune::proposal::Proposal;
use sil_host::tune::request::{Request, WantedOptions};
use sil_host::tune::survey::{Which, nominal};
use sim::observer::Observer;
use sim::scenario::LoadedScenario;
use sim::tick::Tick;

/// A quadrotor of half a kilogram with unlike axes.
const HALF_KILOGRAM: &str = "
name = \"half-kilogram\"
mass = { lower = 0.4, upper = 0.6 }
inertia = { lower = [2.9e-3, 2.9e-3, 5.6e-3], upper = [4.4e-3, 4.4e-3, 8.5e-3] }
disturbance_acceleration = 0.5
disturbance_torque = 5e-3
reference_acceleration_max = 1.0
thrust_max = 20.0
torque_max = [0.8, 0.8, 0.15]
step_period = 0.002
rate_noise = 0.03

[wanted]
position_bandwidth = 1.5
";

fn request(text: &str) -> Request {
    Request::parse("vehicle.toml", text, WantedOptions::default())
        .unwrap_or_else(|error| panic!("{error}"))
}

fn proposal(text: &str) -> Proposal {
    Proposal::new(request(text)).unwrap_or_else(|error| panic!("{error}"))
}

fn assert_flown_as_predicted(name: &str, proposal: &Proposal) {
    let flown = fly(proposal).unwrap_or_else(|error| panic!("{error}")).expect("rate noise");
    println!("{name}: {flown:?}");
    assert!(flown.passed(), "{name}: {flown:?}");
}

#[test]
fn flights_have_the_predicted_torque() {
    for (name, noises) in
        [("paper-saturated", [0.001, 0.002]), ("paper-robust-adaptive", [0.001, 0.02])]
    {
        for noise in noises {
            let wanted = WantedOptions {
                position_bandwidth: Some(0.8),
                rate_noise: Some(noise),
                ..WantedOptions::default()
            };
            let request = Request::open(name, wanted).expect("built in");
            let proposal = Proposal::new(request).unwrap_or_else(|error| panic!("{error}"));
            assert_flown_as_predicted(&format!("{name}, {noise} rad/s"), &proposal);
        }
    }
    let variants = [
        ("as it is", "rate_noise = 0.03"),
        ("noise far beyond the smooth sign's width", "rate_noise = 0.5"),
        ("slow rotors", "rate_noise = 0.03\nrotor_lag = 0.01\ndelay = 0.004"),
        (
            "a low-pass",
            "rate_noise = 0.03\nrate_filter.low_pass = { frequency = 60.0, quality = 0.7071 }",
        ),
    ];
    for (name, lines) in variants {
        assert_flown_as_predicted(
            name,
            &proposal(&HALF_KILOGRAM.replace("rate_noise = 0.03", lines)),
        );
    }
    let slow = HALF_KILOGRAM.replace("rate_noise = 0.03", "rate_noise = 0.03\nrotor_lag = 0.03");
    assert_flown_as_predicted("a lead", &proposal(&format!("{slow}rotor_lead = 3.0\n")));
}

#[test]
fn a_bound_of_the_torque_takes_a_flatter_smooth_sign_and_then_less_bandwidth() {
    let slope = |proposal: &Proposal| Hover::new(&proposal.law).slope_over_gain();
    let free = proposal(HALF_KILOGRAM);
    let torque = free.activity.expect("rate noise").torque;
    let bounded = |most: f64| {
        let text = format!("{HALF_KILOGRAM}noise_torque_max = {most:?}\n");
        Proposal::new(request(&text))
    };
    let flatter = bounded(0.6 * torque).unwrap_or_else(|error| panic!("{error}"));
    assert!(flatter.activity.expect("rate noise").torque <= 0.6 * torque);
    assert!(slope(&flatter) < 0.75 * slope(&free), "{} {}", slope(&flatter), slope(&free));
    assert_flown_as_predicted("flatter", &flatter);

    let given = proposal(&format!("{HALF_KILOGRAM}rotation_slope = 0.5\n"));
    assert!((slope(&given) - 0.5).abs() < 0.01, "{}", slope(&given));

    let message = bounded(0.1 * torque).expect_err("too little").to_string();
    assert!(
        message.contains("torque that rate noise of 0.03 rad/s makes, rms over all axes"),
        "{message}"
    );
    let text = format!(
        "{HALF_KILOGRAM}attitude_bandwidth = 12.0\nnoise_torque_max = {:?}\n",
        0.6 * torque
    );
    let message = Proposal::new(request(&text)).expect_err("too fast").to_string();
    let start = message.find("wanted.attitude_bandwidth <= ").expect("a remedy");
    let bandwidth = message[start + 29..].split(' ').next().expect("a number");
    let slower =
        text.replace("attitude_bandwidth = 12.0", &format!("attitude_bandwidth = {bandwidth}"));
    assert!(proposal(&slower).activity.expect("rate noise").torque <= 0.6 * torque);
}

#[test]
fn noise_that_would_saturate_the_torque_is_refused() {
    let wanted = WantedOptions { rate_noise: Some(0.1), ..WantedOptions::default() };
    let request = Request::open("paper-saturated", wanted).expect("built in");
    let message = Proposal::new(request).expect_err("too much").to_string();
    assert!(
        message.contains("three standard deviations about one axis, within torque_max"),
        "{message}"
    );
}

#[test]
fn the_check_flies_behind_filters_and_under_noise() {
    let filter = "rate_filter.low_pass = { frequency = 80.0, quality = 0.7071 }\n\
        rate_filter.notches = [{ frequency = 150.0, quality = 4.0 }]\nrate_noise = 0.03";
    let proposal = proposal(&HALF_KILOGRAM.replace("rate_noise = 0.03", filter));
    assert!(proposal.scenario().contains("notches = [{ frequency = 150.0, quality = 4.0 }]"));
    let flown = check(&proposal).unwrap_or_else(|error| panic!("{error}"));
    assert!(flown.passed(), "{flown:#?}");
    assert!(flown.noise.is_some());
}

/// Largest body rate (rad/s) early and late in a calm flight near hover, behind a low-pass of `frequency` (Hz).
fn ringing(proposal: &Proposal, frequency: f64) -> [f64; 2] {
    struct Rates([f64; 2]);
    impl Observer for Rates {
        fn observe(&mut self, tick: &Tick) {
            let late = usize::from(tick.time >= 15.0);
            if (1.0..5.0).contains(&tick.time) || late == 1 {
                self.0[late] = self.0[late].max(tick.truth.rate_body.length());
            }
        }
    }
    let initial = proposal.request.initial;
    let changes = [
        "duration=20".to_owned(),
        format!("vehicle.mass={:?}", initial.mass),
        "initial.position=[0.001, -0.001, 5.001]".to_owned(),
        "disturbance.noise.acceleration=0".to_owned(),
        "disturbance.noise.torque=0".to_owned(),
        format!("rate_filter.low_pass={{ frequency = {frequency:?}, quality = 0.7 }}"),
    ];
    let loaded = LoadedScenario::parse("ringing", &proposal.scenario(), &changes);
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    let mut rates = Rates([0.0; 2]);
    loaded.flight().expect("flies").observe(loaded.scenario().ticks(), &mut rates);
    rates.0
}

#[test]
fn flights_ring_below_the_predicted_corner_of_a_low_pass_and_not_above() {
    let proposal = proposal(HALF_KILOGRAM);
    let hover = Hover::new(&proposal.law);
    let phase = |frequency: f64| {
        let low_pass = Some(LowPassConfig { frequency: frequency as f32, quality: 0.7 });
        let filter = RateFilterConfig { low_pass, ..RateFilterConfig::default() };
        [(Which::Lateral, 0), (Which::Attitude, 0), (Which::Heading, 2)]
            .map(|(which, axis)| {
                let corner = nominal(&proposal.law, axis);
                margins_at(which, &hover, &corner, &proposal.request.rotors, &filter).phase
            })
            .into_iter()
            .fold(f64::INFINITY, f64::min)
    };
    let (mut rings, mut settles) = (0.5, 200.0);
    assert!(phase(rings) < 0.0 && phase(settles) > 0.0);
    for _ in 0..40 {
        let middle = f64::sqrt(rings * settles);
        if phase(middle) > 0.0 { settles = middle } else { rings = middle }
    }
    let (above, below) = (ringing(&proposal, 1.15 * settles), ringing(&proposal, settles / 1.15));
    println!("{settles} Hz: {above:?} above, {below:?} below");
    assert!(above[1] < 0.3 * above[0], "1.15 times {settles} Hz: {above:?}");
    assert!(below[1] > 3.0 * above[1] && below[1] > 1e-3, "{settles} Hz/1.15: {below:?}");
}
