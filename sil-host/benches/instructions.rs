//! Host instructions a step, which do not drift with the machine's load as wall times do:
//! `cargo bench -p sil-host --bench instructions`. Needs valgrind, and objdump of binutils.
//!
//! The program runs itself under callgrind twice, with some and with more steps; the difference
//! leaves out start and set-up. More than the limit in `instructions.toml` is a failure, and so is
//! a limit more than 10 % above what is counted: then lower it.
//!
//! What counts cannot show is looked for in the code: a square root in the legacy encoding amid AVX code
//! takes some 140 cycles instead of 20. A watched flight once spent more than half its time there.

use std::io;
use std::path::Path;
use std::process::{Command, ExitCode};

use ctrl_core::controller::ControllerConfig;
use ctrl_core::controller::TrackingController;
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::saturated::Saturated;
use ctrl_core::trajectory::Trajectory;
use ctrl_core::vehicle::Wrench;
use glam::Vec3;
use rayon::prelude::*;
use sil_host::campaign::{Campaign, CampaignOverrides, RunOutcome, fly_run};
use sil_host::results::FlightResults;
use sim::guarantee::Guarantees;
use sim::observer::Observer;
use sim::plant::rigid_body::RigidBody;
use sim::plant::{Disturbance, PlantParameters};
use sim::scenario::LoadedScenario;
use toml_edit::{Document, Item};

const LIMITS: &str = include_str!("instructions.toml");
const FEW: u64 = 1_000;
const MANY: u64 = 6_000;
/// A limit may be this much above the count.
const SLACK: f64 = 1.1;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    if let [_, work, name, steps] = &arguments[..] {
        do_work(work, name, steps.parse().expect("a number of steps"));
        return ExitCode::SUCCESS;
    }
    if !arguments.iter().any(|argument| argument == "--bench") {
        return ExitCode::SUCCESS; // run by `cargo test --all-targets`
    }
    // Words but Cargo's own choose works; none, all.
    let chosen: Vec<_> = arguments.iter().skip(1).filter(|word| !word.starts_with("--")).collect();
    let limits = Document::parse(LIMITS).expect("instructions.toml is TOML");
    let limit_of = |item: &Item| item.as_integer().expect("an integer") as f64;
    let mut cases = Vec::new();
    for (work, scenarios) in limits.as_table() {
        let scenarios = scenarios.as_table_like().expect("a table").iter();
        cases.extend(scenarios.map(|(name, limit)| (work, name, limit_of(limit))));
    }
    cases.retain(|(work, ..)| chosen.is_empty() || chosen.iter().any(|chosen| chosen == work));
    // Counts do not depend on what else the machine does.
    let count = |(work, name, _): &(&str, &str, f64)| instructions_a_step(work, name);
    let counts: Vec<_> = cases.par_iter().map(count).collect();
    let mut good = has_no_legacy_root();
    for ((work, name, limit), count) in cases.into_iter().zip(counts) {
        let result = match count {
            _ if count > limit => "FAIL: above the limit",
            _ if count * SLACK < limit => "FAIL: lower the limit",
            _ => "pass",
        };
        good &= result == "pass";
        println!("{work:<9} {name:<22} {count:>8.1} instructions, limit {limit:>5}: {result}");
    }
    if good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// `true` if a build for AVX takes every square root in AVX's encoding.
fn has_no_legacy_root() -> bool {
    if cfg!(not(all(target_arch = "x86_64", target_feature = "avx"))) {
        return true;
    }
    let program = std::env::current_exe().expect("this program has a path");
    let output = Command::new("objdump")
        .args(["--disassemble", "--no-show-raw-insn"])
        .arg(program)
        .output()
        .expect("binutils are installed");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let code = String::from_utf8_lossy(&output.stdout);
    let count = |instruction: &str| code.matches(&format!("\t{instruction} ")).count();
    let legacy = count("sqrtss") + count("sqrtsd");
    assert!(count("vsqrtsd") > 0, "objdump writes instructions as expected");
    println!("{legacy} square roots in the legacy encoding, none allowed");
    legacy == 0
}

fn instructions_a_step(work: &str, name: &str) -> f64 {
    let count = |steps| instructions(work, name, steps) as f64;
    (count(MANY) - count(FEW)) / (MANY - FEW) as f64
}

