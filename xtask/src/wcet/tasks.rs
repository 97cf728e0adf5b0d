//! The tasks of the firmware's board image: bounds, critical sections, response times, verdicts.

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};
use firmware::rate_loop::{Group, GroupConfig};
use firmware::rates;

use super::analysis::Analysis;
use super::library::LIBRARY;
use super::limit::Limits;
use super::response::{Demand, response, utilisation};
use super::section;
use super::timing::Model;
use super::traffic::{BYTE, CONTRACT, Exception, MAVLINK_BYTE, StateInput, TRAFFIC, demands};
use crate::budgets::Row;
use crate::cycles::CLOCK;
use crate::disassembly::{Listing, disassemble};
use crate::elf::Image;

/// Source of the tasks' priorities.
const MAIN: &str = "firmware/src/main.rs";

/// Functions that no task executes in flight, by parts of their names, and the reason.
pub const GROUND_ONLY: &[(&str, &str)] = &[
    ("HostSession::set", "settings are refused in flight"),
    ("HostSession>::renew_law", "parameters and controllers change on the ground"),
    ("HostSession>::tune", "as above"),
    ("HostSession>::accept_built_in_trajectory", "parameters are stored while disarmed"),
    ("stored_signing::Change::store", "as above"),
    ("HostSession>::next_to_store", "as above"),
    ("OnboardNavigation::configure", "settings are refused in flight"),
    ("FlightControl<_>::replace_law", "a law is replaced on the ground"),
    ("firmware::app::announce", "lock step only, in which the vehicle waits for its host anyway"),
];

/// Tasks that are claimed to have no bound, and the reason. They have to be below all tasks that have one, so that
/// nothing but their critical sections delays those; what runs in these needs bounds.
const UNBOUNDED: &[(&str, &str)] =
    &[("mavlink", "parser and encoder of a library; nothing is below it")];

/// Constants that annotations name and that are smaller in the image, or that the image chooses: its vehicle has
/// as many rotors as the board has outputs, which `firmware/build.rs` checks; with four, the slabs of one set
/// of axes are at most their pairs, those of the wrench their triples.
/// A frame of samples has as many measurements as there are sources (`firmware/src/sensor.rs`).
pub const CONSTANTS: &[(&str, u64)] =
    &[("MAX_ROTORS", 4), ("SLABS", 6), ("WRENCH_SLABS", 4), ("MEASUREMENTS", 8)];
/// Instructions from which on a function is listed.
const DEAR: u64 = 1000;

/// A task as `main.rs` declares it.
#[derive(Clone)]
pub struct Task {
    /// Name of the function.
    pub name: String,
    /// Interrupt or exception, the symbol of its handler.
    pub handler: String,
    /// Logical priority, the highest number first.
    pub priority: u64,
}

/// The firmware's tasks, highest priority first.
pub fn declared_tasks() -> Result<Vec<Task>> {
    declared(&std::fs::read_to_string(MAIN)?)
}

/// The tasks in `text`, highest priority first.
pub fn declared(text: &str) -> Result<Vec<Task>> {
    let mut tasks = Vec::new();
    for part in text.split("#[task(").skip(1) {
        let value = |key: &str| {
            let rest = part.split_once(key)?.1;
            let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_')?;
            Some(rest[..end].to_owned())
        };
        let context = || format!("a task in {MAIN}: {}", part.lines().next().unwrap_or_default());
        tasks.push(Task {
            name: value("fn ").with_context(context)?,
            handler: value("binds = ").with_context(context)?,
            priority: value("priority = ").with_context(context)?.parse()?,
        });
    }
    ensure!(!tasks.is_empty(), "{MAIN} has no task");
    tasks.sort_by_key(|task| std::cmp::Reverse(task.priority));
    Ok(tasks)
}

/// Bounds of one task; cycles by the model: the flash's accelerator always hit, and off.
pub struct TaskBound {
    /// The task.
    pub task: Task,
    /// Most for each release, waiting for hardware included.
    pub cost: BTreeMap<Model, u64>,
    /// Longest time that tasks below it keep it waiting (cycles): those with a bound, and any.
    pub blocking: BTreeMap<Model, [u64; 2]>,
    /// Response times under each traffic.
    pub responses: Vec<Response>,
}

