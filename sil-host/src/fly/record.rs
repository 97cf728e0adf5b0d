//! Results of the flights of a session: one directory each, with trace, log and verdicts.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use ctrl_core::controller::ControllerConfig;
use ctrl_core::error::ConfigError;
use ctrl_core::mode::Mode;
use ctrl_core::mode::navigation::NavigationMode;
use mavlink_vehicle::LogEntry;
use sim::guarantee::applied::Applied;
use sim::guarantee::status::Faults;
use sim::guarantee::wrench::{Thrust, Torque};
use sim::guarantee::{Monitor, Verdict};
use sim::observer::Observer;
use sim::scenario::Scenario;
use sim::tick::Tick;

use super::error::FlyError;
use crate::log::description::Description;
use crate::log::moment::LoggedStatus;
use crate::log::{FlightLog, LogOptions};
use crate::report::FlightReport;
use crate::trace::TraceWriter;

/// The report of a flight, as that of `run`.
pub type FlownReport = FlightReport;

/// The flights of a session: the one in progress, and those that are done.
#[derive(Debug)]
pub struct FlightLogs {
    scenario: Scenario,
    description: Description,
    directory: PathBuf,
    options: LogOptions,
    trace_every: u64,
    current: Option<Recorder>,
    reports: Vec<FlownReport>,
    logs: Vec<Log>,
}

/// A log that can be fetched.
#[derive(Debug)]
struct Log {
    path: PathBuf,
    entry: LogEntry,
}

/// Observers of a flight.
#[derive(Debug)]
struct Recorder {
    directory: PathBuf,
    trace: TraceWriter<File>,
    log: FlightLog,
    monitors: Monitors,
    /// First tick of the flight.
    start: u64,
    ticks: u64,
    /// `true` once the law has run.
    flew: bool,
    started: Instant,
}

impl FlightLogs {
    /// Flights of `scenario` go to numbered directories in `directory`.
    ///
    /// # Errors
    /// When the directory cannot be made.
    pub fn new(
        scenario: &Scenario,
        description: Description,
        directory: &Path,
        options: &LogOptions,
        trace_every: u64,
    ) -> io::Result<Self> {
        fs::create_dir_all(directory)?;
        Ok(Self {
            scenario: scenario.clone(),
            description,
            directory: directory.to_owned(),
            options: options.clone(),
            trace_every,
            current: None,
            reports: Vec::new(),
            logs: Vec::new(),
        })
    }

    /// Records a tick; a flight begins with Armed and ends with Disarmed or Locked. Returns the report of one
    /// that has just ended.
    ///
    /// # Errors
    /// When results cannot be written.
    pub fn observe(
        &mut self,
        tick: &Tick,
        mode: Mode,
        navigation: NavigationMode,
    ) -> io::Result<Option<&FlownReport>> {
        let armed = matches!(mode, Mode::Armed | Mode::Flying | Mode::Failsafe);
        if armed && self.current.is_none() {
            self.begin(tick.tick)?;
        }
        if let Some(recorder) = &mut self.current {
            recorder.observe(*tick, mode, navigation);
        }
        if armed { Ok(None) } else { self.end() }
    }

    /// Judges and describes flights by other parameters of the controller, from the one that is about to start.
    ///
    /// # Errors
    /// Names the parameter that the controller refuses; nothing is then changed.
    pub fn follow(&mut self, controller: &ControllerConfig) -> Result<(), ConfigError> {
        self.description.follow(controller)?;
        self.scenario.controller = *controller;
        if let Some(recorder) = self.current.as_mut().filter(|recorder| !recorder.flew) {
            recorder.monitors = monitors(&self.scenario);
        }
        Ok(())
    }

    fn begin(&mut self, start: u64) -> io::Result<()> {
        let directory = self.directory.join(format!("flight-{:03}", self.reports.len() + 1));
        fs::create_dir_all(&directory)?;
        let trace = TraceWriter::new(File::create(directory.join("trace.csv"))?, self.trace_every)?;
        let log = FlightLog::create(&self.options, &self.description, &directory)?;
        let monitors = monitors(&self.scenario);
        let started = Instant::now();
        self.current = Some(Recorder {
            directory,
            trace,
            log,
            monitors,
            start,
            ticks: 0,
            flew: false,
            started,
        });
        Ok(())
    }