/// Instructions of this program doing `steps` steps.
fn instructions(work: &str, name: &str, steps: u64) -> u64 {
    let program = std::env::current_exe().expect("this program has a path");
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(program)
        .args([work, name, &steps.to_string()])
        .output()
        .expect("valgrind is installed");
    let report = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{report}");
    let total = report.split("Collected :").nth(1).expect("callgrind reports a total");
    total.split_whitespace().next().and_then(|total| total.parse().ok()).expect("a number")
}

fn do_work(work: &str, name: &str, steps: u64) {
    let scenario = LoadedScenario::open(name, &[]).expect("a built-in scenario is valid");
    match (work, &scenario.scenario().controller) {
        ("flight", _) => {
            let mut flight = scenario.flight().expect("valid");
            flight.advance(steps);
            std::hint::black_box(flight.truth());
        }
        ("plant", _) => plant(&scenario, steps),
        ("campaign", _) => fly_campaign(name, steps, scenario.scenario().controller.step_period()),
        ("watched", _) => {
            let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("instructions").join(name);
            fly_watched(&scenario, steps, &directory).expect("results can be written");
        }
        ("step", ControllerConfig::RobustAdaptive(config)) => {
            step(&RobustAdaptive::new(config).expect("valid"), &scenario, steps);
        }
        ("step", ControllerConfig::Saturated(config)) => {
            step(&Saturated::new(config).expect("valid"), &scenario, steps);
        }
        _ => panic!("no work called {work}"),
    }
}

/// A run of a campaign, with its monitors and measures, and the guarantees due from the first tick on.
fn fly_campaign(name: &str, ticks: u64, step_period: f32) {
    let duration = ticks as f64 * f64::from(step_period);
    let definition = format!(
        "name = 'one'\ndescription = ''\nsampling = 'monte_carlo'\nruns = 1\nscenario = '{name}'\n\
         set = ['duration={duration}', 'guarantees.settle_time=0.0']"
    );
    let unchanged = CampaignOverrides::default();
    let campaign = Campaign::parse("one.toml", &definition, Path::new(""), &unchanged, &[]);
    let run = fly_run(&campaign.expect("a valid campaign"), 0);
    assert!(run.flight_time > 0.0 && run.rows[0].outcome != RunOutcome::Refused);
}

fn fly(scenario: &LoadedScenario, ticks: u64, observer: &mut impl Observer) {
    let mut flight = scenario.flight().expect("valid");
    flight.observe_in_blocks(ticks, observer);
    std::hint::black_box(flight.truth());
}

/// As `run`, up to figures and page. The trace is waited for: its thread counts, too.
fn fly_watched(scenario: &LoadedScenario, ticks: u64, directory: &Path) -> io::Result<()> {
    let results = FlightResults::create(directory, scenario.scenario(), 1)?;
    let mut observers = (monitors(scenario), results);
    fly(scenario, ticks, &mut observers);
    let rows = observers.1.finish_trace()?;
    assert_eq!(rows, ticks);
    Ok(())
}

/// The monitors, with the guarantees due from the first tick on, as they are for most of a flight.
fn monitors(scenario: &LoadedScenario) -> Guarantees {
    let mut scenario = scenario.scenario().clone();
    scenario.guarantees.settle_time = 0.0;
    scenario.monitors()
}

/// The rigid body alone, falling from the scenario's start under a held wrench and no disturbance.
fn plant(scenario: &LoadedScenario, steps: u64) {
    let scenario = scenario.scenario();
    let period = f64::from(scenario.controller.step_period());
    let parameters = PlantParameters::from(scenario.vehicle);
    let body = RigidBody::new(&parameters, period, scenario.plant_steps_per_tick);
    let mut state = scenario.initial.state();
    let wrench = Wrench { thrust: 1.0, torque_body: Vec3::splat(1e-4) };
    let undisturbed = Disturbance::default();
    for _ in 0..steps {
        let (wrench, held) = std::hint::black_box((&wrench, &undisturbed));
        state = std::hint::black_box(body.advance(&state, wrench, held));
    }
}

/// The law alone, at a standing vehicle beside the trajectory.
fn step<C: TrackingController>(controller: &C, scenario: &LoadedScenario, steps: u64) {
    let scenario = scenario.scenario();
    let trajectory = scenario.trajectory.build(controller.step_period()).expect("valid");
    let (vehicle, reference) = (scenario.initial.state().measured(), trajectory.reference(0));
    let mut state = controller.initial_state();
    for _ in 0..steps {
        let (vehicle, reference) = std::hint::black_box((&vehicle, &reference));
        std::hint::black_box(controller.step(&mut state, vehicle, reference));
    }
}
