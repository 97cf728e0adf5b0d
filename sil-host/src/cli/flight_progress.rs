//! Progress of a flight, on standard error: a bar on a terminal, a line elsewhere.

use std::io::IsTerminal;
use std::time::Instant;

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use sim::scenario::Scenario;

/// Progress bar of a flight.
#[derive(Debug)]
pub struct FlightProgressBar {
    bar: ProgressBar,
    name: String,
    flight_time: f64,
    started: Instant,
    lines: bool,
}

impl FlightProgressBar {
    /// A bar for a flight of `scenario`; hidden if `quiet`.
    #[must_use]
    pub fn new(scenario: &Scenario, quiet: bool) -> Self {
        let Scenario { name, duration: flight_time, .. } = scenario;
        let terminal = std::io::stderr().is_terminal();
        let bar = if quiet || !terminal {
            ProgressBar::hidden()
        } else {
            ProgressBar::new(scenario.ticks())
        };
        let template = "{prefix} [{bar:40}] {percent:>3} %  {msg}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_prefix(name.clone());
        bar.set_message("flying");
        let lines = !quiet && !terminal;
        Self { bar, name: name.clone(), flight_time: *flight_time, started: Instant::now(), lines }
    }

    /// Shows the bar among those of other flights.
    #[must_use]
    pub fn among(mut self, others: &MultiProgress) -> Self {
        if !self.bar.is_hidden() {
            self.bar = others.add(self.bar);
        }
        self
    }

    /// Advances the bar by `ticks`.
    pub fn advance(&self, ticks: u64) {
        self.bar.inc(ticks);
    }

    /// Ends the bar with a line on the time that the flight took.
    pub fn finish(self) {
        let took = self.started.elapsed();
        self.bar.finish_and_clear();
        if self.lines {
            let (name, flown, took) = (&self.name, self.flight_time, took.as_secs_f64());
            eprintln!("{name}: flew {flown} s in {took:.2} s, {:.0} x real time", flown / took);
        }
    }
}
