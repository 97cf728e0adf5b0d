//! `run`: flies scenarios, checks their guarantees and writes their results.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use crate::cli::RunArguments;
use crate::log::FlightLog;
use crate::log::description::Description;
use crate::progress::Progress;
use crate::report::{self, Outcome};
use crate::results::Results;
use sim::closed_loop::Observer;
use sim::guarantee::Guarantees;
use sim::guarantee::lyapunov::Evaluator;
use sim::sample::Sample;
use sim::scenario::{LoadedScenario, Scenario, ScenarioError};

/// Updates of the progress display in a flight.
const UPDATES: u64 = 100;

/// Why a run could not be completed.
#[derive(Clone, Debug)]
pub enum RunError {
    /// A scenario cannot be read or flown.
    Scenario(ScenarioError),
    /// Results cannot be written: where, and why.
    Output(PathBuf, String),
}

impl fmt::Display for RunError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scenario(error) => error.fmt(out),
            Self::Output(path, error) => write!(out, "{}: {error}", path.display()),
        }
    }
}

impl std::error::Error for RunError {}

impl From<ScenarioError> for RunError {
    fn from(error: ScenarioError) -> Self {
        Self::Scenario(error)
    }
}

/// Flies every scenario and prints what came out; whether every guarantee held.
///
/// # Errors
/// All scenarios are read before the first is flown. See [`RunError`].
pub fn run(arguments: &RunArguments) -> Result<bool, RunError> {
    let changes = arguments.changes();
    let scenarios = arguments
        .scenarios()
        .iter()
        .map(|name| LoadedScenario::open(name, &changes))
        .collect::<Result<Vec<_>, _>>()?;
    let mut outcomes = Vec::with_capacity(scenarios.len());
    for scenario in &scenarios {
        let outcome = fly(scenario, arguments)?;
        if !arguments.json {
            print!("{}", report::table(&outcome, arguments.quiet));
        }
        outcomes.push(outcome);
    }
    if arguments.json {
        println!("{}", report::json(&outcomes));
    }
    Ok(outcomes.iter().all(Outcome::passed))
}

/// Everything that watches a flight: monitors, trace and figures.
#[derive(Debug)]
pub struct Watch {
    evaluator: Evaluator,
    guarantees: Guarantees,
    results: Results,
    log: Option<FlightLog>,
}

impl Watch {
    /// Watches a flight of `scenario`; results go to `directory`, a row of the trace every
    /// `trace_every` ticks.
    ///
    /// # Errors
    /// When the results cannot be written.
    pub fn new(scenario: &Scenario, directory: &Path, trace_every: u64) -> io::Result<Self> {
        Ok(Self {
            evaluator: Evaluator::new(&scenario.controller, &scenario.vehicle.into()),
            guarantees: Guarantees::of(scenario),
            results: Results::create(directory, scenario, trace_every)?,
            log: None,
        })
    }
}

impl Observer for Watch {
    fn observe(&mut self, sample: &Sample) {
        let evaluation = self.evaluator.evaluate(sample);
        self.guarantees.observe(sample, &evaluation);
        self.results.observe(sample, &evaluation);
        if let Some(log) = &mut self.log {
            log.observe(sample, &evaluation);
        }
    }
}

/// Flies a scenario and writes its results below `arguments.out`.
pub(crate) fn fly(loaded: &LoadedScenario, arguments: &RunArguments) -> Result<Outcome, RunError> {
    let scenario = loaded.scenario();
    let mut flight = loaded.flight()?;
    let (outcome, ()) = watched(loaded, arguments, |watch, progress| {
        let ticks = scenario.ticks();
        let chunk = ticks.div_ceil(UPDATES).max(1);
        let mut flown = 0;
        while flown < ticks {
            let now = chunk.min(ticks - flown);
            flight.advance(now, watch);
            flown += now;
            progress.advance(now);
        }
        Ok::<_, RunError>(())
    })?;
    Ok(outcome)
}

/// Has `fly` fly a scenario in front of every monitor, and writes its results.
///
/// # Errors
/// When the results cannot be written, and those of `fly`.
pub(crate) fn watched<T, E: From<RunError>>(
    loaded: &LoadedScenario,
    arguments: &RunArguments,
    fly: impl FnOnce(&mut Watch, &Progress) -> Result<T, E>,
) -> Result<(Outcome, T), E> {
    let scenario = loaded.scenario();
    let directory = arguments.out.join(&scenario.name);
    let unwritable = |error: io::Error| RunError::Output(directory.clone(), error.to_string());
    let trace_every = u64::from(arguments.trace_every.get());
    let mut watch = Watch::new(scenario, &directory, trace_every).map_err(unwritable)?;
    if !arguments.log.formats.is_empty() {
        let description = Description::new(loaded).map_err(RunError::Scenario)?;
        let log = FlightLog::create(&arguments.log, &description, &directory);
        watch.log = Some(log.map_err(unwritable)?);
    }
    let ticks = scenario.ticks();
    let progress = Progress::new(&scenario.name, ticks, scenario.duration, arguments.quiet);
    progress.message("flying");
    let flown = fly(&mut watch, &progress)?;
    let outcome = Outcome {
        name: scenario.name.clone(),
        description: scenario.description.clone(),
        broken_assumptions: scenario.broken_assumptions(),
        verdicts: watch.guarantees.verdicts(),
        flight_time: scenario.duration,
        wall_time: progress.finish().as_secs_f64(),
        directory: directory.clone(),
    };
    let Watch { results, log, .. } = watch;
    results.finish(scenario, &outcome).map_err(unwritable)?;
    log.map_or(Ok(()), |log| log.finish(&outcome.verdicts)).map_err(unwritable)?;
    Ok((outcome, flown))
}
