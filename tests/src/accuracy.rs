//! Errors of the core per quantity, against the bounds that `docs/accuracy.md` documents.
//!
//! The page is read by the tests: the documented number is the asserted one.

use std::collections::BTreeMap;

const PAGE: &str = include_str!("../../docs/accuracy.md");

/// The bounds of one quantity: a row of a table of the page.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bound {
    /// Added to the expected magnitude, in the quantity's unit.
    floor: f64,
    /// Of the largest error.
    maximum: f64,
    /// Of the root of the mean square of the errors.
    rms: f64,
}

/// Errors measured so far against one table of the page.
#[derive(Clone, Debug)]
pub struct Accuracy {
    section: &'static str,
    bounds: BTreeMap<&'static str, Bound>,
    errors: BTreeMap<String, Vec<f64>>,
}

impl Accuracy {
    /// Bounds from the table under the page's heading `## section`.
    ///
    /// # Panics
    /// When the page has no such heading or a row that is not `name | floor | maximum | RMS`.
    #[must_use]
    pub fn documented(section: &'static str) -> Self {
        let heading = format!("## {section}\n");
        let (_, body) = PAGE.split_once(&heading).expect("the heading in docs/accuracy.md");
        let body = body.split("\n## ").next().unwrap_or_default();
        let bounds = body.lines().filter(|line| line.starts_with("| `")).map(row).collect();
        Self { section, bounds, errors: BTreeMap::new() }
    }

    /// Notes the error `|actual - expected| / (floor + |expected|)` in the max-norm.
    ///
    /// # Panics
    /// When the page has no row `name`, or a number is not finite.
    pub fn compare(&mut self, name: &str, actual: &[f64], expected: &[f64]) {
        let Some(Bound { floor, .. }) = self.bounds.get(name) else {
            panic!("docs/accuracy.md has no row {name} under {}", self.section)
        };
        assert_eq!(actual.len(), expected.len(), "{name}");
        let largest = |x: &[f64]| x.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let difference: Vec<_> = actual.iter().zip(expected).map(|(a, e)| a - e).collect();
        assert!(difference.iter().all(|d| d.is_finite()), "{name}: {actual:?} for {expected:?}");
        let error = largest(&difference) / (floor + largest(expected));
        self.errors.entry(name.to_owned()).or_default().push(error);
    }

    /// Prints every error beside its bound, and fails if one exceeds it or a row was not measured.
    ///
    /// # Panics
    /// When it fails.
    pub fn check(&self) {
        println!("{}: measured (bound)", self.section);
        let mut broken = Vec::new();
        for (name, bound) in &self.bounds {
            let errors = self.errors.get(*name).map_or(&[][..], Vec::as_slice);
            let maximum = errors.iter().fold(0.0, |m: f64, e| m.max(*e));
            let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
            let Bound { maximum: maximum_bound, rms: rms_bound, .. } = bound;
            let count = errors.len();
            println!(
                "{name:14} maximum {maximum:.1e} ({maximum_bound:.0e}) RMS {rms:.1e} ({rms_bound:.0e}) of {count}"
            );
            if !(maximum <= *maximum_bound && rms <= *rms_bound) {
                broken.push(*name);
            }
        }
        assert!(broken.is_empty(), "{}: beyond the documented error: {broken:?}", self.section);
    }
}

/// ``| `name` | floor | maximum | RMS |``.
fn row(line: &'static str) -> (&'static str, Bound) {
    let cells: Vec<_> = line.split('|').map(str::trim).collect();
    let number = |i: usize| cells[i].parse::<f64>().expect("a number in docs/accuracy.md");
    let name = cells[1].trim_matches('`');
    (name, Bound { floor: number(2), maximum: number(3), rms: number(4) })
}
