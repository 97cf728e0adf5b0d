//! Progress of a campaign, on standard error: a bar on a terminal, a line now and then elsewhere.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::sync::PoisonError;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// Time between two lines.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Shows how far a campaign has come, how fast it goes and how long it will take.
#[derive(Debug)]
pub struct Progress {
    name: String,
    bar: ProgressBar,
    lines: bool,
    total: u32,
    started: Instant,
    flown: Mutex<Flown>,
}

/// What has been flown since the start.
#[derive(Clone, Copy, Debug, Default)]
struct Flown {
    runs: u32,
    /// Runs of earlier sessions.
    before: u32,
    /// Simulated time (s).
    time: f64,
    /// Lines shown.
    lines: u32,
}

impl Progress {
    /// Of `total` runs, of which `before` have been flown earlier.
    #[must_use]
    pub fn new(name: &str, total: u32, before: u32, quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let bar = match quiet || !terminal {
            true => ProgressBar::hidden(),
            false => ProgressBar::new(total.into()).with_position(before.into()),
        };
        if let Ok(style) =
            ProgressStyle::with_template("{prefix} [{bar:30}] {pos}/{len} runs  {msg}")
        {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_prefix(name.to_owned());
        let flown = Mutex::new(Flown { before, ..Flown::default() });
        let lines = !quiet && !terminal;
        Self { name: name.to_owned(), bar, lines, total, started: Instant::now(), flown }
    }

    /// A run has been flown, `time` (s) of flight in all its variants.
    pub fn flown(&self, time: f64) {
        let mut flown = self.flown.lock().unwrap_or_else(PoisonError::into_inner);
        flown.runs += 1;
        flown.time += time;
        let done = flown.before + flown.runs;
        self.bar.inc(1);
        if !self.bar.is_hidden() {
            self.bar.set_message(self.rates(&flown));
        }
        if self.lines && self.started.elapsed() > LINE_EVERY * (flown.lines + 1) {
            flown.lines += 1;
            let (name, total) = (&self.name, self.total);
            eprintln!("{name}: {done}/{total} runs, {}", self.rates(&flown));
        }
    }

    /// Speed so far and time left.
    fn rates(&self, flown: &Flown) -> String {
        let elapsed = self.started.elapsed().as_secs_f64().max(1e-9);
        let rate = f64::from(flown.runs) / elapsed;
        let left = f64::from(self.total - flown.before - flown.runs) / rate;
        let real_time = flown.time / elapsed;
        format!("{rate:.1} runs/s, {real_time:.0} x real time, {} left", duration(left))
    }

    /// The last run has been flown; returns how long it took.
    pub fn finish(self) -> Duration {
        let took = self.started.elapsed();
        self.bar.finish_and_clear();
        let flown = self.flown.into_inner().unwrap_or_else(PoisonError::into_inner);
        if self.lines && flown.runs > 0 {
            let (name, seconds) = (&self.name, took.as_secs_f64());
            let (rate, real_time) = (f64::from(flown.runs) / seconds, flown.time / seconds);
            let runs = flown.runs;
            eprintln!(
                "{name}: flew {runs} runs in {}, {rate:.1} runs/s, {real_time:.0} x real time",
                duration(seconds)
            );
        }
        took
    }
}

/// A time in the unit that suits it.
fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..100 => format!("{seconds:.1} s"),
        100..7_200 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::duration;

    #[test]
    fn times_are_told_in_the_unit_that_suits_them() {
        assert_eq!(duration(3.26), "3.3 s");
        assert_eq!(duration(125.2), "2 min 5 s");
        assert_eq!(duration(7_260.0), "2 h 1 min");
    }
}
