//! Bounds of tasks and loops against counts in the emulator.
//!
//! The emulator's variant of the image is analysed like the board's: the same sources with another driver of
//! the link. Flights of the processor in the loop then run under QEMU's counting plugin. A task that took more than
//! its bound, or a loop that went round more often than its annotation says, fails.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use super::analysis::Analysis;
use super::instruction::Flow;
use super::limit::Limits;
use super::path::Limit;
use super::tasks::{CONSTANTS, GROUND_ONLY, Task};
use super::timing::Model;
use crate::disassembly::disassemble;
use crate::elf::Image;
use crate::firmware;
use crate::shell::{cargo, run};

const FOLDER: &str = "target/wcet";
/// Code that only the emulator's variant has, by parts of the functions' names.
const EMULATOR: &[&str] =
    &["board::emulator::", "emulator::Emulator as", "semihosting", "_defmt_", "defmt::export::"];
/// Flights: a scenario with its options.
const FLIGHTS: &[&[&str]] = &[
    &["paper-robust-adaptive", "--set", "duration=1"],
    &["paper-saturated", "--set", "duration=1"],
    &["tilt-recovery", "--lock-step", "--set", "duration=1"],
    &["waypoints", "--set", "duration=1"],
    &["sensors-wind", "--set", "duration=1"],
    &[
        "paper-saturated",
        "--set",
        "duration=1",
        "--compare",
        "false",
        "--fault",
        "garbage,truncated",
    ],
];

/// The flight of them in which everything is on: estimator, integral action, every sensor.
const EVERYTHING_ON: &str = "sensors-wind";
/// Most instructions of a tick in that flight, of all tasks, on average.
const EVERYTHING_MOST: f64 = 20_000.0;

/// Largest counts of one task.
pub struct Counted {
    /// Name of the task.
    pub name: String,
    /// Most instructions of a release.
    pub most: u64,
    /// Bound in the same image.
    pub bound: u64,
    /// Releases.
    pub releases: u64,
}

/// Flies the emulator's image and compares; the tasks but `receive`, whose driver is another one there.
pub fn compare(tasks: &[Task]) -> Result<Vec<Counted>> {
    let path = firmware::image("emulator");
    let (image, listing) = (Image::read(&path)?, disassemble(&path)?);
    let limits = Limits::open(&path, CONSTANTS.to_vec())?;
    let excluded: Vec<_> =
        GROUND_ONLY.iter().map(|(part, _)| *part).chain(EMULATOR.iter().copied()).collect();
    let mut analysis = Analysis::new(&image, &listing, &limits, &excluded);
    let tasks: Vec<_> = tasks.iter().filter(|task| !task.name.starts_with("receive")).collect();
    let mut bounds = BTreeMap::new();
    for task in &tasks {
        let start = image.named(&task.handler)?.range.start;
        let cost = analysis.cost(start);
        let cost = cost.with_context(|| format!("task `{}` of the emulator's image", task.name))?;
        bounds.insert(start, (task.name.clone(), cost.total(Model::Instructions)));
    }
    let description = describe(&analysis, &image, &bounds)?;
    let (mut most, mut releases) = (BTreeMap::new(), BTreeMap::new());
    let mut rounds: BTreeMap<u64, u64> = BTreeMap::new();
    for flight in FLIGHTS {
        let lines = fly(&description, &path, flight)?;
        if flight[0] == EVERYTHING_ON {
            judge_tick(&lines, &bounds)?;
        }
        for Line { kind, address, most: count, calls, .. } in lines {
            let counts = if kind == "task" { &mut most } else { &mut rounds };
            let seen: &mut u64 = counts.entry(address).or_default();
            *seen = (*seen).max(count);
            *releases.entry(address).or_insert(0) += calls;
        }
    }
    judge_loops(&analysis, &rounds)?;
    let counted = bounds.into_iter().map(|(start, (name, bound))| {
        let (most, releases) =
            (most.get(&start).copied().unwrap_or(0), releases.get(&start).copied().unwrap_or(0));
        Counted { name, most, bound, releases }
    });
    let mut counted: Vec<_> = counted.collect();
    counted.sort_by_key(|counted| tasks.iter().position(|task| task.name == counted.name));
    for Counted { name, most, bound, releases } in &counted {
        println!("{name:<14} {most:>8} counted at most in {releases} releases, bound {bound}");
        ensure!(*releases > 0, "task `{name}` was not released in the emulator");
        ensure!(most <= bound, "task `{name}` took {most} instructions, more than {bound}");
    }
    Ok(counted)
}