/// A task's response time.
pub struct Response {
    /// Of the flash.
    pub model: Model,
    /// Index of [`TRAFFIC`].
    pub traffic: usize,
    /// Cycles, if there is a bound.
    pub response: Option<u64>,
    /// Deadline (cycles).
    pub deadline: u64,
}

impl Response {
    fn is_met(&self) -> bool {
        self.response.is_some_and(|response| response <= self.deadline)
    }
}

/// An image under analysis for one purpose.
pub struct View {
    limits: Limits,
    excluded: Vec<&'static str>,
}

impl View {
    /// With other constants than the sources', and without some functions.
    pub fn new(
        path: &std::path::Path,
        constants: &[(&'static str, u64)],
        more: &[&'static str],
    ) -> Result<Self> {
        let excluded = GROUND_ONLY.iter().map(|(part, _)| *part).chain(more.iter().copied());
        let constants = [constants, CONSTANTS].concat();
        Ok(Self { limits: Limits::open(path, constants)?, excluded: excluded.collect() })
    }

    /// Its analysis.
    pub fn analysis<'a>(&'a self, image: &'a Image, listing: &'a Listing) -> Analysis<'a> {
        Analysis::new(image, listing, &self.limits, &self.excluded)
    }
}

/// Bounds the tasks of a linked board image.
pub fn bounds(path: &std::path::Path) -> Result<Vec<TaskBound>> {
    let (image, listing) = (Image::read(path)?, disassemble(path)?);
    let tasks = declared_tasks()?;
    let all = View::new(path, &[], &[])?;
    let (mut full, mut busy) =
        (all.analysis(&image, &listing), all.analysis(&image, &listing).without_waiting());
    let (mut costs, mut sections_only) = (BTreeMap::new(), Vec::new());
    let lowest = bounded(&tasks).map(|task| task.priority).min().unwrap_or(0);
    for task in &tasks {
        let start = image.named(&task.handler)?.range.start;
        let context = || format!("task `{}`", task.name);
        if let Some((_, reason)) = unbounded(task) {
            ensure!(task.priority < lowest, "`{}` has no bound and is not the lowest", task.name);
            let without = full.examine(start).with_context(context)?.len();
            println!("{}: no bound claimed, {reason}; {without} loops without one", task.name);
            sections_only.push(start);
            continue;
        }
        let cost = full.cost(start).with_context(context)?;
        costs.insert(task.name.clone(), (start, cost, busy.cost(start).with_context(context)?));
    }
    let idle: Vec<_> = full.idle_exclusions().collect();
    ensure!(idle.is_empty(), "no function of the tasks is called {} now", idle.join(", "));
    print_functions(&full, &image);
    let mut bounds: Vec<_> = bounded(&tasks)
        .map(|task| {
            let cost = Model::ALL.map(|model| (model, costs[&task.name].1.total(model))).into();
            TaskBound { task: task.clone(), cost, blocking: BTreeMap::new(), responses: Vec::new() }
        })
        .collect();
    for model in [Model::CyclesHit, Model::CyclesMiss] {
        for index in 0..bounds.len() {
            let priority = bounds[index].task.priority;
            let longest = |start: u64| {
                section::longest(&full, start, priority, model)
                    .with_context(|| format!("sections of the task at {start:#x}"))
            };
            let below = bounds.iter().filter(|bound| bound.task.priority < priority);
            let starts = below.map(|bound| costs[&bound.task.name].0);
            let known = starts.map(longest).collect::<Result<Vec<_>>>()?;
            let others = sections_only.iter().copied().map(longest).collect::<Result<Vec<_>>>()?;
            let [known, others] =
                [known, others].map(|sections| sections.into_iter().max().unwrap_or(0));
            bounds[index].blocking.insert(model, [known, known.max(others)]);
        }
    }
    let exceptions = tasks.iter().map(|task| {
        let start = image.named(&task.handler)?.range.start;
        Ok((task.name.clone(), Exception::of(&full, start)))
    });
    let exceptions = exceptions.collect::<Result<BTreeMap<_, _>>>()?;
    for (index, traffic) in TRAFFIC.iter().enumerate() {
        let input = StateInput::bound(path, &image, &listing, &mut busy, traffic)?;
        for model in [Model::CyclesHit, Model::CyclesMiss] {
            let demands = demands(&costs, &exceptions, &tasks, &input, traffic, model)?;
            respond(&mut bounds, &demands, index, model);
        }
    }
    Ok(bounds)
}

fn unbounded(task: &Task) -> Option<&'static (&'static str, &'static str)> {
    UNBOUNDED.iter().find(|(name, _)| *name == task.name)
}

