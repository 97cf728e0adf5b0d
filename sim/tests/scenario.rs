//! Scenarios: what is built in is valid, and every fault is named with its place.

use sim::scenario::{BUILT_IN, BuiltIn, LoadedScenario, Scenario};

fn text_of(name: &str) -> &'static str {
    BuiltIn::named(name).expect("a built-in scenario").text
}

/// The message for a built-in scenario with one piece of its text replaced.
fn fault_after(name: &str, old: &str, new: &str) -> String {
    let text = text_of(name);
    assert_eq!(text.matches(old).count(), 1, "`{old}` once in {name}");
    let changed = text.replace(old, new);
    match LoadedScenario::parse("my.toml", &changed, &[]) {
        Ok(_) => panic!("`{new}` was accepted"),
        Err(error) => error.to_string(),
    }
}

/// The message for a change of the paper's scenario for controller 2.
fn fault_of_change(change: &str) -> String {
    match LoadedScenario::open("paper-saturated", &[change.to_owned()]) {
        Ok(_) => panic!("`{change}` was accepted"),
        Err(error) => error.to_string(),
    }
}

fn changed(change: &str) -> Scenario {
    let loaded = LoadedScenario::open("paper-saturated", &[change.to_owned()]);
    loaded.unwrap_or_else(|error| panic!("{error}")).scenario().clone()
}

fn line_of(name: &str, piece: &str) -> usize {
    1 + text_of(name).lines().position(|line| line.contains(piece)).expect("a line")
}

#[test]
fn built_in_scenarios_are_valid_and_keep_the_assumptions() {
    for built_in in BUILT_IN {
        let loaded = LoadedScenario::open(built_in.name, &[]).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(loaded.scenario().name, built_in.name);
        // A flight by sensors breaks that assumption, and behind rotors that lag and in wind two more.
        let mut broken = loaded.scenario().broken_assumptions();
        if loaded.scenario().sensors.is_some() {
            assert!(broken.pop().expect("named").contains("an estimate by sensors"));
        }
        let wind = "disturbance acceleration up to inf m/s^2 exceeds D1 = 0.6 m/s^2";
        let lag = "thrust and torque follow the command with a time constant of 0.03 s";
        let expected = match built_in.name {
            "sensors-lemniscate" => vec![lag],
            "sensors-wind" => vec![wind, lag],
            _ => vec![],
        };
        assert_eq!(broken, expected, "{}", built_in.name);
    }
}

#[test]
fn flights_repeat_to_the_bit_with_their_seed_only() {
    let end = |seed: u32| {
        let change = [format!("seed={seed}")];
        let loaded = LoadedScenario::open("paper-robust-adaptive", &change).expect("valid");
        let mut flight = loaded.flight().expect("valid");
        flight.advance(2_000);
        *flight.truth()
    };
    assert_eq!(end(1), end(1));
    assert_ne!(end(1), end(2));
}

#[test]
fn unknown_keys_are_named_with_line_and_suggestion() {
    let line = line_of("paper-saturated", "torque_max = 0.05");
    let message = fault_after("paper-saturated", "torque_max = 0.05", "torque_limit = 0.05");
    let start = format!(
        "my.toml:{line}: controller.saturated.torque_limit: unknown field `torque_limit`, expected"
    );
    assert!(message.starts_with(&start), "{message}");
    assert!(message.ends_with("; did you mean `torque_max`?"), "{message}");

    let message = fault_after("paper-saturated", "duration = 200.0", "durration = 200.0");
    assert!(message.ends_with("did you mean `duration`?"), "{message}");

    let message = fault_after("paper-saturated", "[trajectory.rising_circle]", "[trajectory.ring]");
    assert!(message.contains("trajectory.ring: unknown variant `ring`"), "{message}");
}

#[test]
fn missing_keys_are_named() {
    let message = fault_after("paper-saturated", "k5 = 0.5", "");
    assert!(message.contains("controller.saturated: missing field `k5`"), "{message}");
}

#[test]
fn wrong_types_and_units_are_named() {
    let line = line_of("paper-saturated", "mass = 0.85");
    let message = fault_after("paper-saturated", "mass = 0.85", "mass = \"850 g\"");
    let expected = format!(
        "my.toml:{line}: vehicle.mass: invalid type: string \"850 g\", expected f64; write a \
         number alone, in the unit that the comments give"
    );
    assert_eq!(message, expected);

    let message = fault_after("paper-saturated", "[0.04856, 0.04856, 0.09801]", "[0.04856]");
    assert!(message.contains("vehicle.inertia: invalid length 1"), "{message}");
}