/// Description of tasks, loops and code for the plugin.
fn describe(
    analysis: &Analysis,
    image: &Image,
    bounds: &BTreeMap<u64, (String, u64)>,
) -> Result<PathBuf> {
    let mut text = String::new();
    for start in bounds.keys() {
        let known = analysis.known(*start).context("a bounded task")?;
        let ends = known
            .graph
            .nodes
            .iter()
            .filter(|(_, node)| node.decoded.flow == Flow::Return && !node.conditional);
        let ends: Vec<_> = ends.map(|(address, _)| format!("{address:#x}")).collect();
        writeln!(text, "task {start:#x} {}", ends.join(" "))?;
    }
    let mut headers = std::collections::BTreeSet::new();
    for found in analysis.loops.iter().filter(|found| headers.insert(found.header)) {
        let from = analysis.entries(found).into_iter().map(|from| format!("{from:#x}"));
        let from: Vec<_> = from.collect();
        let kind = if let Limit::InAll(_) = found.found.limit { "total" } else { "loop" };
        writeln!(text, "{kind} {:#x} {}", found.header, from.join(" "))?;
        for start in analysis.scope(found.header) {
            writeln!(text, "over {start:#x}")?;
        }
    }
    for (call, back) in analysis.excluded_calls()? {
        writeln!(text, "apart {call:#x} {back:#x}")?;
    }
    for start in analysis.analysed() {
        let range = &image.containing(start).context("a function")?.range;
        writeln!(text, "range {:#x} {:#x}", range.start, range.end)?;
    }
    std::fs::create_dir_all(FOLDER)?;
    let path = std::path::absolute(Path::new(FOLDER).join("tasks.txt"))?;
    std::fs::write(&path, text)?;
    Ok(path)
}

/// A line of the plugin: a task, or a loop, which has no calls and no sum.
struct Line {
    kind: String,
    address: u64,
    most: u64,
    calls: u64,
    all: u64,
}

/// Judges the mean of all tasks' instructions over the ticks of a flight.
fn judge_tick(lines: &[Line], tasks: &BTreeMap<u64, (String, u64)>) -> Result<()> {
    let control = tasks.iter().find(|(_, (name, _))| name == "control");
    let control = *control.context("a task `control`")?.0;
    let ticks = lines.iter().find(|line| line.address == control).map_or(0, |line| line.calls);
    let all: u64 = lines.iter().map(|line| line.all).sum();
    let mean = all as f64 / ticks as f64;
    println!("{EVERYTHING_ON}: {mean:.0} instructions of all tasks a tick, mean of {ticks} ticks");
    ensure!(
        mean < EVERYTHING_MOST,
        "a tick takes {mean:.0} instructions, {EVERYTHING_MOST} at most"
    );
    Ok(())
}

/// Flies once; the plugin's lines.
fn fly(description: &Path, image: &Path, flight: &[&str]) -> Result<Vec<Line>> {
    let folder = std::path::absolute(FOLDER)?;
    let (script, out) = (folder.join("qemu-counting"), folder.join("counts.txt"));
    let plugin = std::path::absolute("target/release/libinsn_count.so")?;
    let text = format!(
        "#!/bin/sh\nexec qemu-system-arm -plugin {},tasks={},out={} \"$@\"\n",
        plugin.display(),
        description.display(),
        out.display()
    );
    std::fs::write(&script, text)?;
    run(std::process::Command::new("chmod").arg("+x").arg(&script))?;
    let _ = std::fs::remove_file(&out);
    let mut fly = cargo(["run", "--release", "--quiet", "-p", "sil-host", "--", "pil", "--quiet"]);
    fly.args(flight).arg("--qemu").arg(&script).arg("--image").arg(image);
    fly.arg("--out").arg(folder.join("flights"));
    // A guarantee that a flight of a second violates is no matter here; what is counted is.
    let status = fly.stdout(std::process::Stdio::null()).status().context("sil-host")?;
    ensure!(status.code().is_some_and(|code| code < 4), "the flight {flight:?} failed: {status}");
    let text = std::fs::read_to_string(&out).context("counts of the plugin")?;
    let lines = text.lines().map(|line| {
        let words: Vec<_> = line.split_whitespace().collect();
        let number = |index: usize| words.get(index).and_then(|word| word.parse().ok());
        let address = words.get(1).and_then(|word| word.strip_prefix("0x"));
        let address = u64::from_str_radix(address.context("an address")?, 16)?;
        let most = number(2).context("a count")?;
        let [calls, all] = [3, 4].map(|index| number(index).unwrap_or(0));
        Ok(Line { kind: words[0].to_owned(), address, most, calls, all })
    });
    lines.collect()
}

/// Compares every loop's rounds with its bound.
fn judge_loops(analysis: &Analysis, rounds: &BTreeMap<u64, u64>) -> Result<()> {
    let (mut reached, mut loops) = (0, 0);
    let mut limits: BTreeMap<u64, (u64, &str)> = BTreeMap::new();
    for found in &analysis.loops {
        let most = match found.found.limit {
            Limit::Each(most) => most,
            Limit::InAll(most) => most.saturating_sub(1), // ways back
            Limit::Time(_) => continue,
        };
        let limit = limits.entry(found.header).or_insert((0, &found.found.origin));
        limit.0 = limit.0.max(most);
    }
    for (header, (limit, origin)) in &limits {
        let count = rounds.get(header).copied().unwrap_or(0);
        loops += 1;
        reached += u64::from(count > 0);
        ensure!(
            count <= *limit,
            "the loop at {header:#x} ({origin}) went round {count} times, at most {limit} are said"
        );
    }
    println!("{loops} loops bounded, {reached} of them counted in flights, none above its bound");
    Ok(())
}

#[cfg(test)]
#[path = "../../insn-count/src/tasks.rs"]
#[allow(dead_code, reason = "the plugin's own code, which cannot be linked into a test there")]
mod tasks;
