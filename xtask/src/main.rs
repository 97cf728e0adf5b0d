//! `cargo xtask`: the project's checks and measurements, from any folder of the repository.

mod call_graph;
mod disassembly;
mod elf;
mod machine_code;
mod profile;
mod shell;
mod sources;
mod step_image;
mod toolchain;

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};

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
        ["setup"] => toolchain::set_up(),
        ["machine-code"] => machine_code::check_all(),
        ["profile", controller, case] => {
            step_image::build()?;
            shell::run(&mut shell::cargo([
                "run",
                "--release",
                "--quiet",
                "-p",
                "step-samples",
                "--",
                "target/samples",
            ]))?;
            let image = step_image::StepImage::open(controller)?;
            let flight = image.fly(&Path::new("target/samples").join(controller).join(case))?;
            let n = &flight.instructions;
            println!(
                "{controller} {case}: min {} mean {:.1} max {} instructions, {:?}",
                n.iter().min().unwrap(),
                n.iter().sum::<u64>() as f64 / n.len() as f64,
                n.iter().max().unwrap(),
                flight.closing
            );
            profile::print(&image, &flight, 40)
        }
        _ => bail!("usage: cargo xtask ..."),
    }
}
