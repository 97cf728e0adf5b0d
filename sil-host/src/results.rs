//! Files of a scenario's results: `trace.csv`, one SVG per figure, and `index.html`.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use crate::figure::{FigureRecorder, catalogue};
use crate::page;
use crate::replay3d::{ReplayRecorder, Track};
use crate::report::FlightReport;
use crate::trace::TraceWriter;
use sim::observer::Observer;
use sim::scenario::Scenario;
use sim::tick::Tick;

/// Ticks that the page replays.
const REPLAYED: usize = 600;

/// Results of a flight in progress.
#[derive(Debug)]
pub struct FlightResults {
    directory: PathBuf,
    trace: TraceWriter<File>,
    recorder: FigureRecorder,
    replay: ReplayRecorder,
}

impl FlightResults {
    /// Makes `directory` and opens the trace in it, with a row every `every` ticks.
    ///
    /// # Errors
    /// When the directory or the file cannot be made.
    pub fn create(directory: &Path, scenario: &Scenario, every: u64) -> io::Result<Self> {
        fs::create_dir_all(directory)?;
        let trace = TraceWriter::new(File::create(directory.join("trace.csv"))?, every)?;
        let recorder = FigureRecorder::new(scenario.duration, scenario.guarantees.settle_time);
        let replay = ReplayRecorder::new(scenario.duration, REPLAYED);
        Ok(Self { directory: directory.to_owned(), trace, recorder, replay })
    }

    /// Completes the trace alone, without figures and page; returns its number of rows.
    ///
    /// # Errors
    /// The first error of any write.
    pub fn finish_trace(self) -> io::Result<u64> {
        self.trace.finish().map(|(_, rows)| rows)
    }

    /// Completes the trace and writes the figures and the page.
    ///
    /// # Errors
    /// The first error of any write.
    pub fn finish(self, scenario: &Scenario, report: &FlightReport) -> io::Result<()> {
        self.trace.finish()?;
        let vehicle = scenario.vehicle.into();
        let figures = catalogue::figures(&self.recorder, &scenario.controller, &vehicle);
        for figure in &figures {
            let file = self.directory.join(figure.name).with_extension("svg");
            fs::write(file, figure.svg(&report.name))?;
        }
        let track = Track::new(&self.replay.finish());
        fs::write(self.directory.join("index.html"), page::page(report, &figures, &track))
    }
}

impl Observer for FlightResults {
    #[inline]
    fn observe(&mut self, tick: &Tick) {
        self.trace.observe(tick);
        self.recorder.observe(tick);
        self.replay.observe(tick);
    }
}
