//! A small campaign with violations, flown and reported once for all tests.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use sil_host::campaign::{
    Campaign, CampaignOverrides, CampaignResults, Row, fly_run, header, line, report,
};

const RUNS: u32 = 40;

/// Both controllers from tilts and rates of which they cannot recover within a second.
const CAMPAIGN: &str = r#"
name = "small"
description = "Tilts & rates with \"quotes\", <tags> and </script>."
sampling = "monte_carlo"
runs = RUNS
first_seed = 11
set = [
    "duration=3", "guarantees.settle_time=2", "guarantees.position_error_max=3.5",
    "guarantees.attitude_error_max=0.5", "guarantees.tilt_error_max=0.5",
    "guarantees.heading_error_max=0.5",
]
envelope = ["initial.tilt_deg", "initial.rate_body[0]"]
[[variant]]
name = "first"
scenario = "paper-robust-adaptive"
[[variant]]
name = "second"
scenario = "tilt-recovery"
[[vary]]
path = "initial.tilt_deg"
unit = "deg"
uniform = { lower = 0.0, upper = 90.0 }
[[vary]]
path = "initial.rate_body[0]"
unit = "rad/s"
uniform = { lower = -1.0, upper = 1.0 }
"#;

/// The campaign with so many runs.
pub fn campaign(runs: u32) -> Campaign {
    let text = CAMPAIGN.replace("RUNS", &runs.to_string());
    Campaign::parse("small.toml", &text, Path::new(""), &CampaignOverrides::default(), &[])
        .expect("a campaign")
}

/// An empty directory.
pub fn directory(name: &str) -> PathBuf {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report").join(name);
    let _ = std::fs::remove_dir_all(&directory); // of the last time, if there was one
    std::fs::create_dir_all(&directory).expect("a directory");
    directory
}

/// Every row of the campaign.
pub fn rows(campaign: &Campaign) -> Vec<Row> {
    (0..campaign.runs()).flat_map(|index| fly_run(campaign, index).rows).collect()
}

/// Writes results and report; the path of the report.
pub fn reported(name: &str, campaign: &Campaign, rows: &[Row]) -> PathBuf {
    let directory = directory(name);
    let table: String = rows.iter().map(|row| line(campaign, row)).collect();
    std::fs::write(directory.join("campaign.toml"), campaign.text()).expect("written");
    std::fs::write(directory.join("runs.csv"), header(campaign) + &table).expect("written");
    let results = CampaignResults::open(&directory).expect("results");
    report::write(&results).expect("a report")
}

/// The report of the small campaign.
pub fn report() -> &'static Path {
    static REPORT: OnceLock<PathBuf> = OnceLock::new();
    REPORT.get_or_init(|| {
        let campaign = campaign(RUNS);
        reported("small", &campaign, &rows(&campaign))
    })
}
