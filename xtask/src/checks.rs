//! `cargo xtask ci` and `cargo xtask test`: every check in order, timed.

use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Result, ensure};

use crate::shell::{cargo, run};
use crate::toolchain::{TARGET, set_up};
use crate::{budgets, c_library, doc_comments, firmware, fuzz, machine_code, wcet, wheel};

/// One thing that must succeed.
pub struct Check {
    name: &'static str,
    run: fn() -> Result<()>,
}

/// Everything; sets up what is missing first.
pub const ALL: &[Check] = &[
    SET_UP,
    FORMAT,
    LINT_HOST,
    check("clippy, target", lint_target),
    check("documentation", documentation),
    check("words of doc comments", doc_comments::check),
    check("firmware images", firmware::build),
    check("tests, both tiers", all_tests),
    check("the paper's flights", paper_flights),
    check("Python package", wheel::check),
    check("flights in RotorPy", wheel::rotorpy),
    check("host instructions", host_instructions),
    check("core for the target", core_for_target),
    check("fuzz targets", fuzz::check),
    check("the paper's flights, image", flights_on_image),
    check("machine code of the steps", machine_code::check_all),
    check("C library", c_library::check),
    check("worst-case timing", wcet::check),
    check("budgets", budgets::check),
];

/// The checks while working.
pub const EVERYDAY: &[Check] = &[
    SET_UP,
    FORMAT,
    LINT_HOST,
    check("words of doc comments", doc_comments::check),
    check("tests, first tier", first_tier),
];

const SET_UP: Check = check("set-up", set_up);
const FORMAT: Check = check("format", format);
const LINT_HOST: Check = check("clippy, host", lint_host);

/// Cargo features of the tests that need more than Rust.
const SECOND_TIER: &str = "sil-host/tool-tests,sil-host/emulator-tests,system-tests/emulator-tests,system-tests/tool-tests";

const fn check(name: &'static str, run: fn() -> Result<()>) -> Check {
    Check { name, run }
}

/// Runs `checks`, prints how long each took, and fails if any failed; nothing goes on without set-up.
pub fn run_all(checks: &[Check]) -> Result<()> {
    let (mut times, mut failed) = (Vec::new(), Vec::new());
    for check in checks {
        println!("\n== {}", check.name);
        let start = Instant::now();
        let result = (check.run)();
        times.push((check.name, start.elapsed(), result.is_ok()));
        if let Err(error) = result {
            println!("== {} FAILED: {error:#}", check.name);
            failed.push(check.name);
            if check.name == SET_UP.name {
                break;
            }
        }
    }
    print_times(&times);
    ensure!(failed.is_empty(), "failed: {}", failed.join(", "));
    Ok(())
}

fn print_times(times: &[(&str, Duration, bool)]) {
    println!("\n{:<28} {:>8}", "step", "seconds");
    for (name, time, good) in times {
        let verdict = if *good { "" } else { "  FAILED" };
        println!("{name:<28} {:>8.1}{verdict}", time.as_secs_f64());
    }
    let total: Duration = times.iter().map(|(_, time, _)| time).sum();
    println!("{:<28} {:>8.1}", "total", total.as_secs_f64());
}

fn format() -> Result<()> {
    run(&mut cargo(["fmt", "--all", "--check"]))
}

/// All members but those that build for the target only, with everything that is optional.
fn on_host(arguments: &[&'static str]) -> Command {
    let mut command = cargo(arguments.iter().copied());
    command.args(["--workspace", "--exclude", "step-image", "--features", "sil-host/full"]);
    command
}

fn lint_host() -> Result<()> {
    let mut lint = on_host(&["clippy"]);
    run(lint.args(["--features", SECOND_TIER, "--all-targets", "--", "-D", "warnings"]))
}

fn lint_target() -> Result<()> {
    let lint = |arguments: &[&str]| {
        let start = ["clippy", "--release", "--target", TARGET];
        let all = start.iter().chain(arguments).chain(&["--", "-D", "warnings"]);
        run(&mut cargo(all.copied()))
    };
    lint(&["-p", "ctrl-core"])?;
    lint(&["-p", "ctrl-c"])?;
    lint(&["-p", "step-image", "--features", "c-interface"])?;
    lint(&["-p", "mavlink-vehicle"])?;
    for variant in firmware::VARIANTS {
        lint(&["-p", "firmware", "--features", variant])?;
    }
    Ok(())
}

fn documentation() -> Result<()> {
    let mut command = on_host(&["doc"]);
    run(command.args(["--no-deps", "--quiet"]).env("RUSTDOCFLAGS", "-D warnings"))
}

/// Tests of the host crates, which need nothing but Rust: what a plain `cargo test` runs.
fn first_tier() -> Result<()> {
    run(&mut cargo(["test"]))
}

/// The first tier, the firmware's tests, and those that need QEMU, a browser or Python.
fn all_tests() -> Result<()> {
    // All of them, so that one run tells everything that fails.
    run(on_host(&["test", "--no-fail-fast"]).args(["--features", SECOND_TIER]))
}

fn core_for_target() -> Result<()> {
    run(&mut cargo(["build", "--release", "-p", "ctrl-core", "--target", TARGET]))
}

/// The main job, as the README shows it: every guarantee of both flights must hold.
fn paper_flights() -> Result<()> {
    let job =
        ["run", "--release", "-p", "sil-host", "--", "run", "--quiet", "--out", "target/flights"];
    run(&mut cargo(job))
}

/// The same flights with the firmware's image in the controller's place: every bit as in SIL.
fn flights_on_image() -> Result<()> {
    let job = ["run", "--release", "-p", "sil-host", "--", "pil", "--quiet", "--out", "target/pil"];
    run(cargo(job).arg("--image").arg(firmware::image("emulator")))
}

/// Instructions a step and a control tick on the host, against `sil-host/benches/instructions.toml`.
fn host_instructions() -> Result<()> {
    run(&mut cargo(["bench", "-p", "sil-host", "--bench", "instructions"]))
}
