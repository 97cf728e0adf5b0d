//! The results as a table: `runs.csv`, a row a run and variant, by seed and then by variant.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

use super::error::CampaignError;
use super::measures::MEASURES;
use super::plan::Campaign;
use super::read::CampaignOverrides;
use super::row::{BROKEN, KEPT, Observed, Row, RunOutcome};

/// File of the definition in a directory of results.
pub const DEFINITION: &str = "campaign.toml";
/// File of the table in a directory of results.
pub const TABLE: &str = "runs.csv";

/// Columns before the varied values and between them and the measures.
const FIRST: [(&str, &str); 2] = [("seed", "seed of the run"), ("variant", "name of the variant")];
const VERDICT: [(&str, &str); 3] = [
    ("outcome", "held, violated or refused"),
    ("reason", "the guarantees that were violated, or the reason for the refusal"),
    (
        "assumptions",
        "kept, or broken: vehicle, disturbance or rotors leave what the controller was told",
    ),
];

/// A column of the table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its name: letters, digits, `_` and `.`, so that no tool needs more than quotes around it.
    pub name: String,
    /// Unit of its values; empty for words and counts, and where the definition does not tell.
    pub unit: String,
    /// Meaning in words.
    pub meaning: String,
}

impl Column {
    fn new(name: &str, unit: &str, meaning: &str) -> Self {
        Self { name: name.to_owned(), unit: unit.to_owned(), meaning: meaning.to_owned() }
    }
}

/// The columns, in order.
#[must_use]
pub fn columns(campaign: &Campaign) -> Vec<Column> {
    let words = |it: &(&str, &str)| Column::new(it.0, "", it.1);
    let parameters = campaign.parameters().iter().map(|it| {
        let meaning = format!("{} of the scenario", it.path);
        Column::new(&it.column(), &it.unit, &meaning)
    });
    let measures = MEASURES.iter().map(|it| Column::new(it.key, it.unit, it.label));
    let guarantees = campaign.guarantees().iter().flat_map(|it| {
        let column = |end: &str, meaning: &str| {
            let (name, meaning) = (format!("{}.{end}", it.key), format!("{}: {meaning}", it.name));
            Column::new(&name, it.unit, &meaning)
        };
        [column("observed", "value closest to its bound"), column("margin", "distance from it")]
    });
    let first = FIRST.iter().map(words).chain(parameters);
    first.chain(VERDICT.iter().map(words)).chain(measures).chain(guarantees).collect()
}

/// The line that names the columns, with its end.
#[must_use]
pub fn header(campaign: &Campaign) -> String {
    let mut line = Line::default();
    columns(campaign).iter().for_each(|column| line.text(&column.name));
    line.end()
}

/// A row as a line of the table, with its end.
#[must_use]
pub fn line(campaign: &Campaign, row: &Row) -> String {
    let mut line = Line::default();
    line.text(&row.seed.to_string());
    line.text(&campaign.variants()[row.variant].name);
    row.parameters.iter().for_each(|value| line.number(Some(*value)));
    line.text(row.outcome.name());
    line.text(&row.reason);
    line.text(row.assumptions());
    row.measures.iter().for_each(|value| line.number(*value));
    for guarantee in &row.guarantees {
        line.number(guarantee.observed);
        line.number(guarantee.margin);
    }
    line.end()
}

/// A line in the making: cells, each with a comma after it.
#[derive(Debug, Default)]
pub(super) struct Line(String);

impl Line {
    /// A cell, in quotes where it needs them; it must hold no line break.
    pub fn text(&mut self, text: &str) {
        if text.contains([',', '"', '\n', '\r']) {
            self.0.push('"');
            self.0.push_str(&text.replace(['\n', '\r'], " ").replace('"', "\"\""));
            self.0.push('"');
        } else {
            self.0.push_str(text);
        }
        self.0.push(',');
    }

    /// The shortest decimals that read back as the same number.
    pub fn number(&mut self, value: Option<f64>) {
        if let Some(value) = value {
            self.0.push_str(zmij::Buffer::new().format(value));
        }
        self.0.push(',');
    }

    /// The line with its end.
    pub fn end(mut self) -> String {
        self.0.pop();
        self.0.push('\n');
        self.0
    }
}

/// Message for a directory without results, which names those directly below it that have some.
fn no_results(directory: &Path) -> String {
    let entries = std::fs::read_dir(directory).into_iter().flatten().flatten();
    let mut below: Vec<_> = entries
        .map(|entry| entry.path())
        .filter(|path| path.join(DEFINITION).is_file())
        .map(|path| path.display().to_string())
        .collect();
    below.sort();
    match below.as_slice() {
        [] => format!("no results here: {DEFINITION} is missing; name the directory of a campaign"),
        below => format!(
            "no results here, but in the directory below it: give {} instead",
            below.join(" or ")
        ),
    }
}