/// The tasks that have a bound.
pub fn bounded(tasks: &[Task]) -> impl Iterator<Item = &Task> {
    tasks.iter().filter(|task| unbounded(task).is_none())
}

/// Adds the response times under one traffic.
fn respond(bounds: &mut [TaskBound], demands: &[Demand], traffic: usize, model: Model) {
    println!(
        "{}, {}: the tasks take at most {:.0} % of the processor",
        TRAFFIC[traffic].name,
        name(model),
        100.0 * utilisation(demands)
    );
    for Demand { name, cost, jobs, period, .. } in demands {
        println!("  {name}: at most {cost} cycles, {jobs} times in {period}");
    }
    for bound in bounds {
        let name = &bound.task.name;
        let Some(deadline) = deadline(name) else { continue };
        let priority = bound.task.priority;
        let blocking = bound.blocking[&model][usize::from(TRAFFIC[traffic].unbounded)];
        // One of equal priority that came before is not interrupted.
        let (own, others): (Vec<_>, Vec<_>) =
            demands.iter().partition(|demand| demand.task == *name);
        let before: Vec<_> =
            others.into_iter().filter(|demand| demand.priority >= priority).collect();
        // A byte of many: each is a job of its own.
        let own: u64 = own.iter().map(|demand| demand.cost).sum();
        let response = response(own, blocking, &before, 10 * deadline);
        bound.responses.push(Response { model, traffic, response, deadline });
    }
}

/// Prints the dearest functions of all tasks, where to begin when a bound is too high.
fn print_functions(analysis: &Analysis, image: &Image) {
    let mut rows: Vec<_> = analysis
        .functions()
        .map(|(start, bytes, cost)| (cost.total(Model::Instructions), start, bytes, cost))
        .filter(|(instructions, ..)| *instructions > DEAR)
        .collect();
    rows.sort_by_key(|(instructions, ..)| std::cmp::Reverse(*instructions));
    println!(
        "\nfirmware-board: functions of more than {DEAR} instructions a call, with what they call"
    );
    for (instructions, start, bytes, cost) in rows {
        let name = image.containing(start).map_or("?", |function| &function.name);
        let bytes = bytes.map_or(String::new(), |bytes| format!(" of {bytes} B"));
        println!("{instructions:>12} {:>12} {name}{bytes}", cost.total(Model::CyclesHit));
    }
}

fn name(model: Model) -> &'static str {
    match model {
        Model::Instructions => "instructions",
        Model::CyclesHit => "accelerator hit",
        Model::CyclesMiss => "accelerator off",
    }
}

/// Deadline of a task (cycles).
fn deadline(name: &str) -> Option<u64> {
    match name {
        "receive" => Some(us(BYTE)), // before the next one overwrites it
        "receive_mavlink" => Some(us(MAVLINK_BYTE)),
        name => group(name).map(|config| us(config.deadline.into())),
    }
}

/// The group of the rate loop that a task is.
pub fn group(name: &str) -> Option<GroupConfig> {
    let group = match name {
        "control" => Group::Control,
        "state_input" => Group::StateInput,
        "telemetry" => Group::Telemetry,
        "housekeeping" => Group::Housekeeping,
        _ => return None,
    };
    Some(rates::CONFIG.groups[group as usize])
}

/// One control period (us).
pub fn tick() -> u64 {
    rates::TICK.into()
}

/// Cycles of a time (us).
pub fn us(time: u64) -> u64 {
    (time as f64 * CLOCK / 1e6) as u64
}

