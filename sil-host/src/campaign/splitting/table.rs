//! The flights of a campaign by splitting, in the order in which they were asked for: `flights.csv`.

use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::replica::Score;
use super::walk::Place;
use crate::campaign::error::CampaignError;
use crate::campaign::plan::Campaign;
use crate::campaign::row::{Observed, RunOutcome};
use crate::campaign::store::{end_of_lines, open_table};
use crate::campaign::table::Line;

/// File of the table in a directory of results.
pub const FLIGHTS: &str = "flights.csv";

/// One flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Flight {
    /// Number of its replica.
    pub replica: u32,
    /// Its seed.
    pub seed: u32,
    /// Varied values.
    pub values: Vec<f64>,
    /// Outcome of the guarantee that is climbed.
    pub outcome: RunOutcome,
    /// What it observed.
    pub seen: Observed,
}

impl Flight {
    /// Its score; none if it was refused.
    pub fn score(&self) -> Score {
        if self.outcome == RunOutcome::Refused {
            return None;
        }
        Some(match (self.seen.observed, self.seen.margin) {
            (Some(_), None) => f64::NEG_INFINITY, // information
            (_, Some(margin)) if !margin.is_nan() => -margin,
            _ => f64::INFINITY,
        })
    }

    /// `true` if it is the flight of `place` in `replica`.
    pub fn is_of(&self, replica: u32, place: &Place, values: &[f64]) -> bool {
        (self.replica, self.seed) == (replica, place.seed) && self.values == values
    }

    fn line(&self, kept: bool) -> String {
        let mut line = Line::default();
        line.text(&self.replica.to_string());
        line.text(&self.seed.to_string());
        self.values.iter().for_each(|value| line.number(Some(*value)));
        line.text(self.outcome.name());
        line.number(self.seen.observed);
        line.number(self.seen.margin);
        line.text(if kept { "kept" } else { "left" });
        line.end()
    }

    fn read(record: &csv::StringRecord, parameters: usize) -> Option<Self> {
        let mut cells = record.iter();
        let replica = cells.next()?.parse().ok()?;
        let seed = cells.next()?.parse().ok()?;
        let values =
            cells.by_ref().take(parameters).map(|it| it.parse().ok()).collect::<Option<_>>()?;
        let outcome = RunOutcome::named(cells.next()?)?;
        let mut number = || match cells.next()? {
            "" => Some(None),
            cell => cell.parse().ok().map(Some),
        };
        let seen = Observed { observed: number()?, margin: number()? };
        Some(Self { replica, seed, values, outcome, seen })
    }
}

/// The table, open at its end, and the flights that it held.
#[derive(Debug)]
pub struct Flights {
    path: PathBuf,
    file: File,
    held: std::vec::IntoIter<Flight>,
}

impl Flights {
    /// Opens the table in `directory`, or begins it; with `restart`, anew. A torn end is cut off.
    ///
    /// # Errors
    /// When the directory holds another campaign, another process fills it, or it cannot be read or written.
    pub fn open(
        directory: &Path,
        campaign: &Campaign,
        restart: bool,
    ) -> Result<Self, CampaignError> {
        let (path, mut file) = open_table(directory, FLIGHTS, campaign, restart)?;
        let failed = CampaignError::io(&path);
        let length = end_of_lines(&mut file).map_err(&failed)?;
        file.set_len(length).map_err(&failed)?;
        file.rewind().map_err(&failed)?;
        let header = header(campaign);
        let held = if length == 0 {
            file.write_all(header.as_bytes()).map_err(&failed)?;
            Vec::new()
        } else {
            read(&file, &path, &header, campaign.parameters().len())?
        };
        file.seek(SeekFrom::End(0)).map_err(&failed)?;
        drop(failed);
        Ok(Self { path, file, held: held.into_iter() })
    }

    /// Flights that were held and have not been taken.
    pub fn held(&self) -> usize {
        self.held.len()
    }

    /// The next flight that was held.
    pub fn take(&mut self) -> Option<Flight> {
        self.held.next()
    }

    /// Appends a flight.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn append(&mut self, flight: &Flight, kept: bool) -> Result<(), CampaignError> {
        let line = flight.line(kept);
        self.file.write_all(line.as_bytes()).map_err(CampaignError::io(&self.path))
    }

    /// The fault of a table whose flights are not those of its definition.
    pub fn foreign(&self) -> CampaignError {
        let message =
            "has flights that do not follow from its campaign.toml; restart to overwrite them";
        CampaignError::Results(self.path.clone(), message.to_owned())
    }
}

/// The line that names the columns, with its end.
fn header(campaign: &Campaign) -> String {
    let mut line = Line::default();
    ["replica", "seed"].iter().for_each(|name| line.text(name));
    campaign.parameters().iter().for_each(|parameter| line.text(&parameter.column()));
    ["outcome", "observed", "margin", "walk"].iter().for_each(|name| line.text(name));
    line.end()
}

fn read(
    file: &File,
    path: &Path,
    header: &str,
    parameters: usize,
) -> Result<Vec<Flight>, CampaignError> {
    let fault = |message: String| CampaignError::Results(path.to_owned(), message);
    let mut records = csv::Reader::from_reader(file);
    let names = records.headers().map_err(|error| fault(error.to_string()))?;
    let mut found = Line::default();
    names.iter().for_each(|name| found.text(name));
    if found.end() != *header {
        return Err(fault(
            "has other columns than this program writes for its campaign.toml".to_owned(),
        ));
    }
    let mut flights = Vec::new();
    for record in records.records() {
        let record = record.map_err(|error| fault(error.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let flight = Flight::read(&record, parameters);
        flights.push(flight.ok_or_else(|| fault(format!("line {line} is not a flight")))?);
    }
    Ok(flights)
}