    /// Ends the flight in progress, if there is one.
    ///
    /// # Errors
    /// When its results cannot be written.
    pub fn end(&mut self) -> io::Result<Option<&FlownReport>> {
        let Some(recorder) = self.current.take() else { return Ok(None) };
        let verdicts = recorder.verdicts();
        let Recorder { directory, trace, log, ticks, started, .. } = recorder;
        trace.finish()?;
        log.finish(&verdicts)?;
        let period = f64::from(self.scenario.controller.step_period());
        let path = directory.join("flight.ulg");
        if let Ok(metadata) = fs::metadata(&path) {
            let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
            let entry = LogEntry {
                size: u32::try_from(metadata.len()).unwrap_or(u32::MAX),
                time_utc: u32::try_from(since.as_secs()).unwrap_or(0),
            };
            self.logs.push(Log { path, entry });
        }
        self.reports.push(FlownReport {
            name: format!("{}, flight {}", self.scenario.name, self.reports.len() + 1),
            description: "flown under commands".to_owned(),
            broken_assumptions: self.scenario.broken_assumptions(),
            verdicts,
            flight_time: (ticks as f64 * period * 1e3).round() / 1e3,
            wall_time: started.elapsed().as_secs_f64(),
            directory,
        });
        Ok(self.reports.last())
    }

    /// The error of results that cannot be written.
    pub(super) fn unwritable(&self, error: io::Error) -> FlyError {
        FlyError::Output(self.directory.clone(), error)
    }

    /// Reports of the flights that are done.
    #[must_use]
    pub fn reports(&self) -> &[FlownReport] {
        &self.reports
    }

    /// Logs of the flights that are done.
    pub fn entries(&self) -> impl Iterator<Item = LogEntry> + '_ {
        self.logs.iter().map(|log| log.entry)
    }

    /// Reads a log from `offset` on; the number of bytes read.
    pub fn read(&self, index: u16, offset: u32, out: &mut [u8]) -> usize {
        let Some(log) = self.logs.get(usize::from(index)) else { return 0 };
        let part = |out: &mut [u8]| -> io::Result<usize> {
            let mut file = File::open(&log.path)?;
            file.seek(SeekFrom::Start(offset.into()))?;
            file.read(out)
        };
        // A file that is gone is a log without bytes.
        part(out).unwrap_or(0)
    }
}

/// Monitors of what is guaranteed whatever a station asks for.
type Monitors = (Thrust, Torque, Applied, Faults);

fn monitors(scenario: &Scenario) -> Monitors {
    let law = &scenario.controller;
    let applied = Applied::new(&scenario.effective_actuation());
    (Thrust::new(law), Torque::new(law), applied, Faults::default())
}

impl Recorder {
    fn observe(&mut self, mut tick: Tick, mode: Mode, navigation: NavigationMode) {
        let period = if tick.tick == 0 { 0.0 } else { tick.time / tick.tick as f64 };
        tick.tick -= self.start;
        tick.time = tick.tick as f64 * period;
        self.ticks = tick.tick + 1;
        self.trace.observe(&tick);
        let armed = mode != Mode::Disarmed;
        self.log.set_mode(LoggedStatus { armed, navigation });
        self.log.observe(&tick);
        let (thrust, torque, applied, faults) = &mut self.monitors;
        // The bounds are the law's: it does not run on the ground, nor in the failsafe's descent.
        if mode == Mode::Flying {
            self.flew = true;
            thrust.observe(&tick);
            torque.observe(&tick);
            faults.observe(&tick);
        }
        applied.observe(&tick);
    }

    /// The verdicts; none if the law has not run.
    fn verdicts(&self) -> Vec<Verdict> {
        if !self.flew {
            return Vec::new();
        }
        let (thrust, torque, applied, faults) = &self.monitors;
        let monitors: [&dyn Monitor; 4] = [thrust, torque, applied, faults];
        monitors.into_iter().flat_map(Monitor::verdicts).collect()
    }
}
