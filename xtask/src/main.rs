//! `cargo xtask`: the project's checks and measurements, from any folder of the repository.

mod allocation;
mod budgets;
mod c_library;
mod call_graph;
mod checks;
mod cycles;
mod disassembly;
mod doc_comments;
mod elf;
mod estimator;
mod filter;
mod firmware;
mod flash_share;
mod frames;
mod fuzz;
mod image_stack;
mod machine_code;
mod mavlink_task;
mod measurement;
mod peers;
mod preemption;
mod profile;
mod python;
mod shell;
mod sources;
mod step_image;
mod toolchain;
mod wcet;
mod wheel;

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};

const USAGE: &str = "usage: cargo xtask COMMAND
  ci            set up what is missing and check everything
  test          the everyday checks: format, clippy, tests that need nothing but Rust
  setup         install the toolchain's parts, the emulator and the tests' Python packages
  fuzz          a short run of each fuzz target
  machine-code  required and forbidden instructions in the control steps' machine code
  python        the Python package: its wheel built, installed, tested and type-checked
  rotorpy       flights in RotorPy's plant against what is recorded; after `python`
  wcet          upper bounds on the instructions and cycles of the control steps and of every task of the
                firmware, and the tasks' response times against their deadlines
  budgets [--accept]
                instructions, cycles, memory and stack against budgets.toml; --accept moves its
                limits to what was measured
  estimator     instructions, memory and stack of the estimator alone
  allocation    instructions, memory and stack of the allocation alone
  filter        instructions, memory and stack of the filters of the body rate
  c-library [header | cost | install PREFIX [TARGET]]
                build the C library and check it, from the header to tests in C; `header` generates the
                header anew, `cost` measures the step through it, `install` builds for TARGET (this
                machine's unless given) and installs
  firmware      flash, static RAM and worst-case stack of the firmware's image alone
  peers [--crazyflie FOLDER] [--flightlib FOLDER]
                our steps beside those of others, from their sources in FOLDER: see docs/peers.md
  profile CONTROLLER [FLIGHT [ROWS]]
                instructions of a step by function; CONTROLLER is robust-adaptive or saturated,
                FLIGHT one of those that `budgets` lists (the paper's unless given)";

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let causes: Vec<_> = error.chain().map(ToString::to_string).collect();
            eprintln!("error: {}", causes.join(": "));
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().context("workspace root")?;
    std::env::set_current_dir(root)?;
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let words: Vec<_> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["ci"] => checks::run_all(checks::ALL),
        ["test"] => checks::run_all(checks::EVERYDAY),
        ["setup"] => toolchain::set_up(),
        ["fuzz"] => fuzz::check(),
        ["machine-code"] => machine_code::check_all(),
        ["python"] => wheel::check(),
        ["rotorpy"] => wheel::rotorpy(),
        ["wcet"] => wcet::check(),
        ["budgets"] => budgets::check(),
        ["budgets", "--accept"] => budgets::accept(),
        ["estimator"] => budgets::print_estimator(),
        ["allocation"] => budgets::print_allocation(),
        ["filter"] => budgets::print_filter(),
        ["firmware"] => budgets::print_firmware(),
        ["c-library"] => c_library::check(),
        ["c-library", "cost"] => c_library::print_cost(),
        ["c-library", "header"] => c_library::write_header(),
        ["c-library", "install", prefix] => c_library::install(prefix, None),
        ["c-library", "install", prefix, target] => c_library::install(prefix, Some(target)),
        ["peers", ref options @ ..] => peers::compare(options),
        ["profile", controller] => profile::run(controller, "paper", 40),
        ["profile", controller, flight] => profile::run(controller, flight, 40),
        ["profile", controller, flight, rows] => {
            profile::run(controller, flight, rows.parse().context("ROWS")?)
        }
        _ => bail!("{USAGE}"),
    }
}
