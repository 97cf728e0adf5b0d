//! Where the instructions of a step go: by source line and by (inlined) function.

use std::collections::BTreeMap;
use std::path::Path;

use addr2line::Loader;
use anyhow::{Result, anyhow};

use crate::step_image::{Flight, StepImage};

/// Instructions a step, by name.
type Shares = BTreeMap<String, f64>;

/// Prints the `top` largest shares of `flight`, most expensive first.
pub fn print(image: &StepImage, flight: &Flight, top: usize) -> Result<()> {
    let loader = Loader::new(&image.path).map_err(|error| anyhow!("debug information: {error}"))?;
    let steps = flight.instructions.len() as f64;
    let [mut lines, mut functions, mut inclusive, mut mix] = [const { Shares::new() }; 4];
    for (address, executed) in &flight.executed {
        let share = *executed as f64 / steps;
        let frames = frames(&loader, *address)?;
        if let Some((function, line)) = frames.first() {
            *lines.entry(format!("{line}  {function}")).or_default() += share;
            *functions.entry(function.clone()).or_default() += share;
        }
        let mut names: Vec<_> = frames.into_iter().map(|(function, _)| function).collect();
        names.sort_unstable();
        names.dedup();
        for name in names {
            *inclusive.entry(name).or_default() += share;
        }
        if let Some(instruction) = image.listing.get(address) {
            *mix.entry(instruction.name().to_owned()).or_default() += share;
        }
    }
    show("instructions a step, by source line", &lines, top);
    show("by function, itself only", &functions, top);
    show("by function, with what it calls (inlined or not)", &inclusive, top);
    show("by machine instruction", &mix, top);
    Ok(())
}

/// The functions that `address` was inlined from, innermost first, each with its source line.
fn frames(loader: &Loader, address: u64) -> Result<Vec<(String, String)>> {
    let mut found = Vec::new();
    let mut frames =
        loader.find_frames(address).map_err(|error| anyhow!("debug information: {error}"))?;
    while let Some(frame) = frames.next().map_err(|error| anyhow!("debug information: {error}"))? {
        let function = frame.function.as_ref().and_then(|name| name.raw_name().ok());
        let function =
            function.map_or("?".into(), |name| format!("{:#}", rustc_demangle::demangle(&name)));
        let line = frame.location.map_or("?".into(), |location| {
            let file = location.file.unwrap_or("?");
            format!("{}:{}", short(file), location.line.unwrap_or(0))
        });
        found.push((function, line));
    }
    Ok(found)
}

/// The last three parts of a path.
fn short(file: &str) -> String {
    let parts: Vec<_> = Path::new(file).iter().map(|part| part.to_string_lossy()).collect();
    parts[parts.len().saturating_sub(3)..].join("/")
}

fn show(title: &str, shares: &Shares, top: usize) {
    let total: f64 = shares.values().sum();
    let mut rows: Vec<_> = shares.iter().collect();
    rows.sort_by(|a, b| b.1.total_cmp(a.1));
    println!("\n{title} ({total:.1} in {} rows)", rows.len());
    for (name, share) in rows.into_iter().take(top) {
        println!("{share:9.2} {:5.1} %  {name}", 100.0 * share / total);
    }
}