#[test]
fn broken_toml_is_named_with_its_line() {
    let line = line_of("paper-saturated", "[vehicle]");
    let message = fault_after("paper-saturated", "[vehicle]", "[vehicle");
    assert!(message.starts_with(&format!("my.toml:{line}: ")), "{message}");
}

#[test]
fn impossible_values_are_named_with_their_bound() {
    let line = line_of("paper-saturated", "tilt_deg = 0.0");
    let message = fault_after("paper-saturated", "tilt_deg = 0.0", "tilt_deg = 181.0");
    let expected = format!("my.toml:{line}: initial.tilt_deg: 181 must be in [0, 180] deg");
    assert_eq!(message, expected);
    let message = fault_after("paper-saturated", "mass = 0.85", "mass = -1");
    assert!(message.ends_with("vehicle.mass: -1 must be positive"), "{message}");
    let message = fault_after("paper-saturated", "velocity = [0.0,", "velocity = [inf,");
    assert!(message.ends_with("initial.velocity: must be finite"), "{message}");
}

#[test]
fn an_inertia_of_no_rigid_body_is_refused_with_line_and_rule() {
    let line = line_of("paper-saturated", "inertia = [0.04856");
    let message = fault_after("paper-saturated", "0.04856, 0.04856, 0.09801", "0.01, 0.01, 0.9");
    assert!(message.starts_with(&format!("my.toml:{line}: vehicle.inertia: ")), "{message}");
    assert!(message.contains("at most the sum of the other two"), "{message}");
    // Two equal moments may not sum to less than the third, whichever axis it is.
    for inertia in ["[0.9, 0.01, 0.01]", "[0.01, 0.9, 0.01]"] {
        assert!(fault_of_change(&format!("vehicle.inertia={inertia}")).contains("no rigid body"));
    }
    assert_eq!(changed("vehicle.inertia=[0.04, 0.04, 0.08]").vehicle.inertia.z, 0.08);
}

#[test]
fn a_name_that_is_no_path_component_is_refused_with_line_and_rule() {
    let line = line_of("paper-saturated", "name = ");
    for name in ["", "..", "../../etc/p", "a/b"] {
        let text = format!("name = \"{name}\"");
        let message = fault_after("paper-saturated", "name = \"paper-saturated\"", &text);
        assert!(message.starts_with(&format!("my.toml:{line}: name: ")), "{message}");
        assert!(message.contains("letters, digits"), "{message}");
    }
}

#[test]
fn refusals_of_the_controller_are_traced_to_their_key() {
    let line = line_of("paper-saturated", "gamma3 = 0.01");
    let message = fault_after("paper-saturated", "gamma3 = 0.01", "gamma3 = -0.01");
    let start = format!("my.toml:{line}: controller.saturated.gamma3: gamma3 = -0.01 must be zero");
    assert!(message.starts_with(&start), "{message}");

    // Lines of an expression and of an element of a vector.
    let line = line_of("paper-robust-adaptive", "M1 = 4.0");
    let message = fault_after("paper-robust-adaptive", "M1 = 4.0", "M1 = 5.9");
    let start = format!("my.toml:{line}: controller.robust_adaptive.cascade.M1: ");
    assert!(message.starts_with(&start) && message.contains("(19)"), "{message}");
    let line = line_of("paper-saturated", "inertia = [0.06, 0.06, 0.06]");
    let message = fault_after("paper-saturated", "[0.06, 0.06, 0.06]", "[0.06, 0.06, 0.6]");
    let start = format!("my.toml:{line}: controller.saturated.initial.inertia: ");
    assert!(message.starts_with(&start), "{message}");
}

#[test]
fn refusals_of_the_trajectory_are_traced_to_their_key() {
    let message = fault_after("paper-saturated", "radius = 100.0", "radius = -1.0");
    assert!(message.contains(": trajectory.rising_circle.radius: "), "{message}");
    let message = fault_after("paper-saturated", "radius = 100.0", "radius = 101.0");
    assert!(message.contains("trajectory: trajectory.acceleration_bound = 0.2525"), "{message}");
}

