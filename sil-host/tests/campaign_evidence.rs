//! Campaigns that end when their demand is decided, and those that split towards a rare violation.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use sil_host::campaign::{Campaign, CampaignOverrides};

/// Hover beside the reference for ten ticks: the largest position error is that of the start, `|x|` of a
/// normal distribution, but for some 1e-5 m.
const OFFSET: &str = r#"
name = "offset"
description = "Hover from an offset."
sampling = "monte_carlo"
runs = 100000
scenario = "hover-gusts"
set = [
    "duration=0.01",
    "initial.position=[0.0, 0.0, 5.0]",
    "guarantees.settle_time=0",
    "guarantees.position_error_max=1",
]
[[vary]]
path = "initial.position[0]"
unit = "m"
normal = { mean = 0.0, deviation = DEVIATION }
"#;

/// The definition with this standard deviation (m) and one more table.
fn offset(deviation: f64, table: &str) -> String {
    OFFSET.replace("DEVIATION", &format!("{deviation:?}")) + table
}

fn directory(name: &str) -> PathBuf {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("evidence").join(name);
    let _ = fs::remove_dir_all(&directory);
    fs::create_dir_all(&directory).expect("created");
    directory
}

fn sil_host(directory: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sil-host"));
    command.current_dir(directory).args(arguments).output().expect("it starts")
}

/// Exit status and summary of a campaign.
fn fly(directory: &Path, arguments: &[&str]) -> (i32, Value) {
    let output =
        sil_host(directory, &[&["campaign", "offset.toml", "-q", "--json"], arguments].concat());
    let errors = String::from_utf8_lossy(&output.stderr);
    let summary = serde_json::from_slice(&output.stdout);
    let summary = summary.unwrap_or_else(|error| panic!("{error}: {errors}"));
    (output.status.code().expect("it ends"), summary)
}

fn files(directory: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = fs::read_dir(directory)
        .expect("results")
        .map(|entry| entry.expect("an entry"))
        .map(|it| {
            (it.file_name().into_string().expect("UTF-8"), fs::read(it.path()).expect("read"))
        })
        .collect();
    files.sort();
    files
}

fn lines(path: &Path) -> usize {
    fs::read_to_string(path).expect("a table").lines().count()
}

#[test]
fn a_demand_that_no_run_violates_is_shown_at_the_first_look_whatever_the_threads() {
    let directory = directory("shown");
    let table = "[stop]\nfailure_probability = 0.05\n";
    fs::write(directory.join("offset.toml"), offset(0.1, table)).expect("written");
    let (status, summary) = fly(&directory, &["--threads", "1", "--out", "one"]);
    assert_eq!(status, 0);
    let evidence = &summary["variants"][0]["evidence"];
    // 0.95^n <= 0.025.
    assert_eq!((evidence["runs"].as_u64(), evidence["violated"].as_u64()), (Some(72), Some(0)));
    assert_eq!(evidence["decision"], "demonstrated");
    assert!(evidence["bounds"][1].as_f64().expect("a bound") <= 0.05);
    assert_eq!(lines(&directory.join("one/offset/runs.csv")), 73);

    let (status, _) = fly(&directory, &["--threads", "4", "--out", "four"]);
    assert_eq!(status, 0);
    assert!(files(&directory.join("one/offset")) == files(&directory.join("four/offset")));
    let page = fs::read_to_string(directory.join("one/offset/report.html")).expect("a page");
    assert!(page.contains("ended after 72 of at most 100000 runs") && page.contains(">shown<"));

    // Interrupted anywhere, it ends at the same run; when it is decided, nothing is flown.
    let whole = files(&directory.join("one/offset"));
    let path = directory.join("one/offset/runs.csv");
    let text = fs::read(&path).expect("a table");
    for length in [text.len() / 3, text.len() - 50, text.len()] {
        fs::write(&path, &text[..length]).expect("cut");
        assert_eq!(fly(&directory, &["--threads", "3", "--out", "one"]).0, 0);
        assert!(files(&directory.join("one/offset")) == whole, "cut to {length}");
    }
}

#[test]
fn a_demand_that_runs_break_is_refuted_and_one_guarantee_may_be_meant() {
    let directory = directory("refuted");
    let table =
        "[stop]\nfailure_probability = 0.05\nguarantee = \"position_error_after_settling\"\n";
    // 2 (1 - Phi(1)) = 32 % of runs.
    fs::write(directory.join("offset.toml"), offset(1.0, table)).expect("written");
    let (status, summary) = fly(&directory, &["--out", "out"]);
    let evidence = &summary["variants"][0]["evidence"];
    assert_eq!((status, evidence["decision"].as_str()), (1, Some("refuted")));
    assert_eq!(summary["passed"], false);
    assert!(evidence["bounds"][0].as_f64().expect("a bound") > 0.05);

    let table = table.replace("position_error", "thrust_lowest").replace("_after_settling", "");
    fs::write(directory.join("offset.toml"), offset(1.0, &table)).expect("written");
    let (status, summary) = fly(&directory, &["--out", "thrust"]);
    assert_eq!((status, summary["variants"][0]["evidence"]["violated"].as_u64()), (0, Some(0)));
    assert!(summary["variants"][0]["violated"].as_u64() > Some(0), "of other guarantees");

    let (status, summary) = fly(&directory, &["--runs", "20", "--out", "few"]);
    assert_eq!(status, 1);
    assert_eq!(summary["variants"][0]["evidence"]["decision"], "undecided");
    let output = sil_host(&directory, &["campaign", "offset.toml", "--shard", "1/2"]);
    assert_eq!(output.status.code(), Some(2));
}

