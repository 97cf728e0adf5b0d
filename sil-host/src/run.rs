//! One flight before every monitor, with its results written.

use std::fmt;
use std::io;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::time::Instant;

use sim::guarantee::Guarantees;
use sim::observer::Observer;
use sim::scenario::{LoadedScenario, Scenario, ScenarioError};
use sim::tick::Tick;

use crate::log::description::Description;
use crate::log::{FlightLog, LogOptions};
use crate::report::FlightReport;
use crate::results::FlightResults;

/// Calls of the progress callback per flight.
const UPDATES: u64 = 100;

/// Options for the results of a flight.
#[derive(Clone, Debug)]
pub struct FlightOptions {
    /// Directory of results; each flight gets one below it, named after its scenario.
    pub out: PathBuf,
    /// Ticks per row of the trace.
    pub trace_every: NonZeroU32,
    /// Logs for other programs.
    pub log: LogOptions,
}

/// Cause of a flight that could not be completed.
#[derive(Clone, Debug)]
pub enum RunError {
    /// A scenario cannot be read or flown.
    Scenario(ScenarioError),
    /// Results cannot be written: path and reason.
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

/// The observers of a recorded flight: monitors, trace, figures and logs.
#[derive(Debug)]
pub struct FlightRecorder {
    guarantees: Guarantees,
    results: FlightResults,
    log: Option<FlightLog>,
}

impl FlightRecorder {
    /// Observers of a flight of `scenario`; results go to `directory`, a row of the trace every
    /// `trace_every` ticks.
    ///
    /// # Errors
    /// When the results cannot be written.
    pub fn new(scenario: &Scenario, directory: &Path, trace_every: u64) -> io::Result<Self> {
        Ok(Self {
            guarantees: scenario.monitors(),
            results: FlightResults::create(directory, scenario, trace_every)?,
            log: None,
        })
    }
}

impl Observer for FlightRecorder {
    fn observe(&mut self, tick: &Tick) {
        self.observe_ticks(std::slice::from_ref(tick));
    }

    fn observe_ticks(&mut self, ticks: &[Tick]) {
        self.guarantees.observe_ticks(ticks);
        self.results.observe_ticks(ticks);
        self.log.observe_ticks(ticks);
    }
}

/// Flies a scenario and writes its results below `options.out`; `progress` receives the number of
/// ticks flown since its last call.
///
/// # Errors
/// See [`RunError`].
pub fn fly(
    loaded: &LoadedScenario,
    options: &FlightOptions,
    progress: &dyn Fn(u64),
) -> Result<FlightReport, RunError> {
    let ticks = loaded.scenario().ticks();
    let mut flight = loaded.flight()?;
    let (report, ()) = recorded(loaded, options, |recorder| {
        let chunk = ticks.div_ceil(UPDATES).max(1).next_multiple_of(4); // whole blocks
        let mut flown = 0;
        while flown < ticks {
            let now = chunk.min(ticks - flown);
            flight.observe_in_blocks(now, recorder);
            flown += now;
            progress(now);
        }
        Ok::<_, RunError>(())
    })?;
    Ok(report)
}

/// Calls `fly` with the observers of a recorded flight, and writes the results.
///
/// # Errors
/// When the results cannot be written, and those of `fly`.
pub(crate) fn recorded<T, E: From<RunError>>(
    loaded: &LoadedScenario,
    options: &FlightOptions,
    fly: impl FnOnce(&mut FlightRecorder) -> Result<T, E>,
) -> Result<(FlightReport, T), E> {
    let scenario = loaded.scenario();
    let directory = options.out.join(&scenario.name);
    let unwritable = |error: io::Error| RunError::Output(directory.clone(), error.to_string());
    let trace_every = u64::from(options.trace_every.get());
    let recorder = FlightRecorder::new(scenario, &directory, trace_every);
    let mut recorder = recorder.map_err(unwritable)?;
    if !options.log.formats.is_empty() {
        let description = Description::new(loaded).map_err(RunError::Scenario)?;
        let log = FlightLog::create(&options.log, &description, &directory);
        recorder.log = Some(log.map_err(unwritable)?);
    }
    let started = Instant::now();
    let flown = fly(&mut recorder)?;
    let report = FlightReport {
        name: scenario.name.clone(),
        description: scenario.description.clone(),
        broken_assumptions: scenario.broken_assumptions(),
        verdicts: recorder.guarantees.verdicts(),
        flight_time: scenario.duration,
        wall_time: started.elapsed().as_secs_f64(),
        directory: directory.clone(),
    };
    let FlightRecorder { results, log, .. } = recorder;
    results.finish(scenario, &report).map_err(unwritable)?;
    log.map_or(Ok(()), |log| log.finish(&report.verdicts)).map_err(unwritable)?;
    Ok((report, flown))
}
