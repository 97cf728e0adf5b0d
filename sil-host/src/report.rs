//! Report of a run: the table of guarantees, or the same as JSON.

use std::fmt::Write;
use std::path::PathBuf;

use serde::Serialize;

use sim::guarantee::{Requirement, Verdict};
use sim::number::number;
use sim::scenario::{BUILT_IN, LoadedScenario};

/// Result of one flight.
#[derive(Clone, Debug, Serialize)]
pub struct FlightReport {
    /// The scenario's name.
    pub name: String,
    /// The scenario's description.
    pub description: String,
    /// Assumptions of the theorems that the scenario does not keep, a sentence each.
    pub broken_assumptions: Vec<String>,
    /// The guarantees.
    pub verdicts: Vec<Verdict>,
    /// Simulated time (s).
    pub flight_time: f64,
    /// Time that the flight took, monitors and trace included (s).
    pub wall_time: f64,
    /// Directory of the results.
    pub directory: PathBuf,
}

impl FlightReport {
    /// `true` if every guarantee held.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.verdicts.iter().all(|verdict| verdict.pass)
    }
}

/// Headings of columns of numbers.
const NUMBERS: [&str; 7] =
    ["observed", "margin", "at [s]", "violated", "judged", "least margin", "seed"];
const HEADINGS: [&str; 7] = ["", "guarantee", "bound", "observed", "margin", "unit", "at [s]"];

/// The table of guarantees of one flight; with `only_violated` nothing but violated rows.
#[must_use]
pub fn table(outcome: &FlightReport, only_violated: bool) -> String {
    let shown = |verdict: &&Verdict| !(only_violated && verdict.pass);
    let rows: Vec<_> = outcome.verdicts.iter().filter(shown).map(row).collect();
    if only_violated && rows.is_empty() {
        return String::new();
    }
    let mut text = format!("\n{}: {}\n", outcome.name, outcome.description);
    for sentence in &outcome.broken_assumptions {
        let _ = writeln!(text, "  outside the theorem: {sentence}");
    }
    text += &aligned(&HEADINGS.map(str::to_owned), &rows);
    let result = if outcome.passed() { "every guarantee holds" } else { "a guarantee is VIOLATED" };
    let rate = outcome.flight_time / outcome.wall_time;
    let directory = outcome.directory.display();
    let flown = outcome.flight_time;
    let _ =
        writeln!(text, "  {result}; {flown} s at {rate:.0} x real time; results in {directory}");
    text
}

fn row(verdict: &Verdict) -> [String; 7] {
    let result = match verdict.requirement {
        Requirement::Information => "info",
        _ if verdict.pass => "pass",
        _ => "FAIL",
    };
    let optional = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), number);
    [
        result.to_owned(),
        format!("{} {}", verdict.name, verdict.equation),
        bound(verdict.requirement),
        optional(verdict.observed),
        optional(verdict.margin),
        verdict.unit.to_owned(),
        verdict.time.map_or_else(|| "-".to_owned(), |time| format!("{time:.3}")),
    ]
}

pub(crate) fn bound(requirement: Requirement) -> String {
    match requirement {
        Requirement::AtLeast(bound) => format!(">= {}", number(bound)),
        Requirement::AtMost(bound) => format!("<= {}", number(bound)),
        Requirement::Inside(lower, upper) => format!("[{}, {}]", number(lower), number(upper)),
        Requirement::Information => "-".to_owned(),
    }
}

/// Rows under headings; numbers are aligned to the right, words to the left.
pub(crate) fn aligned<const N: usize>(headings: &[String; N], rows: &[[String; N]]) -> String {
    let widths: [usize; N] = core::array::from_fn(|column| {
        let cells = rows.iter().map(|row| &row[column]);
        cells.chain([&headings[column]]).map(|cell| cell.chars().count()).max().unwrap_or(0)
    });
    let mut text = String::new();
    for row in [headings].into_iter().chain(rows) {
        let mut line = String::from(" ");
        for ((column, cell), width) in row.iter().enumerate().zip(widths) {
            let _ = match NUMBERS.contains(&headings[column].as_str()) {
                true => write!(line, " {cell:>width$} "),
                false => write!(line, " {cell:<width$} "),
            };
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}

/// The outcomes of a run as JSON.
#[must_use]
pub fn json(outcomes: &[FlightReport]) -> String {
    let scenarios: Vec<_> = outcomes
        .iter()
        .map(|outcome| {
            let mut value = serde_json::json!(outcome);
            value["passed"] = outcome.passed().into();
            value
        })
        .collect();
    let passed = outcomes.iter().all(FlightReport::passed);
    format!("{:#}", serde_json::json!({ "passed": passed, "scenarios": scenarios }))
}

/// Names and descriptions of the built-in scenarios.
#[must_use]
pub fn built_in_table() -> String {
    let width = BUILT_IN.iter().map(|scenario| scenario.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for scenario in BUILT_IN {
        let description = LoadedScenario::open(scenario.name, &[])
            .map_or_else(|error| error.to_string(), |it| it.scenario().description.clone());
        let _ = writeln!(text, "{:width$}  {description}", scenario.name);
    }
    text
}
