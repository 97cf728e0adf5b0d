//! Progress of a campaign, on standard error: a bar on a terminal, a line now and then elsewhere.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::sync::PoisonError;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use sil_host::campaign::CampaignProgress;

/// Time between two lines.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Progress of a campaign: share flown, rate and remaining time.
#[derive(Debug)]
pub struct CampaignProgressBar {
    name: String,
    bar: ProgressBar,
    lines: bool,
    started: Instant,
    flown: Mutex<Flown>,
}

/// Runs and simulated time flown.
#[derive(Clone, Copy, Debug, Default)]
struct Flown {
    /// Runs in all.
    total: u32,
    runs: u32,
    /// Runs of earlier sessions.
    before: u32,
    /// Runs of this session that violated a guarantee.
    violated: u32,
    /// Simulated time (s).
    time: f64,
    /// Lines shown.
    lines: u32,
}

impl CampaignProgressBar {
    /// A bar for the campaign `name`; hidden if `quiet`.
    #[must_use]
    pub fn new(name: &str, quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let bar = if quiet || !terminal { ProgressBar::hidden() } else { ProgressBar::new(0) };
        if let Ok(style) =
            ProgressStyle::with_template("{prefix} [{bar:30}] {pos}/{len} runs  {msg}")
        {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_prefix(name.to_owned());
        let lines = !quiet && !terminal;
        let flown = Mutex::new(Flown::default());
        Self { name: name.to_owned(), bar, lines, started: Instant::now(), flown }
    }

    /// Speed so far and time left.
    fn rates(&self, flown: &Flown) -> String {
        let elapsed = self.started.elapsed().as_secs_f64().max(1e-9);
        let rate = f64::from(flown.runs) / elapsed;
        let left = f64::from(flown.total - flown.before - flown.runs) / rate;
        let real_time = flown.time / elapsed;
        let violated = flown.violated;
        let left = duration(left);
        format!("{violated} violated, {rate:.1} runs/s, {real_time:.0} x real time, {left} left")
    }

    /// Ends the bar with a line on the runs flown.
    pub fn finish(self) {
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
    }
}

impl CampaignProgress for CampaignProgressBar {
    fn begin(&self, total: u32, before: u32) {
        self.bar.set_length(total.into());
        self.bar.set_position(before.into());
        let mut flown = self.flown.lock().unwrap_or_else(PoisonError::into_inner);
        (flown.total, flown.before) = (total, before);
    }

    fn run_completed(&self, flight_time: f64, violated: bool) {
        let mut flown = self.flown.lock().unwrap_or_else(PoisonError::into_inner);
        flown.runs += 1;
        flown.time += flight_time;
        flown.violated += u32::from(violated);
        let done = flown.before + flown.runs;
        self.bar.inc(1);
        if !self.bar.is_hidden() {
            self.bar.set_message(self.rates(&flown));
        }
        if self.lines && self.started.elapsed() > LINE_EVERY * (flown.lines + 1) {
            flown.lines += 1;
            let (name, total) = (&self.name, flown.total);
            eprintln!("{name}: {done}/{total} runs, {}", self.rates(&flown));
        }
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
