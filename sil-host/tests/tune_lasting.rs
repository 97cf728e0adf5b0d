//! `tune` with integral action: gains of the estimates, their loops, and the push that they hold, in flight.

use ctrl_core::config::IntegralAction;
use sil_host::tune::check::check;
use sil_host::tune::design::{accept, with_margin};
use sil_host::tune::hover::Hover;
use sil_host::tune::proposal::Proposal;
use sil_host::tune::push_flight;
use sil_host::tune::request::{Request, WantedOptions};
use sil_host::tune::survey::{Which, nominal};
use sim::scenario::LoadedScenario;

/// A quadrotor of a hundred grams in a steady wind, its centre of mass displaced, with unlike axes.
const SMALL: &str = "
name = \"small\"
mass = { lower = 0.09, upper = 0.12 }
inertia = { lower = [3e-5, 3e-5, 6e-5], upper = [9e-5, 9e-5, 1.5e-4] }
disturbance_acceleration = 0.1
disturbance_torque = [1e-4, 1e-4, 5e-5]
steady_acceleration = 0.4
steady_torque = 1e-4
reference_acceleration_max = 0.5
step_period = 0.001
";
const LIMITS: &str = "thrust_max = 2.4\ntorque_max = [4e-3, 4e-3, 1e-3]\n";
const WANTED: &str = "[wanted]\nposition_bandwidth = 1.0\n";

fn request(text: &str) -> Request {
    Request::parse("vehicle.toml", text, WantedOptions::default())
        .unwrap_or_else(|error| panic!("{error}"))
}

fn proposal(text: &str) -> Proposal {
    Proposal::new(request(text)).unwrap_or_else(|error| panic!("{error}"))
}

/// Both laws, with either estimate and with both.
#[test]
fn a_push_that_lasts_is_held_in_the_predicted_time() {
    for (limits, steady) in [("", "steady_torque"), (LIMITS, ""), (LIMITS, "steady_acceleration")] {
        let lines = SMALL.lines().filter(|line| steady.is_empty() || !line.starts_with(steady));
        let text = format!("{}\n{limits}{WANTED}", lines.collect::<Vec<_>>().join("\n"));
        let proposal = proposal(&text);
        let law = &proposal.law;
        accept(law).unwrap_or_else(|error| panic!("{error}"));
        with_margin(law, 0.1).unwrap_or_else(|error| panic!("{error}"));
        let hover = Hover::new(law);
        let gains = hover.lasting.map(|gain| gain > 0.0);
        assert_eq!(gains, [steady != "steady_acceleration", steady != "steady_torque"]);
        for survey in proposal.surveys.iter().filter(|it| it.which.is_integral()) {
            assert!(survey.damping.value >= 0.25 && survey.decay.value > 0.0, "{survey:?}");
        }
        let flown = push_flight::fly(&proposal).expect("flies").expect("a push");
        println!("controller {} without {steady:?}: {flown:?}", law.key());
        assert!(flown.passed(), "{flown:?}");
        // A prediction that is far too long would hold as well.
        assert!(flown.flown.is_some_and(|it| it > 0.5 * flown.predicted), "{flown:?}");
    }
}

#[test]
fn the_check_flies_the_push_and_fails_without_the_estimate() {
    let mut proposal = proposal(&format!("{SMALL}{LIMITS}{WANTED}"));
    let flown = check(&proposal).unwrap_or_else(|error| panic!("{error}"));
    assert!(flown.passed() && flown.push.is_some(), "{flown:#?}");
    *proposal.law.integral_mut() = IntegralAction::OFF;
    let flown = push_flight::fly(&proposal).expect("flies").expect("a push");
    assert!(!flown.passed() && flown.flown.is_none(), "{flown:?}");
}

/// Tilt aside, `gamma_d = gamma1 m^2 g^2` gives the horizontal loop the poles of the height while the mass adapts.
#[test]
fn behind_a_fast_attitude_the_horizontal_poles_are_those_of_the_height() {
    let fast = format!("{SMALL}{WANTED}attitude_bandwidth = 60.0\n");
    let mut law = proposal(&fast).law;
    let corner = nominal(&law, 0);
    let gain = f64::from(law.cascade().gamma1) * (corner.mass * 9.81).powi(2);
    (law.integral_mut().gamma_d, law.integral_mut().gamma_t) = (gain as f32, 0.0);
    law.cascade_mut().c = 0.0;
    let hover = Hover::new(&law);
    let [lateral, vertical] = [Which::LateralIntegral, Which::VerticalAdaptive]
        .map(|which| which.at(&hover, &corner).continuous_poles());
    for (horizontal, vertical) in lateral.iter().zip(&vertical) {
        let apart = (horizontal.re - vertical.re).hypot(horizontal.im.abs() - vertical.im.abs());
        assert!(apart < 0.05 * vertical.modulus(), "{lateral:?}\n{vertical:?}");
    }
}

/// The scenario that a proposal writes asks for the same again.
#[test]
fn a_written_scenario_is_a_request_for_the_same() {
    let proposal = proposal(&format!("{SMALL}{LIMITS}{WANTED}"));
    let text = proposal.scenario();
    let flags = WantedOptions { position_bandwidth: Some(1.0), ..WantedOptions::default() };
    let again = Request::parse("written.toml", &text, flags).expect("a scenario");
    let (before, after) = (proposal.request.steady, again.steady);
    assert!((after.acceleration / before.acceleration - 1.0).abs() < 1e-3, "{after:?}");
    assert_eq!(after.torque, f64::from(before.torque as f32));
    assert!(text.contains("[controller.saturated.integral]") && text.contains("[1/s^2]"), "{text}");
    let loaded = LoadedScenario::parse("written", &text, &[]).expect("flies");
    assert_eq!(loaded.scenario().controller.integral(), proposal.law.integral());
}

#[test]
fn more_than_the_vehicle_bears_is_refused_with_what_would_do() {
    let strong =
        format!("{SMALL}{LIMITS}{WANTED}").replace("acceleration = 0.4", "acceleration = 1.8");
    let message = Proposal::new(request(&strong)).expect_err("too strong").to_string();
    assert!(message.contains("(54)") && message.contains("steady_acceleration"), "{message}");
    let (_, thrust) = message.split_once("thrust_max >= ").expect("a remedy");
    let thrust = thrust.split_whitespace().next().expect("a number");
    proposal(&strong.replace("thrust_max = 2.4", &format!("thrust_max = {thrust}")));
    let text = SMALL.replace("acceleration = 0.4", "acceleration = -0.1");
    let error = Request::parse("vehicle.toml", &text, WantedOptions::default()).expect_err("bad");
    let message = error.to_string();
    assert!(
        message.starts_with("vehicle.toml:7: steady_acceleration: -0.1 must be in"),
        "{message}"
    );
}
