//! The program itself: what it prints, what it writes, how it exits.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn directory(name: &str) -> PathBuf {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&directory);
    directory
}

fn sil_host(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sil-host")).args(arguments).output().expect("it starts")
}

fn printed(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

fn complained(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("UTF-8")
}

/// A short flight that holds its guarantees, with what is judged after settling left out.
const SHORT: [&str; 2] = ["--set", "duration=2"];

fn run(name: &str, more: &[&str]) -> Output {
    run_in(&directory(name), more)
}

fn run_in(out: &Path, more: &[&str]) -> Output {
    let out = ["run", "--out", out.to_str().expect("UTF-8")];
    sil_host(&[&out[..], more].concat())
}

#[test]
fn lists_the_built_in_scenarios() {
    let output = sil_host(&["list"]);
    assert!(output.status.success());
    let lines = printed(&output);
    assert!(lines.starts_with("paper-robust-adaptive  Paper's rising circle"), "{lines}");
    assert_eq!(lines.lines().count(), sim::scenario::BUILT_IN.len());
}

#[test]
fn shows_a_scenario_that_runs_as_a_file() {
    let output = sil_host(&["show", "hover-gusts"]);
    assert!(output.status.success());
    let directory = directory("show");
    std::fs::create_dir_all(&directory).expect("created");
    let file = directory.join("mine.toml");
    std::fs::write(&file, output.stdout).expect("written");
    let file = file.to_str().expect("UTF-8");
    let output = run("show-out", &[&[file, "--set", "k9=1"], &SHORT[..]].concat());
    assert_eq!(output.status.code(), Some(2));
    assert!(complained(&output).contains("--set k9=1: k9: unknown field"));
    let output = run("show-out", &[&[file, "--json"], &SHORT[..]].concat());
    assert!(printed(&output).contains("\"name\": \"hover-gusts\""), "{}", complained(&output));
}

#[test]
fn unknown_names_are_wrong_usage() {
    let output = sil_host(&["show", "paper"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        complained(&output)
            .contains("paper: no built-in scenario; did you mean `paper-saturated`?")
    );
    let output = run("unknown", &["paper"]);
    assert_eq!(output.status.code(), Some(2));
    let message = complained(&output);
    assert!(
        message.starts_with("error: paper: ") && message.contains("built-in scenarios: paper-")
    );
    assert_eq!(sil_host(&["no-such-command"]).status.code(), Some(2));
}

#[test]
fn flies_both_paper_scenarios_by_default() {
    let output = run(
        "default",
        &[
            "--set",
            "duration=2",
            "--set",
            "guarantees.settle_time=0",
            "--set",
            "guarantees.position_error_max=100",
        ],
    );
    let table = printed(&output);
    for piece in ["paper-robust-adaptive: ", "paper-saturated: ", "guarantee", "bound", "margin"] {
        assert!(table.contains(piece), "{piece} in {table}");
    }
    assert!(complained(&output).contains("paper-saturated: flew 2 s in "));
}

#[test]
fn json_carries_every_verdict() {
    let output = run("json", &[&["hover-gusts", "--json", "--seed", "3"], &SHORT[..]].concat());
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let scenario = &value["scenarios"][0];
    assert_eq!(scenario["name"], "hover-gusts");
    let verdicts = scenario["verdicts"].as_array().expect("an array");
    assert!(verdicts.len() > 10);
    for verdict in verdicts {
        assert!(verdict["name"].is_string() && verdict["pass"].is_boolean(), "{verdict}");
    }
    let passed = verdicts.iter().all(|verdict| verdict["pass"] == true);
    assert_eq!(scenario["passed"], passed);
    assert_eq!(value["passed"], passed);
    assert_eq!(output.status.code(), Some(if passed { 0 } else { 1 }));
}

#[test]
fn a_flight_that_keeps_its_guarantees_exits_with_zero() {
    let output = run("good", &["hover-gusts", "--quiet", "--set", "duration=25"]);
    assert_eq!(output.status.code(), Some(0), "{}", printed(&output));
    assert_eq!(printed(&output), "");
    assert_eq!(complained(&output), "");
}

#[test]
fn a_violated_guarantee_exits_with_one() {
    let bound = "guarantees.position_error_max=1e-6";
    let output = run("bad", &["hover-gusts", "--quiet", "--set", "duration=25", "--set", bound]);
    assert_eq!(output.status.code(), Some(1));
    let table = printed(&output);
    assert!(table.contains("FAIL") && table.contains("position error"), "{table}");
    assert!(table.contains("a guarantee is VIOLATED"), "{table}");
}

#[test]
fn results_are_written_where_asked() {
    let output = run("results", &["waypoints", "--trace-every", "4", "--set", "duration=2"]);
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("results").join("waypoints");
    let trace = std::fs::read_to_string(directory.join("trace.csv")).expect("a trace");
    assert!(trace.starts_with("tick,time,position_x,"), "{}", complained(&output));
    assert_eq!(trace.lines().count(), 1 + 2_000 / 4);
    let page = std::fs::read_to_string(directory.join("index.html")).expect("a page");
    assert!(page.contains("waypoints") && page.contains("\"name\":\"overview\""));
    assert!(directory.join("overview.svg").is_file());
}

#[test]
fn results_that_cannot_be_written_exit_with_three() {
    let directory = directory("blocked");
    std::fs::write(&directory, "a file where a directory should be").expect("written");
    let output = run_in(&directory, &["hover-gusts", "--set", "duration=1"]);
    assert_eq!(output.status.code(), Some(3), "{}", complained(&output));
    assert!(complained(&output).contains("blocked"), "{}", complained(&output));
}

#[test]
fn pil_says_how_to_get_what_is_missing() {
    let out = directory("pil-missing");
    let pil = |more: &[&str]| {
        sil_host(&[&["pil", "--out", out.to_str().expect("UTF-8")], &SHORT[..], more].concat())
    };
    let output = pil(&["--image", "no-such-image"]);
    assert_eq!(output.status.code(), Some(4));
    let message = complained(&output);
    assert!(
        message.contains("no-such-image: no such image; build it with `cargo build"),
        "{message}"
    );
    let output = pil(&["--image", "Cargo.toml", "--qemu", "no-such-emulator"]);
    assert_eq!(output.status.code(), Some(4));
    let message = complained(&output);
    assert!(message.contains("no-such-emulator") && message.contains("--qemu PATH"), "{message}");
    let output = pil(&["--replay", "Cargo.toml"]);
    assert_eq!(output.status.code(), Some(4));
    assert!(complained(&output).contains("Cargo.toml: line 1 is not"), "{output:?}");
}