/// A directory of results: the campaign that it holds, and the table of its runs.
#[derive(Clone, Debug)]
pub struct CampaignResults {
    directory: PathBuf,
    campaign: Campaign,
}

impl CampaignResults {
    /// Reads the definition in `directory`.
    ///
    /// # Errors
    /// When there is none or it is not valid.
    pub fn open(directory: &Path) -> Result<Self, CampaignError> {
        let path = directory.join(DEFINITION);
        let text = match std::fs::read_to_string(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return Err(CampaignError::Results(directory.to_owned(), no_results(directory)));
            }
            text => text.map_err(CampaignError::io(&path))?,
        };
        let name = path.display().to_string();
        let campaign =
            Campaign::parse(&name, &text, directory, &CampaignOverrides::default(), &[])?;
        Ok(Self { directory: directory.to_owned(), campaign })
    }

    /// Directory of the results.
    #[must_use]
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// The campaign.
    #[must_use]
    pub fn campaign(&self) -> &Campaign {
        &self.campaign
    }

    /// The rows from the first on, one at a time: the table may be larger than memory.
    ///
    /// # Errors
    /// When the table cannot be read or has other columns than this program writes.
    pub fn rows(&self) -> Result<RowReader<'_, File>, CampaignError> {
        let path = self.directory.join(TABLE);
        let file = File::open(&path).map_err(CampaignError::io(&path))?;
        RowReader::new(&self.campaign, file, &path)
    }
}

/// Reads a table row by row; ends after the first error.
#[derive(Debug)]
pub struct RowReader<'a, R> {
    campaign: &'a Campaign,
    records: csv::Reader<R>,
    record: csv::StringRecord,
    path: PathBuf,
    failed: bool,
}

impl<'a, R: Read> RowReader<'a, R> {
    /// Reads from `input`, which needs no buffer of its own; `path` is what errors call it.
    ///
    /// # Errors
    /// When it cannot be read or has other columns than this program writes.
    pub fn new(campaign: &'a Campaign, input: R, path: &Path) -> Result<Self, CampaignError> {
        let mut records = csv::Reader::from_reader(input);
        let header = records.headers().map_err(|error| unreadable(path, &error))?;
        if !header.iter().eq(columns(campaign).iter().map(|column| column.name.as_str())) {
            let message = "has other columns than this program writes for its campaign.toml";
            return Err(CampaignError::Results(path.to_owned(), message.to_owned()));
        }
        let record = csv::StringRecord::new();
        Ok(Self { campaign, records, record, path: path.to_owned(), failed: false })
    }

    /// Bytes of the table up to the end of the row that was read last.
    #[must_use]
    pub fn position(&self) -> u64 {
        self.records.position().byte()
    }

    fn read(&mut self) -> Result<Option<Row>, CampaignError> {
        let more = self.records.read_record(&mut self.record);
        if !more.map_err(|error| unreadable(&self.path, &error))? {
            return Ok(None);
        }
        row(self.campaign, &self.record).map(Some).ok_or_else(|| {
            let line = self.record.position().map_or(0, csv::Position::line);
            CampaignError::Results(self.path.clone(), format!("line {line} is not a row of runs"))
        })
    }
}

impl<R: Read> Iterator for RowReader<'_, R> {
    type Item = Result<Row, CampaignError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
            return None;
        }
        let row = self.read();
        self.failed = row.is_err();
        row.transpose()
    }
}

fn unreadable(path: &Path, error: &csv::Error) -> CampaignError {
    CampaignError::Results(path.to_owned(), error.to_string())
}

/// The row that a record holds; none if it does not hold one.
fn row(campaign: &Campaign, record: &csv::StringRecord) -> Option<Row> {
    let mut cells = record.iter();
    let seed = cells.next()?.parse().ok()?;
    let variant = cells.next()?;
    let variant = campaign.variants().iter().position(|known| known.name == variant)?;
    let parameters = cells.by_ref().take(campaign.parameters().len());
    let parameters = parameters.map(|cell| cell.parse().ok()).collect::<Option<_>>()?;
    let outcome = RunOutcome::named(cells.next()?)?;
    let reason = cells.next()?.to_owned();
    let assumptions_kept = match cells.next()? {
        KEPT => true,
        BROKEN => false,
        _ => return None,
    };
    let measures = cells.by_ref().take(MEASURES.len()).map(number).collect::<Option<_>>()?;
    let mut guarantees = Vec::with_capacity(campaign.guarantees().len());
    while let (Some(observed), Some(margin)) = (cells.next(), cells.next()) {
        guarantees.push(Observed { observed: number(observed)?, margin: number(margin)? });
    }
    Some(Row { seed, variant, parameters, outcome, reason, assumptions_kept, measures, guarantees })
}

