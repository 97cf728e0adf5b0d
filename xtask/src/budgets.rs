//! `cargo xtask budgets`: measurements against the limits in `budgets.toml`.

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};
use serde::Deserialize;
use toml_edit::DocumentMut;

use crate::cycles::CLOCK;
use crate::elf::Image;
use crate::estimator::{Cost, IMAGE};
use crate::image_stack::WorstCase;
use crate::measurement::{Measurement, prepare};
use crate::step_image::CONTROLLERS;
use crate::{allocation, c_library, filter, firmware, image_stack, mavlink_task, step_image, wcet};

const FILE: &str = "budgets.toml";
/// RAM of the board that `memory.x` gives the linker (B).
const RAM: u64 = 127 * 1024;
/// Steps a second that shares of the period refer to.
const RATE: f64 = 1000.0;

/// The checked-in limits.
#[derive(Deserialize)]
struct Budgets {
    /// Largest headroom of a limit above the measured value, as a part of the limit.
    slack: f64,
    /// Limits by what they limit, then by quantity.
    limits: BTreeMap<String, BTreeMap<String, f64>>,
}

/// One measured quantity.
#[derive(Clone)]
pub struct Row {
    /// Table of the file.
    pub subject: &'static str,
    /// Key in that table.
    pub quantity: &'static str,
    /// Unit, empty for a count.
    pub unit: &'static str,
    /// As measured.
    pub value: f64,
}

/// Measures everything, prints the tables and judges.
pub fn check() -> Result<()> {
    let budgets: Budgets = toml_edit::de::from_str(&read()?).context(FILE)?;
    judge(&budgets, &measure()?)
}

/// Measures everything and moves each limit to a little above what was measured.
pub fn accept() -> Result<()> {
    let mut document: DocumentMut = read()?.parse().context(FILE)?;
    let budgets: Budgets = toml_edit::de::from_str(&document.to_string()).context(FILE)?;
    for Row { subject, quantity, value, .. } in measure()? {
        document["limits"][subject][quantity] = toml_edit::value(limit_for(value, budgets.slack));
    }
    std::fs::write(FILE, document.to_string()).context(FILE)
}

/// Half of the slack above `value`, in whole units.
fn limit_for(value: f64, slack: f64) -> i64 {
    (value * (1.0 + 0.5 * slack)).ceil() as i64
}

fn read() -> Result<String> {
    std::fs::read_to_string(FILE).context(FILE)
}

fn measure() -> Result<Vec<Row>> {
    prepare()?;
    firmware::build()?;
    let mut rows = Vec::new();
    for controller in CONTROLLERS {
        let measurement = Measurement::take(controller)?;
        print_cases(controller, &measurement);
        rows.extend(controller_rows(controller, &measurement));
    }
    rows.extend(estimator_rows()?);
    rows.extend(allocation_rows()?);
    rows.extend(filter_rows()?);
    rows.extend(c_library::cost_rows()?);
    rows.extend(firmware_rows()?);
    let tasks = wcet::task_bounds(&firmware::image("board"))?;
    wcet::report_tasks(&tasks)?;
    rows.extend(wcet::task_rows(&tasks));
    Ok(rows)
}

/// Costs of the estimator; [`prepare`] has built its image.
fn estimator_rows() -> Result<[Row; 7]> {
    let cost = Cost::take()?;
    cost.print();
    let (scalar, of_three) = cost.scalar();
    Ok([
        ("predict_instructions_mean", "", cost.predict.1),
        ("predict_instructions_max", "", cost.predict.2 as f64),
        ("scalar_instructions_max", "", scalar as f64),
        ("vector_instructions_each", "", of_three),
        ("flash", "B", cost.flash as f64),
        ("ram", "B", cost.ram as f64),
        ("stack", "B", cost.stack as f64),
    ]
    .map(|(quantity, unit, value)| Row { subject: IMAGE, quantity, unit, value }))
}

