//! Bounds of the tracking errors, read from `docs/verification.md`: the documented number is the
//! asserted one.

use super::{Errors, Kind};

const PAGE: &str = include_str!("../../../docs/verification.md");

/// Bounds after settling under `kind`, from the table under the page's heading `## section`.
///
/// # Panics
/// When the page has no such heading, no row for `kind`, or a row that is not
/// `kind | position | attitude | tilt | heading`.
#[must_use]
pub fn documented(section: &str, kind: Kind) -> Errors {
    let heading = format!("## {section}\n");
    let (_, body) = PAGE.split_once(&heading).expect("the heading in docs/verification.md");
    let body = body.split("\n## ").next().unwrap_or_default();
    let start = format!("| `{kind:?}` |");
    let row = body.lines().find(|line| line.starts_with(&start)).expect("a row for every kind");
    let cells: Vec<_> = row.split('|').map(str::trim).collect();
    let number = |i: usize| cells[i].parse::<f64>().expect("a number in docs/verification.md");
    Errors { position: number(2), attitude: number(3), tilt: number(4), heading: number(5) }
}
