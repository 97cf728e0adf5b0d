//! Notes in a log: status flags that come and go, and the verdicts on the guarantees.

use ctrl_core::controller::StepStatus;

use crate::report;
use sim::guarantee::{Requirement, Verdict};

/// Severity of a note.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// As expected.
    Info,
    /// The law was not evaluated as written.
    Warning,
    /// A fault, or a violated guarantee.
    Error,
}

/// A sentence about an instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Note {
    /// Time (s).
    pub time: f64,
    /// Severity.
    pub level: Level,
    /// The sentence, one line.
    pub text: String,
}

impl Note {
    /// The note of a verdict, at the end of the flight.
    #[must_use]
    pub fn verdict(verdict: &Verdict, time: f64) -> Self {
        let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), sim::number::number);
        let Verdict { name, equation, unit, requirement, observed, .. } = verdict;
        let observed = number(*observed);
        let (level, text) = match requirement {
            Requirement::Information => {
                (Level::Info, format!("{name} {equation}: {observed} {unit}"))
            }
            _ => {
                let (level, result) =
                    if verdict.pass { (Level::Info, "holds") } else { (Level::Error, "VIOLATED") };
                let (bound, margin) = (report::bound(*requirement), number(verdict.margin));
                let text = format!(
                    "guarantee {result}: {name} {equation}: {observed} {unit}, bound {bound}, margin {margin}"
                );
                (level, text)
            }
        };
        Self { time, level, text }
    }
}

/// A flag that has been clear for this long has ended; until then it only flickers (s).
const CLEAR: f64 = 1.0;

/// Limits that are part of the law.
const LIMITS: StepStatus = StepStatus::TORQUE_SATURATED
    .union(StepStatus::MASS_PROJECTED)
    .union(StepStatus::INERTIA_PROJECTED);

/// Turns status flags into notes: one when a flag comes, one when it has gone.
#[derive(Clone, Debug, Default)]
pub struct StatusNotes {
    active: Vec<Active>,
}

/// A flag that has come and not yet gone.
#[derive(Clone, Debug)]
struct Active {
    flag: StepStatus,
    name: String,
    ticks: u64,
    latest: f64,
}

impl StatusNotes {
    /// Processes the status at `time` (s); passes notes on flags that came or went to `note`.
    pub fn observe(&mut self, status: StepStatus, time: f64, mut note: impl FnMut(Note)) {
        if status.is_empty() && self.active.is_empty() {
            return;
        }
        let mut new = status;
        self.active.retain_mut(|active| {
            new.remove(active.flag);
            if status.contains(active.flag) {
                active.ticks += 1;
                active.latest = time;
            }
            let gone = time - active.latest >= CLEAR;
            if gone {
                note(active.end(time, "ended"));
            }
            !gone
        });
        for (name, flag) in new.iter_names() {
            let name = name.to_lowercase().replace('_', " ");
            note(Note { time, level: level(flag), text: name.clone() });
            self.active.push(Active { flag, name, ticks: 1, latest: time });
        }
    }

    /// Ends the flight at `time` (s).
    pub fn finish(&mut self, time: f64, note: impl FnMut(Note)) {
        self.active.drain(..).map(|active| active.end(time, "until the end")).for_each(note);
    }
}

impl Active {
    fn end(&self, time: f64, how: &str) -> Note {
        let Self { name, ticks, latest, .. } = self;
        let text = format!("{name}: {how}, {ticks} ticks, latest at {latest:.3} s");
        Note { time, level: Level::Info, text }
    }
}

fn level(flag: StepStatus) -> Level {
    if StepStatus::FAULT.contains(flag) {
        Level::Error
    } else if LIMITS.contains(flag) {
        Level::Info
    } else {
        Level::Warning
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::guarantee::verdict::Extreme;

    const TORQUE: StepStatus = StepStatus::TORQUE_SATURATED;
    const HELD: StepStatus = StepStatus::OUTPUT_HELD;
    const FLIPPED: StepStatus = StepStatus::SIGN_FLIPPED;

    /// The notes on these states, 0.1 s apart.
    fn notes(states: impl IntoIterator<Item = StepStatus>) -> Vec<(Level, String)> {
        let (mut status, mut notes, mut time) = (StatusNotes::default(), Vec::new(), 0.0);
        let mut keep = |note: Note| notes.push((note.level, note.text));
        for state in states {
            status.observe(state, time, &mut keep);
            time += 0.1;
        }
        status.finish(time, &mut keep);
        notes
    }

    #[test]
    fn nothing_is_noted_of_a_flight_without_flags() {
        assert_eq!(notes([StepStatus::empty(); 50]), []);
    }

    #[test]
    fn a_flag_that_flickers_comes_once_and_ends_once() {
        let flicker = (0..20).map(|i| if i % 2 == 0 { TORQUE } else { StepStatus::empty() });
        let said = notes(flicker.chain([StepStatus::empty(); 15]));
        let ended = "torque saturated: ended, 10 ticks, latest at 1.800 s".to_owned();
        assert_eq!(said, [(Level::Info, "torque saturated".to_owned()), (Level::Info, ended)]);
    }

    #[test]
    fn each_flag_has_its_level_and_its_own_end() {
        let said = notes([HELD | FLIPPED, HELD, TORQUE | HELD]);
        let of = |level, text: &str| (level, text.to_owned());
        assert_eq!(
            said,
            [
                of(Level::Error, "output held"),
                of(Level::Warning, "sign flipped"),
                of(Level::Info, "torque saturated"),
                of(Level::Info, "output held: until the end, 3 ticks, latest at 0.200 s"),
                of(Level::Info, "sign flipped: until the end, 1 ticks, latest at 0.000 s"),
                of(Level::Info, "torque saturated: until the end, 1 ticks, latest at 0.200 s"),
            ]
        );
    }

    #[test]
    fn a_violated_guarantee_is_an_error() {
        let note = |value| {
            let requirement = Requirement::AtMost(2.0);
            let names = ("position error", "(5)", "m");
            Note::verdict(&Verdict::new(names, requirement, Extreme::at(value, 3.0)), 9.0)
        };
        let expected = "guarantee VIOLATED: position error (5): 2.5 m, bound <= 2, margin -0.5";
        assert_eq!(note(2.5), Note { time: 9.0, level: Level::Error, text: expected.to_owned() });
        assert_eq!(note(1.5).level, Level::Info);
    }
}