/// The number in a cell, which may be empty; none if it is something else.
#[allow(clippy::option_option, reason = "an empty cell is not a fault")]
fn number(cell: &str) -> Option<Option<f64>> {
    if cell.is_empty() { Some(None) } else { cell.parse().ok().map(Some) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO_VARIANTS: &str = r#"
name = "two"
description = "Both controllers."
sampling = "monte_carlo"
runs = 4
first_seed = 7
[[variant]]
name = "first"
scenario = "paper-robust-adaptive"
[[variant]]
name = "second"
scenario = "paper-saturated"
set = ["duration=3"]
[[vary]]
path = "vehicle.inertia"
rigid_body = { lower = 0.03, upper = 0.12 }
[[vary]]
path = "vehicle.mass"
normal = { mean = 0.85, deviation = 0.05 }
"#;

    fn campaign() -> Campaign {
        Campaign::parse("two.toml", TWO_VARIANTS, Path::new(""), &CampaignOverrides::default(), &[])
            .unwrap()
    }

    fn rows() -> Vec<Row> {
        let campaign = campaign();
        let guarantees = campaign.guarantees().len();
        let row = |index: u32, outcome, reason: &str| Row {
            seed: campaign.seed(index),
            variant: index as usize % 2,
            parameters: campaign.values(index),
            outcome,
            reason: reason.to_owned(),
            assumptions_kept: index != 2,
            measures: (0..MEASURES.len()).map(|i| (i % 3 != 0).then(|| i as f64 / 3.0)).collect(),
            guarantees: vec![
                Observed { observed: Some(f64::NEG_INFINITY), margin: None };
                guarantees
            ],
        };
        vec![
            row(0, RunOutcome::Held, ""),
            row(1, RunOutcome::Violated, "thrust, highest; \"quoted\""),
            row(2, RunOutcome::Refused, "a, b"),
        ]
    }

    #[test]
    fn rows_read_back_as_written() {
        let campaign = campaign();
        let rows = rows();
        let mut text = header(&campaign);
        rows.iter().for_each(|row| text += &line(&campaign, row));
        let read = RowReader::new(&campaign, text.as_bytes(), Path::new(TABLE)).unwrap();
        assert_eq!(read.collect::<Result<Vec<_>, _>>().unwrap(), rows);
    }

    #[test]
    fn columns_are_named_after_fields_measures_and_guarantees() {
        let columns = columns(&campaign());
        let names: Vec<_> = columns.iter().map(|column| column.name.as_str()).collect();
        let expected = ["seed", "variant", "vehicle.inertia.0", "vehicle.inertia.1"];
        assert_eq!(names[..4], expected);
        let expected = ["vehicle.inertia.2", "vehicle.mass", "outcome", "reason", "assumptions"];
        assert_eq!(names[4..9], expected);
        assert!(names.contains(&"thrust_highest_against_m_f.margin"));
        let unique: std::collections::HashSet<_> = names.iter().collect();
        assert_eq!(unique.len(), names.len());
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.');
        assert!(names.iter().all(|name| name.chars().all(plain)), "{names:?}");
        assert!(columns.iter().all(|column| !column.meaning.is_empty()));
    }

    #[test]
    fn what_is_no_row_is_named_with_its_line() {
        let campaign = campaign();
        let start = header(&campaign) + &line(&campaign, &rows()[0]);
        let fault = |text: String| {
            let rows = RowReader::new(&campaign, text.as_bytes(), Path::new(TABLE)).unwrap();
            let read: Result<Vec<_>, _> = rows.collect();
            read.expect_err("refused").to_string()
        };
        let other = line(&campaign, &rows()[1]).replace("second", "third");
        assert_eq!(fault(start.clone() + &other), "runs.csv: line 3 is not a row of runs");
        assert!(fault(start + "8,first,0.1\n").contains("line: 3"));
        let error = RowReader::new(&campaign, "seed,name\n".as_bytes(), Path::new(TABLE)).err();
        assert!(error.expect("refused").to_string().contains("other columns"));
    }

    #[test]
    fn the_definition_of_the_results_is_complete_and_stands_for_itself() {
        let campaign = campaign();
        let text = campaign.text();
        let again = Campaign::parse(
            "campaign.toml",
            &text,
            Path::new("nowhere"),
            &CampaignOverrides::default(),
            &[],
        )
        .unwrap();
        assert_eq!(again.text(), text);
        assert_eq!(again.values(3), campaign.values(3));
        assert!(text.contains("[scenarios]") && text.contains("[controller.saturated]"), "{text}");
    }
}
