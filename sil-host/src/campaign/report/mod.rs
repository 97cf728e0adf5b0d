//! One self-contained HTML page a campaign, that opens without a network.
//!
//! The rows are read twice, one at a time: memory does not grow with their number. The runs that the
//! page replays are flown again from their seeds.

pub mod counts;
pub mod definition;
pub mod document;
pub mod envelope;
pub mod evidence;
pub mod failure_probability;
pub mod flights;
pub mod guarantees;
pub mod histogram;
pub mod page;
pub mod points;
pub mod quantity;
pub mod scan;
pub mod summary;
pub mod tally;
pub mod tightest;
pub mod worst;

use std::path::PathBuf;

use super::error::CampaignError;
use super::stop::Sequential;
use super::table::CampaignResults;
use counts::Counts;
use document::Document;
use quantity::Quantity;
use scan::Scan;

/// File of the report in a directory of results.
pub const REPORT: &str = "report.html";

/// Writes the report of `results` to their directory; returns its path.
///
/// # Errors
/// When the results cannot be read, a run to replay is refused, or the file cannot be written.
pub fn write(results: &CampaignResults) -> Result<PathBuf, CampaignError> {
    let path = results.directory().join(REPORT);
    std::fs::write(&path, html(results)?).map_err(CampaignError::io(&path))?;
    Ok(path)
}

/// The report of `results`.
fn html(results: &CampaignResults) -> Result<String, CampaignError> {
    let campaign = results.campaign();
    let quantities = Quantity::all(campaign);
    let mut scan = Scan::new(campaign, &quantities);
    let mut stop = Sequential::new(campaign);
    for row in results.rows()? {
        let row = row?;
        scan.push(&row, &quantities);
        if let Some(stop) = &mut stop {
            stop.push(&[row]);
        }
    }
    let mut counts = Counts::new(campaign, &scan);
    for row in results.rows()? {
        counts.push(&row?, &quantities);
    }
    let flights = flights::fly(campaign, &flights::choose(campaign, &scan))?;
    let document = Document::new(campaign, &quantities, &scan, &counts, &flights);
    let evidence = stop.map(Sequential::evidence).unwrap_or_default();
    Ok(page::page(campaign, &scan, &document, &evidence))
}