#[test]
fn changes_reach_any_field() {
    assert_eq!(changed("duration=5").duration, 5.0);
    assert_eq!(changed("vehicle.inertia=[0.04, 0.05, 0.08]").vehicle.inertia.z, 0.08);
    assert_eq!(
        changed("vehicle.inertia[2]=0.09").vehicle.inertia.to_array(),
        [0.04856, 0.04856, 0.09]
    );
    assert_eq!(changed("name=other").name, "other");
    assert_eq!(
        changed("controller.saturated.uncertainty.mass.upper = 0.9")
            .controller
            .uncertainty()
            .mass
            .upper,
        0.9
    );
    let constant = "disturbance.constant={acceleration=[0.01,0,0], torque=[0,0,0]}";
    let constant = changed(constant).disturbance.constant.expect("was set");
    assert_eq!(constant.acceleration.x, 0.01);
}

#[test]
fn later_changes_win() {
    let changes = ["seed=5".to_owned(), "seed=6".to_owned()];
    let loaded = LoadedScenario::open("paper-saturated", &changes).expect("valid");
    assert_eq!(loaded.scenario().seed, 6);
    assert!(loaded.text().contains("seed = 6"));
}

#[test]
fn faulty_changes_are_named() {
    let message = fault_of_change("controller.saturated.k9=1");
    let start = "--set controller.saturated.k9=1: controller.saturated.k9: unknown field `k9`";
    assert!(message.starts_with(start), "{message}");
    let message = fault_of_change("gain.k1=1");
    assert!(message.starts_with("--set gain.k1=1: gain: unknown field `gain`"), "{message}");
    assert_eq!(
        fault_of_change("duration.x=1"),
        "--set duration.x=1: duration.x: `duration` is a value, not a table"
    );
    assert_eq!(
        fault_of_change("vehicle.inertia[3]=1"),
        "--set vehicle.inertia[3]=1: vehicle.inertia[3]: `inertia` has 3 elements, the first is [0]"
    );
    assert_eq!(
        fault_of_change("duration[0]=1"),
        "--set duration[0]=1: duration[0]: `duration` is not an array"
    );
    let message = fault_of_change("vehicle.inertia[1]=\"heavy\"");
    let start = "--set vehicle.inertia[1]=\"heavy\": vehicle.inertia: invalid type: string";
    assert!(message.starts_with(start), "{message}");
    assert_eq!(fault_of_change("vehicle=1"), "--set vehicle=1: vehicle: is a table, not a value");
    assert_eq!(fault_of_change("duration"), "--set duration: expected path=value");
    let message = fault_of_change("duration=5 s");
    let start = "--set duration=5 s: duration: invalid type: string \"5 s\", expected f64";
    assert!(message.starts_with(start), "{message}");
    let message = fault_of_change("duration=-5");
    assert_eq!(message, "--set duration=-5: duration: -5 must be in (0, 1e6] s");
}

#[test]
fn faults_outside_a_change_keep_their_line() {
    let line = line_of("paper-saturated", "thrust_max = 12.0");
    let text = text_of("paper-saturated").replace("thrust_max = 12.0", "thrust_max = -1.0");
    let insert = ["disturbance.gust={hold=1, acceleration=0, torque=0}".to_owned()];
    let error = LoadedScenario::parse("my.toml", &text, &insert).expect_err("refused");
    assert!(error.to_string().starts_with(&format!("my.toml:{line}: ")), "{error}");
}

#[test]
fn violated_assumptions_are_reported() {
    let broken = changed("disturbance.noise.torque=0.06").broken_assumptions();
    assert_eq!(broken, ["disturbance torque up to 0.06 N m exceeds D2 = 0.05 N m"]);
    let broken = changed("disturbance.noise.torque=[0.05, 0.06, 0.04]").broken_assumptions();
    assert_eq!(broken, ["disturbance torque up to 0.06 N m about y exceeds D2 = 0.05 N m"]);
    let broken = changed("vehicle.mass=1.1").broken_assumptions();
    assert_eq!(broken, ["true mass 1.1 kg is outside [0.7, 1] kg"]);
}

#[test]
fn a_gain_of_the_integral_action_without_a_bound_is_named() {
    let change = "controller.saturated.integral.torque_max=0".to_owned();
    let error = LoadedScenario::open("steady-wind", &[change]).expect_err("refused").to_string();
    let end = "controller.saturated.integral.gamma_t: 0.5 must be 0 while torque_max is 0";
    assert!(error.ends_with(end), "{error}");
}
