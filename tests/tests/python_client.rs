//! A client in Python that knows `docs/protocol.md` only, against the image in QEMU.
//!
//! Needs `python3`, and what the tests of the emulated firmware need.

#[allow(dead_code, reason = "shared with the tests of the emulated firmware, which use all of it")]
#[path = "firmware_emulator/emulator.rs"]
mod emulator;

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use ctrl_core::config::SaturatedConfig;
use ctrl_core::saturated::Saturated;
use firmware::scenario::BUILT_IN_MISSION;
use link::{ControllerKind, Parameters, Rejection};
use serde_json::{Value, json};

use emulator::{finish, text};

/// FIFOs for a vehicle and its client, and the vehicle.
fn over_fifos() -> (Child, String) {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("python-client");
    for ending in ["in", "out"] {
        let fifo = PathBuf::from(format!("{}.{ending}", path.display()));
        let _ = std::fs::remove_file(&fifo);
        assert!(Command::new("mkfifo").arg(&fifo).status().expect("mkfifo").success());
    }
    let directives = [format!("link={}", path.display())];
    let vehicle = emulator::emulator("firmware").start(&directives, "null").unwrap();
    (vehicle, path.display().to_string())
}

/// A vehicle whose serial port waits for its client at a port of this machine.
fn over_a_wire() -> (Child, String) {
    let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let serial = format!("tcp:127.0.0.1:{free},server=on,wait=on");
    let vehicle = emulator::emulator("firmware").start(&[], &serial).unwrap();
    (vehicle, format!("tcp:{free}"))
}

/// Runs the script against a fresh vehicle and returns what it received.
fn converse((mut vehicle, link): (Child, String)) -> Value {
    let python = Command::new("python3").arg("--version").output();
    python.expect("python3 must be installed, on Debian or Ubuntu: apt install python3");
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut client = Command::new("python3");
    client.arg(tests.join("tests/python/client.py")).arg(tests.join("../docs/protocol.md"));
    let client = client.arg(link).stdin(Stdio::null()).stdout(Stdio::piped());
    let output = finish(client.stderr(Stdio::piped()).spawn().unwrap());
    vehicle.kill().unwrap();
    vehicle.wait().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A number of the script as the `f32` that it was on the wire.
fn number(value: &Value) -> f32 {
    value.as_f64().unwrap() as f32
}

/// The page's examples of telemetry and of lasting estimates: the numbers count from 1, in the order of the fields.
fn assert_examples(said: &Value) {
    assert_eq!(said[0], json!([1, {"sequence": 1, "rejection": null}]));
    let stale = json!({"kind": "mode", "refusal": "state stale"});
    assert_eq!(said[1], json!([1, {"sequence": 1, "rejection": stale}]));
    let numbers: Vec<_> = (1..=28).map(f64::from).collect();
    let telemetry = json!([2, {
        "tick": 1000, "mode": "Failsafe", "cause": 1, "numbers": numbers,
        "status": 0x180, "limited": 4, "cost": 1736,
    }]);
    assert_eq!(said[2], telemetry);
    assert_eq!(said[3], json!([9, {"tick": 1000, "numbers": numbers[..9]}]));
}

/// The list is the core's table with the image's values.
fn assert_parameters(said: &Value, config: SaturatedConfig) {
    let said = said.as_array().unwrap();
    assert_eq!(said.len(), SaturatedConfig::NAMES.len());
    for (index, parameter) in (0..).zip(said) {
        let (name, value) = config.parameter_at(index).unwrap();
        assert_eq!((&parameter[0], number(&parameter[1])), (&json!(name), value));
    }
}

/// The refusal is the core's own, and the value stays what it was.
fn assert_refused(said: &Value, config: SaturatedConfig) {
    let error = Saturated::new(&config.with_parameter("cascade.M1", 9.0).unwrap()).unwrap_err();
    let Rejection::Invalid { parameter, value, lower, upper } = error.into() else { panic!() };
    let rejection = &said[0];
    assert_eq!(rejection["kind"], "invalid");
    assert_eq!(rejection["name"], parameter.as_str());
    let numbers = ["value", "lower", "upper"].map(|field| number(&rejection[field]));
    assert_eq!(numbers, [value, lower, upper]);
    assert_eq!(number(&said[1]), config.cascade.m1);
}

fn assert_flight(said: &Value, config: SaturatedConfig) {
    let stale = json!({"kind": "mode", "refusal": "state stale"});
    assert_eq!(said["armed without a state"], stale);
    assert_eq!(said["armed"], Value::Null);
    assert_eq!(said["started"], Value::Null);
    let (armed, flying) = (&said["after arming"], &said["after starting"]);
    assert_eq!((&armed["mode"], number(&armed["numbers"][0])), (&json!("Armed"), 0.0));
    assert_eq!(flying["mode"], "Flying");
    let thrust = number(&flying["numbers"][0]);
    assert!(thrust > 1.0 && thrust <= config.thrust_max, "{thrust}");
}

#[test]
fn a_python_client_of_the_documented_bytes_tunes_and_arms_the_vehicle() {
    assert_conversation(&converse(over_fifos()));
}

#[test]
fn over_usart2_it_does_the_same_in_lock_step() {
    assert_conversation(&converse(over_a_wire()));
}

fn assert_conversation(said: &Value) {
    let mission = &BUILT_IN_MISSION;
    assert_eq!(mission.tuning.kind, ControllerKind::Saturated);
    let config = mission.tuning.saturated;
    assert_examples(&said["examples"]);
    let first = said["greeting"].as_array().unwrap();
    assert!(first.len() == 2 && first[0][0] == 0, "{first:?}");
    let built_in = json!([6, {"origin": "built-in", "generation": 0, "changed": false}]);
    assert_eq!(first[1], built_in);
    let identity = &said["identity"];
    assert_eq!(identity["board"], "emulated STM32F405");
    assert_eq!((&identity["controller"], &identity["fault"]), (&json!(1), &json!(false)));
    assert_eq!(number(&identity["step_period"]), config.step_period);
    assert_parameters(&said["parameters"], config);
    assert_eq!(said["written"], json!([null, 0.4375]));
    assert_refused(&said["refused"], config.with_parameter("cascade.k1", 0.4375).unwrap());
    assert_eq!(said["unknown"], json!({"kind": "unknown parameter"}));
    assert_eq!(said["subscribed"], Value::Null);
    assert_eq!(said["ticks"], json!(vec!["Disarmed"; 10]));
    assert_flight(said, config);
    // What the vehicle's decoder counted: uptime, four groups of three, then the link.
    let link: Vec<_> = (13..19).map(|i| said["health"][i].as_u64().unwrap()).collect();
    assert!(link[0] > 100 && link[1..] == [0; 5], "{link:?}");
}
