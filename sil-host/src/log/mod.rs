//! Flight logs for other programs: [`ulog`] for PX4's tools and PlotJuggler, MCAP for Foxglove, Rerun
//! and PlotJuggler. `docs/logs.md` lists the topics.
//!
//! The topics of [`sim::quantity::TOPICS`] are the same in every format; each format adds those of its
//! own tools: [`px4`] and `mcap::foxglove`. A log depends on the scenario alone: times are the flight's own, never the wall
//! clock's, and a flight on the vehicle leaves the same bytes as one in SIL.

pub mod description;
pub mod format;
pub mod frame;
#[cfg(feature = "mcap")]
pub mod mcap;
pub mod moment;
pub mod note;
pub mod px4;
mod rotors;
pub mod ulog;

#[cfg(test)]
mod tests;

use std::fmt;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

use ctrl_core::vehicle::WrenchBounds;

use description::Description;
use format::Format;
use moment::{LoggedStatus, MOTORS, Moment};
use note::{Note, StatusNotes};
use rotors::Rotors;
use sim::guarantee::Verdict;
use sim::observer::Observer;
use sim::tick::Tick;

/// The name before that of a topic of ours, where a file also has topics of others.
pub const PREFIX: &str = "gyrfalcon";

/// Writer of one format.
pub trait Writer: fmt::Debug {
    /// Writes every topic at one instant.
    ///
    /// # Errors
    /// When it cannot be written.
    fn moment(&mut self, moment: &Moment) -> io::Result<()>;

    /// Writes a note.
    ///
    /// # Errors
    /// When it cannot be written.
    fn note(&mut self, note: &Note) -> io::Result<()>;

    /// Completes the file; nothing is written after it.
    ///
    /// # Errors
    /// When it cannot be written.
    fn finish(self: Box<Self>) -> io::Result<()>;
}

/// Options for the logs of a flight.
#[derive(Clone, Debug, Default)]
pub struct LogOptions {
    /// Formats to write; none: no log.
    pub formats: Vec<Format>,
    /// Rate of the samples (Hz); the nearest one that is the control rate over a whole number.
    pub rate: f64,
}

/// The logs of a flight in progress.
#[derive(Debug)]
pub struct FlightLog {
    every: u64,
    bounds: WrenchBounds,
    rotors: Option<Rotors>,
    mode: LoggedStatus,
    files: Vec<LogFile>,
    status: StatusNotes,
    /// Time of the latest tick (s).
    time: f64,
    /// The first error; nothing is written after it.
    error: Option<io::Error>,
}

#[derive(Debug)]
struct LogFile {
    name: &'static str,
    writer: Box<dyn Writer>,
}

impl FlightLog {
    /// Opens a file in `directory` per format in `options`.
    ///
    /// # Errors
    /// When a file cannot be made or its first bytes cannot be written.
    pub fn create(
        options: &LogOptions,
        description: &Description,
        directory: &Path,
    ) -> io::Result<Self> {
        let mut files: Vec<LogFile> = Vec::new();
        for format in &options.formats {
            let name = format.file_name();
            if files.iter().all(|file| file.name != name) {
                let writer = open(*format, &directory.join(name), description);
                files.push(LogFile { name, writer: writer.map_err(|error| named(name, &error))? });
            }
        }
        Ok(Self {
            every: ticks_between(options.rate, description.step_period),
            bounds: description.bounds,
            rotors: description.geometry.as_ref().and_then(Rotors::new),
            mode: LoggedStatus::ON_TRAJECTORY,
            files,
            status: StatusNotes::default(),
            time: 0.0,
            error: None,
        })
    }

    /// Sets the mode from the next tick on; a flight along a trajectory needs none.
    pub fn set_mode(&mut self, mode: LoggedStatus) {
        self.mode = mode;
    }

    /// Writes to every file, unless one has failed.
    fn write(&mut self, mut write: impl FnMut(&mut dyn Writer) -> io::Result<()>) {
        for LogFile { name, writer } in &mut self.files {
            if self.error.is_none() {
                self.error = write(writer.as_mut()).err().map(|error| named(name, &error));
            }
        }
    }

    /// Writes a note per verdict and completes the files.
    ///
    /// # Errors
    /// The first error of any write since the start.
    pub fn finish(mut self, verdicts: &[Verdict]) -> io::Result<()> {
        let mut notes = Vec::new();
        self.status.finish(self.time, |note| notes.push(note));
        notes.extend(verdicts.iter().map(|verdict| Note::verdict(verdict, self.time)));
        notes.iter().for_each(|note| self.write(|writer| writer.note(note)));
        if let Some(error) = self.error {
            return Err(error);
        }
        self.files.into_iter().try_for_each(|LogFile { name, writer }| {
            writer.finish().map_err(|error| named(name, &error))
        })
    }
}

impl Observer for FlightLog {
    /// Writes one tick. Errors are kept for [`finish`](FlightLog::finish).
    fn observe(&mut self, tick: &Tick) {
        self.time = tick.time;
        let mut notes = Vec::new();
        self.status.observe(tick.output.status, tick.time, |note| notes.push(note));
        notes.iter().for_each(|note| self.write(|writer| writer.note(note)));
        if tick.tick.is_multiple_of(self.every) {
            let motors = self.rotors.as_ref().map_or([f32::NAN; MOTORS], |r| r.controls(tick));
            let moment = Moment { tick: *tick, bounds: self.bounds, motors, status: self.mode };
            self.write(|writer| writer.moment(&moment));
        }
    }
}

/// Control ticks between two instants of a log at `rate` (Hz), at least one: the nearest whole number
/// to the ratio of the two periods.
fn ticks_between(rate: f64, period: f64) -> u64 {
    (1.0 / (rate * period)).round().max(1.0) as u64
}

fn open(format: Format, path: &Path, description: &Description) -> io::Result<Box<dyn Writer>> {
    let file = BufWriter::new(File::create(path)?);
    Ok(match format {
        Format::Ulog => Box::new(ulog::UlogWriter::new(file, description)?),
        #[cfg(feature = "mcap")]
        Format::Mcap => Box::new(mcap::McapWriter::new(file, description)?),
    })
}

fn named(name: &str, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{name}: {error}"))
}
