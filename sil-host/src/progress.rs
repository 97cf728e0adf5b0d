//! Progress of a flight, on standard error: a bar on a terminal, a line elsewhere.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// Shows how far a flight has come.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
    name: String,
    flight_time: f64,
    started: Instant,
    lines: bool,
}

impl Progress {
    /// A flight of `ticks` control ticks that lasts `flight_time` (s).
    #[must_use]
    pub fn new(name: &str, ticks: u64, flight_time: f64, quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let bar = if quiet || !terminal { ProgressBar::hidden() } else { ProgressBar::new(ticks) };
        let template = "{prefix} [{bar:40}] {percent:>3} %  {msg}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_prefix(name.to_owned());
        let lines = !quiet && !terminal;
        Self { bar, name: name.to_owned(), flight_time, started: Instant::now(), lines }
    }

    /// `ticks` more have been flown.
    pub fn advance(&self, ticks: u64) {
        self.bar.inc(ticks);
    }

    /// What is being done now.
    pub fn message(&self, message: &'static str) {
        self.bar.set_message(message);
    }

    /// The flight is over; returns how long it took.
    pub fn finish(self) -> Duration {
        let took = self.started.elapsed();
        self.bar.finish_and_clear();
        if self.lines {
            let (name, flown, took) = (&self.name, self.flight_time, took.as_secs_f64());
            eprintln!("{name}: flew {flown} s in {took:.2} s, {:.0} x real time", flown / took);
        }
        took
    }
}