/// Prints bounds, sections and verdicts; fails on a deadline that is missed although the accelerator hits.
pub fn report(bounds: &[TaskBound]) -> Result<()> {
    println!("\nfirmware-board: each task, at most, in flight");
    println!(
        "{:<14} {:>4} {:>12} {:>12} {:>12}",
        "task", "prio", "instructions", "cycles, hit", "cycles, miss"
    );
    for TaskBound { task, cost, .. } in bounds {
        let [instructions, hit, miss] = Model::ALL.map(|model| cost[&model]);
        println!("{:<14} {:>4} {instructions:>12} {hit:>12} {miss:>12}", task.name, task.priority);
    }
    println!("not in them, since it happens on the ground only:");
    GROUND_ONLY.iter().for_each(|(part, reason)| println!("  {part}: {reason}"));
    println!("bounds inside libraries:");
    for known in LIBRARY {
        println!("  {}: {} {}, {}", known.part, known.most, known.unit, known.reason);
    }
    println!("\nresponse times (us), with preemption and blocking; assumptions:");
    CONTRACT.iter().for_each(|assumption| println!("  {assumption}"));
    println!(
        "{:<14} {:<18} {:<16} {:>9} {:>9} {:>9}  verdict",
        "task", "traffic", "flash", "blocking", "response", "deadline"
    );
    let mut missed = Vec::new();
    for bound in bounds {
        for found in &bound.responses {
            let time = |cycles: u64| format!("{:.1}", cycles as f64 / (CLOCK / 1e6));
            let traffic = &TRAFFIC[found.traffic];
            println!(
                "{:<14} {:<18} {:<16} {:>9} {:>9} {:>9}  {}",
                bound.task.name,
                traffic.name,
                name(found.model),
                time(bound.blocking[&found.model][usize::from(traffic.unbounded)]),
                found.response.map_or("none".into(), time),
                time(found.deadline),
                if found.is_met() { "met" } else { "NOT MET" }
            );
            let hard = traffic.hard.contains(&&*bound.task.name);
            if hard && !found.is_met() && found.model == Model::CyclesHit {
                missed.push(bound.task.name.as_str());
            }
        }
    }
    ensure!(
        missed.is_empty(),
        "deadlines that have to be met while the accelerator hits are not: {}",
        missed.join(", ")
    );
    Ok(())
}

/// Limits of the tasks for `budgets.toml`.
pub fn rows(bounds: &[TaskBound]) -> Vec<Row> {
    let rows = bounds.iter().flat_map(|bound| {
        let mut responses = bound.responses.iter();
        let first = responses.find(|found| found.traffic == 0 && found.model == Model::CyclesHit);
        let response = first.and_then(|found| found.response);
        let name = |quantity| format!("{}_{quantity}", bound.task.name);
        [
            (name("wcet_instructions"), Some(bound.cost[&Model::Instructions])),
            (name("wcet_cycles"), Some(bound.cost[&Model::CyclesHit])),
            (name("response_cycles"), response),
        ]
    });
    let rows = rows.filter_map(|(quantity, value)| {
        let value = value? as f64;
        // A dozen names, for as long as the program runs.
        Some(Row { subject: "tasks", quantity: quantity.leak(), unit: "", value })
    });
    rows.collect()
}

#[cfg(test)]
mod tests {
    use super::declared;

    #[test]
    fn tasks_are_read_from_their_declaration() {
        let text = "/// Doc.\n#[task(binds = USART2, priority = 5, local = [receiver])]\n\
                    fn receive(cx: receive::Context) {}\n#[task(binds = SysTick, priority = 14,\n\
                    shared = [a])]\n  fn control(cx: control::Context) {}";
        let tasks = declared(text).unwrap();
        let found: Vec<_> =
            tasks.iter().map(|task| (&*task.name, &*task.handler, task.priority)).collect();
        assert_eq!(found, [("control", "SysTick", 14), ("receive", "USART2", 5)]);
        assert!(declared("fn nothing() {}").is_err());
        assert!(declared("#[task(binds = X)]").is_err());
    }
}