/// Costs of the filters of the body rate; [`prepare`] has built their image.
fn filter_rows() -> Result<[Row; 5]> {
    let cost = filter::Cost::take()?;
    cost.print();
    let (fewest, most) = cost.extremes();
    Ok([
        ("instructions_low_pass", "", fewest as f64),
        ("instructions_all_sections", "", most as f64),
        ("flash", "B", cost.flash as f64),
        ("ram", "B", cost.ram as f64),
        ("stack", "B", cost.stack as f64),
    ]
    .map(|(quantity, unit, value)| Row { subject: filter::IMAGE, quantity, unit, value }))
}

/// Builds the filters' image and prints their costs.
pub fn print_filter() -> Result<()> {
    step_image::build()?;
    filter::Cost::take()?.print();
    Ok(())
}

/// Builds the estimator's image and prints its costs.
pub fn print_estimator() -> Result<()> {
    step_image::build()?;
    Cost::take()?.print();
    Ok(())
}

/// Costs of the allocation; [`prepare`] has built its image.
fn allocation_rows() -> Result<Vec<Row>> {
    let cost = allocation::Cost::take()?;
    cost.print();
    let subject = allocation::IMAGE;
    let row = |(quantity, unit, value)| Row { subject, quantity, unit, value };
    Ok(cost.quantities().into_iter().map(row).collect())
}

/// Builds the allocation's image and prints its costs.
pub fn print_allocation() -> Result<()> {
    step_image::build()?;
    allocation::Cost::take()?.print();
    Ok(())
}

/// Builds the firmware's images and prints their sizes and the worst-case stack of each task.
pub fn print_firmware() -> Result<()> {
    firmware::build()?;
    for Row { subject, quantity, unit, value } in firmware_rows()? {
        println!("{subject:<18} {quantity:<12} {value:>8} {unit}");
    }
    Ok(())
}

/// Sizes of the image for a board; that for the emulator has more in it.
fn firmware_rows() -> Result<Vec<Row>> {
    let path = firmware::image("board");
    let image = Image::read(&path)?;
    println!("\nfirmware-board: worst-case stack, each handler on top of the ones before");
    let WorstCase { all: stack, without } = image_stack::worst_case(&path, &mavlink_task::OWN)?;
    let painted = firmware::painted_stack()?;
    println!("  {stack:>6} B in all; {painted} B seen in painted memory of the emulated image");
    ensure!(painted <= stack, "painted memory shows more stack than the call graph");
    let used = stack + image.static_ram;
    ensure!(used <= RAM, "stack and static RAM take {used} B of {RAM} B");
    let mavlink = mavlink_task::Cost::take(&path)?;
    let rows = [
        ("firmware-board", "flash", image.flash),
        ("firmware-board", "static_ram", image.static_ram),
        ("firmware-board", "stack", stack),
        ("firmware-core", "flash", mavlink.core),
        ("firmware-core", "stack", without),
        ("firmware-mavlink", "flash", mavlink.flash),
        ("firmware-mavlink", "ram", mavlink.ram),
        ("firmware-mavlink", "stack", mavlink.stack),
    ];
    let row =
        |(subject, quantity, value)| Row { subject, quantity, unit: "B", value: value as f64 };
    Ok(rows.map(row).to_vec())
}

fn print_cases(controller: &str, measurement: &Measurement) {
    println!("\n{controller}: instructions a control step, exact, from the emulator");
    println!(
        "{:<28} {:>6} {:>6} {:>8} {:>6} {:>9}",
        "flight", "steps", "min", "mean", "max", "cycles~"
    );
    for case in &measurement.cases {
        let (min, mean, max) = case.instructions;
        let (name, steps, cycles) = (&case.name, case.steps, case.cycles);
        println!("{name:<28} {steps:>6} {min:>6} {mean:>8.1} {max:>6} {cycles:>9.0}");
    }
    let slowest = measurement.cases.iter().map(|case| case.cycles).fold(0.0, f64::max);
    let share = 100.0 * slowest * RATE / CLOCK;
    println!("slowest flight: about {share:.1} % of a period of 1 ms at 168 MHz");
    let Measurement { stack, painted_stack, .. } = measurement;
    println!("stack: {stack} B from the call graph, {painted_stack} B seen in painted memory");
}

