//! What a run leaves behind for a scenario: `trace.csv`, one SVG a figure, and `index.html`.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use crate::figure::{Recorder, catalogue};
use crate::page;
use crate::replay3d::{FrameRecorder, Track};
use crate::report::Outcome;
use crate::trace::TraceWriter;
use sim::closed_loop::Observer;
use sim::guarantee::lyapunov::Evaluation;
use sim::sample::Sample;
use sim::scenario::Scenario;

/// Frames that the page replays.
const FRAMES: usize = 600;

/// Results in the making.
#[derive(Debug)]
pub struct Results {
    directory: PathBuf,
    trace: TraceWriter<File>,
    recorder: Recorder,
    frames: FrameRecorder,
}

impl Results {
    /// Makes `directory` and opens the trace in it, with a row every `every` ticks.
    ///
    /// # Errors
    /// When the directory or the file cannot be made.
    pub fn create(directory: &Path, scenario: &Scenario, every: u64) -> io::Result<Self> {
        fs::create_dir_all(directory)?;
        let trace = TraceWriter::new(File::create(directory.join("trace.csv"))?, every)?;
        let recorder = Recorder::new(scenario.duration, scenario.guarantees.settle_time);
        let frames = FrameRecorder::new(scenario.duration, FRAMES);
        Ok(Self { directory: directory.to_owned(), trace, recorder, frames })
    }

    /// Takes in one tick.
    #[inline]
    pub fn observe(&mut self, sample: &Sample, evaluation: &Evaluation) {
        self.trace.observe(sample, evaluation);
        self.recorder.observe(sample, evaluation);
        self.frames.observe(sample);
    }

    /// Completes the trace alone, without figures and page; returns its number of rows.
    ///
    /// # Errors
    /// The first that writing it met.
    pub fn finish_trace(self) -> io::Result<u64> {
        self.trace.finish().map(|(_, rows)| rows)
    }

    /// Completes the trace and writes the figures and the page.
    ///
    /// # Errors
    /// The first that writing any file met.
    pub fn finish(self, scenario: &Scenario, outcome: &Outcome) -> io::Result<()> {
        self.trace.finish()?;
        let vehicle = scenario.vehicle.into();
        let figures = catalogue::figures(&self.recorder, &scenario.controller, &vehicle);
        let mut documents = Vec::with_capacity(figures.len());
        for figure in &figures {
            let document = figure.svg(&outcome.name);
            fs::write(self.directory.join(figure.name).with_extension("svg"), &document)?;
            documents.push(document);
        }
        let track = Track::new(&self.frames.finish());
        fs::write(self.directory.join("index.html"), page::html(outcome, &documents, &track))
    }
}
