//! Cost of the C interface on the target, beside the plain steps: instructions, stack, flash, RAM.

use std::path::Path;

use anyhow::{Context, Result};

use super::build::Library;
use super::machine::STEP;
use crate::budgets::Row;
use crate::measurement::{Case, SAMPLES, agrees_with_host, case_names, stays_on_paths};
use crate::step_image::{CONTROLLERS, StepImage, build_c_interface};
use crate::toolchain::TARGET;
use crate::wcet::{Bounds, Model};

/// Names of the controllers behind the C interface, as their images and budgets are named.
const SUBJECTS: [&str; 2] = ["c-robust-adaptive", "c-saturated"];
/// Bytes of a controller's memory.
const CONTROLLER_SIZE: usize = gyrfalcon::GYRFALCON_CONTROLLER_SIZE;

/// Measures the step of both controllers through the interface, and the library's size. The images and
/// flights of [`prepare`](crate::measurement::prepare) come first.
pub fn rows() -> Result<Vec<Row>> {
    build_c_interface()?;
    let mut rows = Vec::new();
    for (controller, subject) in CONTROLLERS.into_iter().zip(SUBJECTS) {
        rows.extend(step_rows(controller, subject)?);
    }
    let library = Library::build(TARGET)?;
    let row = |quantity, value| Row { subject: "c-library", quantity, unit: "B", value };
    rows.push(row("flash", library.size()? as f64));
    rows.push(row("ram", CONTROLLER_SIZE as f64));
    Ok(rows)
}

fn step_rows(controller: &str, subject: &'static str) -> Result<[Row; 4]> {
    let image = StepImage::open_at(subject, STEP)?;
    let bounds = Bounds::of(STEP, &image.image, &image.listing).context(STEP)?;
    let stack = image.graph.stack(&image.image)?.bytes;
    let mut cases = Vec::new();
    println!("\n{subject}: instructions of gyrfalcon_step, exact, from the emulator");
    for name in case_names(controller)? {
        let folder = Path::new(SAMPLES).join(controller).join(&name);
        let flight = image.fly(&folder).with_context(|| format!("{subject}, {name}"))?;
        agrees_with_host(&flight, &folder).with_context(|| format!("{subject}, {name}"))?;
        stays_on_paths(&flight, &bounds).with_context(|| format!("{subject}, {name}"))?;
        let case = Case::new(name, &image, &flight);
        let (min, mean, max) = case.instructions;
        println!("{:<28} {:>6} {min:>6} {mean:>8.1} {max:>6}", case.name, case.steps);
        cases.push(case);
    }
    let paper = cases.iter().find(|case| case.name == "paper").context("the paper's flight")?;
    let max = cases.iter().map(|case| case.instructions.2).max().unwrap_or(0);
    let bound = bounds.get(Model::Instructions);
    println!("at most {bound} instructions for any input and either controller");
    let row = |quantity, unit, value| Row { subject, quantity, unit, value };
    Ok([
        row("instructions_mean", "", paper.instructions.1),
        row("instructions_max", "", max as f64),
        row("stack", "B", stack as f64),
        row("wcet_instructions", "", bound as f64),
    ])
}
