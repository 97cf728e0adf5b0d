//! `merge`: joins the parts of a campaign that several machines flew.

use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::error::CampaignError;
use super::fly::conclude;
use super::store::{Order, write_whole};
use super::summary::Summary;
use super::table::{CampaignResults, DEFINITION, TABLE, header};

/// A directory of results: its first run and the one after its last.
#[derive(Debug)]
struct Part {
    results: CampaignResults,
    first: u32,
    end: u32,
}

/// Joins the results of shares, in any order, to the bytes that the whole campaign would have had in
/// one go, below `out`.
///
/// # Errors
/// When parts belong to different campaigns, overlap, leave a gap, or cannot be read or written.
pub fn merge(directories: &[PathBuf], out: &Path) -> Result<Summary, CampaignError> {
    let mut parts = directories.iter().map(|it| Part::open(it)).collect::<Result<Vec<_>, _>>()?;
    parts.sort_by_key(|part| part.first);
    check(&parts)?;
    let Some(Part { results, .. }) = parts.first() else {
        return Err(CampaignError::Usage("no parts to merge".to_owned()));
    };
    let directory = out.join(results.campaign().name());
    if parts.iter().any(|part| same(part.results.directory(), &directory)) {
        let message = "is both a part and the result; choose another output directory".to_owned();
        return Err(CampaignError::Results(directory, message));
    }
    fs::create_dir_all(&directory).map_err(CampaignError::io(&directory))?;
    let table = directory.join(TABLE);
    join(&parts, &table).map_err(CampaignError::io(&table))?;
    let text = results.campaign().text();
    write_whole(&directory.join(DEFINITION), text.as_bytes())?;
    conclude(&CampaignResults::open(&directory)?, true)
}

impl Part {
    /// Reads through a part and checks its order; what is torn or missing is an error.
    fn open(directory: &Path) -> Result<Self, CampaignError> {
        let results = CampaignResults::open(directory)?;
        let fault = |message: String| CampaignError::Results(directory.to_owned(), message);
        let campaign = results.campaign();
        let mut rows = results.rows()?;
        let Some(first) = rows.next().transpose()? else {
            return Err(fault("has no runs".to_owned()));
        };
        let number = campaign.index(first.seed);
        let number = number.ok_or_else(|| fault(format!("seed {} is not its own", first.seed)))?;
        let mut order = Order::new(campaign, number);
        order.check(&first).map_err(fault)?;
        for row in rows {
            order.check(&row?).map_err(fault)?;
        }
        let (end, variant) = (order.index, order.variant);
        if variant != 0 {
            let message = format!("seed {} is not complete: continue it", campaign.seed(end));
            return Err(fault(message));
        }
        Ok(Self { results, first: number, end })
    }
}

/// Checks that the parts, ordered by first run, make up one campaign.
fn check(parts: &[Part]) -> Result<(), CampaignError> {
    let fault = |part: &Part, message: String| {
        Err(CampaignError::Results(part.results.directory().to_owned(), message))
    };
    let (Some(one), Some(last)) = (parts.first(), parts.last()) else { return Ok(()) };
    let campaign = one.results.campaign();
    let mut next = 0;
    for part in parts {
        if part.results.campaign().text() != campaign.text() {
            let other = one.results.directory().display();
            return fault(part, format!("has another definition than {other}"));
        }
        let (first, seed) = (part.first, campaign.seed(part.first));
        if first < next {
            return fault(part, format!("overlaps with another part from seed {seed} on"));
        }
        if first > next {
            return fault(
                part,
                format!("seeds {} to {} are missing", campaign.seed(next), seed - 1),
            );
        }
        next = part.end;
    }
    if next < campaign.runs() {
        let (from, to) = (campaign.seed(next), campaign.seed(campaign.runs() - 1));
        return fault(last, format!("seeds {from} to {to} are missing"));
    }
    Ok(())
}

/// Writes the tables one after the other, under one header.
fn join(parts: &[Part], table: &Path) -> io::Result<()> {
    let mut out = BufWriter::new(File::create(table)?);
    for (number, part) in parts.iter().enumerate() {
        let mut rows = File::open(part.results.directory().join(TABLE))?;
        if number > 0 {
            rows.seek(SeekFrom::Start(header(part.results.campaign()).len() as u64))?;
        }
        io::copy(&mut rows, &mut out)?;
    }
    out.flush()
}

fn same(a: &Path, b: &Path) -> bool {
    let full = |path: &Path| -> io::Result<PathBuf> { path.canonicalize() };
    matches!((full(a), full(b)), (Ok(a), Ok(b)) if a == b)
}