/// Few flights, for a test: the interval is a wide one.
const SPLITTING: &str = "[splitting]\nguarantee = \"position_error_after_settling\"\nparticles = 8\n\
                         replicas = 8\nsteps = 6\n";

#[test]
fn splitting_finds_a_probability_below_one_in_a_million_that_is_known() {
    let directory = directory("rare");
    // 2 (1 - Phi(4.9)): the guarantee is broken from 1 m on.
    let truth = libm::erfc(4.9 / 2f64.sqrt());
    assert!(truth < 1e-6);
    fs::write(directory.join("offset.toml"), offset(1.0 / 4.9, SPLITTING)).expect("written");
    let (status, summary) = fly(&directory, &["--threads", "1", "--out", "one"]);
    assert_eq!(status, 0);
    let rare = &summary["variants"][0]["rare"];
    let number = |key: &str| rare[key].as_f64().unwrap_or_else(|| panic!("{key}: {rare}"));
    assert!((number("lower")..=number("upper")).contains(&truth), "{truth} {rare}");
    assert!(number("upper") < 20.0 * truth && number("lower") > truth / 20.0, "{rare}");
    assert!(number("flights") < 10_000.0 && number("equivalent_draws") > 1e6, "{rare}");

    let whole = files(&directory.join("one/offset"));
    let page = fs::read_to_string(directory.join("one/offset/report.html")).expect("a page");
    assert!(
        page.contains("sil-host run hover-gusts") && page.contains("independent draws instead")
    );
    // The same bytes from other threads, and after an interruption with a torn line.
    let path = directory.join("one/offset/flights.csv");
    let text = fs::read(&path).expect("a table");
    fs::write(&path, &text[..text.len() / 2 + 7]).expect("cut");
    fly(&directory, &["--threads", "4", "--out", "one"]);
    assert!(files(&directory.join("one/offset")) == whole);
    let output = sil_host(&directory, &["campaign", "offset.toml", "--only", "1"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("its page lists commands"));
    // Flights of something else are not taken for its own.
    let foreign = String::from_utf8(text).expect("UTF-8").replacen("\n0,", "\n3,", 1);
    fs::write(&path, foreign).expect("written");
    let output = sil_host(&directory, &["campaign", "offset.toml", "-q", "--out", "one"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("do not follow from its campaign.toml")
    );

    // A demand below what can be shown with the flights that are allowed.
    let demand = SPLITTING.to_owned() + "failure_probability = 1e-9\n";
    fs::write(directory.join("offset.toml"), offset(1.0 / 4.9, &demand)).expect("written");
    let (status, summary) = fly(&directory, &["--runs", "300", "--out", "few"]);
    let rare = &summary["variants"][0]["rare"];
    assert_eq!(
        (status, rare["finished"].as_bool(), rare["lower"].as_f64()),
        (1, Some(false), Some(0.0))
    );
}

#[test]
fn faults_of_demands_name_line_key_and_bound() {
    let fault = |text: &str| {
        let none = CampaignOverrides::default();
        let parsed = Campaign::parse("my.toml", text, Path::new(""), &none, &[]);
        parsed.err().unwrap_or_else(|| panic!("{text}")).to_string()
    };
    let stop = "[stop]\nfailure_probability = 0.05\n";
    let error = fault(&offset(0.1, "[stop]\nfailure_probability = 0.7\n"));
    assert!(
        error.contains("my.toml:18: stop.failure_probability: 0.7 must be in [1e-9, 0.5]"),
        "{error}"
    );
    let error = fault(&offset(0.1, &(stop.to_owned() + "guarantee = \"none\"\n")));
    assert!(error.contains("no guarantee `none`: choose from thrust_lowest, "), "{error}");
    let error = fault(&offset(0.1, stop).replace("monte_carlo", "latin_hypercube"));
    assert!(error.contains("sampling: must be monte_carlo with `[stop]`"), "{error}");
    let error = fault(&offset(0.1, &SPLITTING.replace("replicas = 8", "replicas = 1")));
    assert!(error.contains("splitting.replicas: 1 must be in [2, 10000]"), "{error}");
    let error = fault(&offset(0.1, &(SPLITTING.to_owned() + stop)));
    assert!(error.contains("without `[stop]`"), "{error}");
}
