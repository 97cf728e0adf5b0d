//! Instructions of a step by source line and by (inlined) function.

use std::collections::{BTreeMap, BTreeSet};

use std::path::Path;

use anyhow::{Result, ensure};

use crate::measurement::{Case, SAMPLES, case_names, prepare};
use crate::sources::{Frame, Sources};
use crate::step_image::{CONTROLLERS, Flight, StepImage};

/// Instructions a step, by name.
type Shares = BTreeMap<String, f64>;

/// Measures one flight and prints the `top` largest shares of everything.
pub fn run(controller: &str, case: &str, top: usize) -> Result<()> {
    ensure!(CONTROLLERS.contains(&controller), "controllers: {}", CONTROLLERS.join(", "));
    prepare()?;
    let cases = case_names(controller)?;
    ensure!(cases.iter().any(|name| name == case), "flights: {}", cases.join(", "));
    let image = StepImage::open(controller)?;
    let flight = image.fly(&Path::new(SAMPLES).join(controller).join(case))?;
    let Case { steps, instructions: (min, mean, max), cycles, .. } =
        Case::new(case.to_owned(), &image, &flight);
    println!(
        "{controller}, {case}, {steps} steps: instructions min {min} mean {mean:.1} max {max}"
    );
    println!("about {cycles:.0} cycles; {} B of stack", flight.closing.stack);
    print(&image, &flight, top)
}

/// Prints the `top` largest shares of `flight`, most expensive first.
fn print(image: &StepImage, flight: &Flight, top: usize) -> Result<()> {
    let sources = Sources::open(&image.path)?;
    let steps = flight.instructions.len() as f64;
    let [mut lines, mut functions, mut inclusive, mut mix] = [const { Shares::new() }; 4];
    for (address, executed) in &flight.executed {
        let share = *executed as f64 / steps;
        let frames = sources.frames(*address)?;
        if let Some(own @ Frame { function, .. }) = Frame::own(&frames) {
            *lines.entry(own.to_string()).or_default() += share;
            *functions.entry(function.clone()).or_default() += share;
        }
        let names: BTreeSet<_> = frames.into_iter().map(|frame| frame.function).collect();
        for name in names {
            *inclusive.entry(name).or_default() += share;
        }
        if let Some(instruction) = image.listing.get(address) {
            *mix.entry(instruction.name().to_owned()).or_default() += share;
        }
    }
    let total = lines.values().sum();
    show("instructions a step, by source line", &lines, total, top);
    show("by function, itself only", &functions, total, top);
    show("by function, with what was inlined into it", &inclusive, total, top);
    show("by machine instruction", &mix, total, top);
    Ok(())
}

fn show(title: &str, shares: &Shares, total: f64, top: usize) {
    let mut rows: Vec<_> = shares.iter().collect();
    rows.sort_by(|a, b| b.1.total_cmp(a.1));
    println!("\n{title} ({total:.1} in {} rows)", rows.len());
    for (name, share) in rows.into_iter().take(top) {
        println!("{share:9.2} {:5.1} %  {name}", 100.0 * share / total);
    }
}