/// Means are those of the paper's scenario, maxima those of all flights.
fn controller_rows(subject: &'static str, measurement: &Measurement) -> Vec<Row> {
    let Measurement { cases, flash_step, flash, ram, stack, wcet_instructions, .. } = measurement;
    let [wcet_cycles, wcet_cycles_miss] = measurement.wcet_cycles;
    let paper = cases.iter().find(|case| case.name == "paper").unwrap_or(&cases[0]);
    let max = cases.iter().map(|case| case.instructions.2).max().unwrap_or(0);
    // The slowest step is taken to have the paper's mix of instructions.
    let cycles_max = paper.cycles / paper.instructions.1 * max as f64;
    [
        ("instructions_mean", "", paper.instructions.1),
        ("instructions_max", "", max as f64),
        ("cycles_max_estimate", "", cycles_max),
        ("flash_step", "B", *flash_step as f64),
        ("flash", "B", *flash as f64),
        ("ram", "B", *ram as f64),
        ("stack", "B", *stack as f64),
        ("wcet_instructions", "", *wcet_instructions as f64),
        ("wcet_cycles", "", wcet_cycles as f64),
        ("wcet_cycles_flash_miss", "", wcet_cycles_miss as f64),
    ]
    .map(|(quantity, unit, value)| Row { subject, quantity, unit, value })
    .into()
}

fn judge(budgets: &Budgets, rows: &[Row]) -> Result<()> {
    println!(
        "\n{:<18} {:<24} {:>10} {:>10} {:>7}  verdict",
        "subject", "quantity", "measured", "limit", "slack"
    );
    let mut bad = 0;
    for Row { subject, quantity, unit, value } in rows {
        let limit = budgets.limits.get(*subject).and_then(|limits| limits.get(*quantity));
        let slack = limit.map(|limit| (limit - value) / limit);
        let verdict = match slack {
            None => "NO LIMIT in budgets.toml",
            Some(slack) if slack < 0.0 => "EXCEEDED",
            Some(slack) if slack > budgets.slack => "SLACK: lower the limit",
            Some(_) => "ok",
        };
        bad += usize::from(verdict != "ok");
        let limit = limit.map_or("-".into(), |limit| format!("{limit}"));
        let slack = slack.map_or("-".into(), |slack| format!("{:.1} %", 100.0 * slack));
        let value = format!("{value:.1}").replace(".0", "");
        let name = format!("{quantity}{}{unit}", if unit.is_empty() { "" } else { " " });
        println!("{subject:<18} {name:<24} {value:>10} {limit:>10} {slack:>7}  {verdict}");
    }
    let known: usize = budgets.limits.values().map(BTreeMap::len).sum();
    ensure!(
        bad == 0,
        "{bad} of {} quantities are not within {FILE}; `cargo xtask budgets --accept` moves the \
         limits to what is measured, once the reason is known to be good",
        rows.len()
    );
    ensure!(known == rows.len(), "{FILE} has {known} limits for {} quantities", rows.len());
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::{Budgets, Row, judge, limit_for};

    fn verdict(value: f64) -> bool {
        let limits = BTreeMap::from([("step".into(), BTreeMap::from([("stack".into(), 100.0)]))]);
        let row = Row { subject: "step", quantity: "stack", unit: "B", value };
        judge(&Budgets { slack: 0.05, limits }, &[row]).is_ok()
    }

    #[test]
    fn more_than_the_limit_and_far_less_fail() {
        assert!(verdict(100.0) && verdict(95.0));
        assert!(!verdict(100.1) && !verdict(94.9));
    }

    #[test]
    fn an_unmeasured_limit_fails() {
        let limits = BTreeMap::from([("step".into(), BTreeMap::from([("stack".into(), 1.0)]))]);
        assert!(judge(&Budgets { slack: 0.05, limits }, &[]).is_err());
    }

    #[test]
    fn accepted_limits_leave_half_of_the_slack() {
        assert_eq!(limit_for(1000.0, 0.05), 1025);
        assert_eq!(limit_for(1001.0, 0.05), 1027);
    }
}
