//! Campaigns as the program flies them: every byte of the results again, whatever happens between.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use sil_host::campaign::{
    BuiltInCampaign, Campaign, CampaignOverrides, CampaignResults, MEASURES, Row, RunOutcome,
};

/// Short flights of both controllers that hold what is judged.
const PAIR: &str = r#"
name = "pair"
description = "Both controllers on the same vehicles."
sampling = "latin_hypercube"
runs = 24
first_seed = 100
set = [
    "duration=0.1",
    "guarantees.settle_time=0",
    "guarantees.position_error_max=9",
    "guarantees.attitude_error_max=4",
    "guarantees.tilt_error_max=4",
    "guarantees.heading_error_max=4",
]
envelope = ["vehicle.mass", "initial.tilt_deg"]

[[variant]]
name = "first"
scenario = "paper-robust-adaptive"

[[variant]]
name = "second"
scenario = "paper-saturated"

[[vary]]
path = "vehicle.mass"
unit = "kg"
uniform = { lower = 0.7, upper = 1.0 }

[[vary]]
path = "vehicle.inertia"
rigid_body = { lower = 0.03, upper = 0.12 }

[[vary]]
path = "initial.tilt_deg"
triangular = { lower = 0.0, mode = 0.5, upper = 2.0 }

[[vary]]
path = "disturbance.noise.torque"
also = ["controller.saturated.torque_max"]
values = [0.03, 0.05]
"#;

fn directory(name: &str) -> PathBuf {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("campaign").join(name);
    let _ = fs::remove_dir_all(&directory);
    fs::create_dir_all(&directory).expect("created");
    directory
}

fn command(directory: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sil-host"));
    command.current_dir(directory).args(arguments);
    command
}

fn sil_host(directory: &Path, arguments: &[&str]) -> Output {
    command(directory, arguments).output().expect("it starts")
}

fn complaint(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("UTF-8")
}

/// Flies what is missing in `directory` of a campaign there; it must succeed.
fn fly(directory: &Path, arguments: &[&str]) {
    let output = sil_host(directory, &[&["campaign", "-q"], arguments].concat());
    assert!(matches!(output.status.code(), Some(0 | 1)), "{}", complaint(&output));
    assert_eq!(complaint(&output), "");
}

/// A directory with [`PAIR`] in `pair.toml`.
fn with_pair(name: &str) -> PathBuf {
    let directory = directory(name);
    fs::write(directory.join("pair.toml"), PAIR).expect("written");
    directory
}

/// Every file of a campaign's results.
fn files(directory: &Path) -> Vec<(String, Vec<u8>)> {
    let file = |name: &str| Some((name.to_owned(), fs::read(directory.join(name)).ok()?));
    let files: Vec<_> =
        ["campaign.toml", "runs.csv", "runs.parquet"].into_iter().filter_map(file).collect();
    assert_eq!(files.len(), if cfg!(feature = "parquet") { 3 } else { 2 });
    files
}

fn assert_same_files(one: &Path, other: &Path) {
    for ((name, one), (_, other)) in files(one).into_iter().zip(files(other)) {
        assert!(one == other, "{name} differs");
    }
}

fn rows(directory: &Path) -> Vec<Row> {
    let results = CampaignResults::open(directory).unwrap_or_else(|error| panic!("{error}"));
    let rows = results.rows().unwrap_or_else(|error| panic!("{error}"));
    rows.map(|row| row.unwrap_or_else(|error| panic!("{error}"))).collect()
}

fn parse(text: &str) -> Result<Campaign, String> {
    Campaign::parse("my.toml", text, Path::new(""), &CampaignOverrides::default(), &[])
        .map_err(|error| error.to_string())
}

/// The message for [`PAIR`] with one piece of its text replaced.
fn fault_after(old: &str, new: &str) -> String {
    assert_eq!(PAIR.matches(old).count(), 1, "`{old}` once");
    parse(&PAIR.replace(old, new)).err().unwrap_or_else(|| panic!("`{new}` was accepted"))
}

fn line_of(piece: &str) -> usize {
    1 + PAIR.lines().position(|line| line.contains(piece)).expect("a line")
}

#[test]
fn a_run_has_a_row_in_every_variant_with_the_same_values() {
    let directory = with_pair("rows");
    fly(&directory, &["pair.toml"]);
    let rows = rows(&directory.join("out/pair"));
    assert_eq!(rows.len(), 48);
    for (number, pair) in rows.chunks(2).enumerate() {
        assert_eq!((pair[0].seed, pair[0].variant), (100 + number as u32, 0));
        assert_eq!((pair[1].seed, pair[1].variant), (100 + number as u32, 1));
        assert_eq!(pair[0].parameters, pair[1].parameters);
        assert_ne!(pair[0].measures, pair[1].measures);
        let [mass, j1, j2, j3, tilt, noise] = pair[0].parameters[..] else { panic!("six") };
        assert!((0.7..=1.0).contains(&mass) && (0.0..=2.0).contains(&tilt));
        assert!(j1 <= j2 + j3 && j2 <= j3 + j1 && j3 <= j1 + j2);
        assert!(noise == 0.03 || noise == 0.05);
        assert!(pair.iter().all(|row| row.outcome == RunOutcome::Held), "{pair:?}");
    }
    // `also` reached the torque limit of the second variant: its guarantee knows it.
    let results = CampaignResults::open(&directory.join("out/pair")).expect("results");
    let guarantees = results.campaign().guarantees();
    let peak = guarantees.iter().position(|it| it.key == "torque_about_y_peak").expect("a column");
    let bounds = rows.iter().filter(|row| row.variant == 1).map(|row| {
        let seen = row.guarantees[peak];
        seen.observed.expect("seen") + seen.margin.expect("bounded") - row.parameters[5]
    });
    assert!(bounds.into_iter().all(|difference| difference.abs() < 1e-8));
    assert!(rows[0].guarantees[peak].margin.is_none(), "controller 1 has no torque limit");
}

#[test]
fn torque_activity_is_in_columns_and_table() {
    let directory = with_pair("activity");
    let output = sil_host(&directory, &["campaign", "pair.toml", "--json"]);
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let results = CampaignResults::open(&directory.join("out/pair")).expect("results");
    let columns = results.campaign().guarantees();
    let column = columns.iter().position(|it| it.key == "torque_activity_rms").expect("a column");
    let rows = rows(&directory.join("out/pair"));
    for variant in 0..2 {
        let rows = rows.iter().filter(|row| row.variant == variant);
        let values: Vec<f64> =
            rows.map(|row| row.guarantees[column].observed.expect("flown")).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let row = &summary["variants"][variant]["activity"][0];
        assert_eq!(row["name"], "torque activity, rms");
        assert!((row["mean"].as_f64().expect("a number") / mean - 1.0).abs() < 1e-12);
        let largest = values.into_iter().fold(0.0, f64::max);
        assert_eq!(row["largest"][0].as_f64(), Some(largest));
    }
    let output = sil_host(&directory, &["campaign", "pair.toml"]);
    let table = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(table.matches("  info  torque activity, rms: mean ").count(), 2, "{table}");
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let directory = with_pair("threads");
    fly(&directory, &["pair.toml", "--threads", "1", "--out", "one"]);
    fly(&directory, &["pair.toml", "--threads", "5", "--out", "five"]);
    assert_same_files(&directory.join("one/pair"), &directory.join("five/pair"));
}

#[test]
fn a_killed_campaign_continues_to_the_same_bytes() {
    let directory = with_pair("killed");
    let longer = ["pair.toml", "--runs", "100", "--set", "duration=0.5"];
    fly(&directory, &[&longer[..], &["--out", "whole"]].concat());
    let arguments = [&["campaign", "-q"], &longer[..], &["--out", "parts"]].concat();
    let table = directory.join("parts/pair/runs.csv");
    let length = || fs::metadata(&table).map_or(0, |it| it.len());
    let whole = fs::metadata(directory.join("whole/pair/runs.csv")).expect("a table").len();
    let mut cut = Vec::new();
    for share in [8, 4, 2] {
        let mut child =
            command(&directory, &arguments).stdout(Stdio::null()).spawn().expect("it starts");
        let started = Instant::now();
        while length() < whole / share && started.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(1));
        }
        child.kill().expect("killed");
        child.wait().expect("ended");
        cut.push(length());
    }
    assert!(cut.is_sorted() && 0 < cut[0] && cut[2] < whole, "{cut:?} of {whole}");
    // A row torn in its middle, as by a machine that lost its power.
    let torn = fs::OpenOptions::new().write(true).open(&table).expect("a table");
    torn.set_len(cut[2] - 100).expect("cut");
    drop(torn);
    fly(&directory, &[&longer[..], &["--out", "parts"]].concat());
    assert_same_files(&directory.join("whole/pair"), &directory.join("parts/pair"));
    // Nothing is left to fly, and nothing changes.
    fly(&directory, &[&longer[..], &["--out", "parts"]].concat());
    assert_same_files(&directory.join("whole/pair"), &directory.join("parts/pair"));
}

#[test]
fn any_torn_end_is_flown_again() {
    let directory = with_pair("torn");
    fly(&directory, &["pair.toml", "--runs", "3"]);
    let results = directory.join("out/pair");
    let whole = files(&results);
    let table = &whole[1].1;
    for length in [0, 10, table.len() / 3, table.len() / 2, table.len() - 40, table.len() - 1] {
        fs::write(results.join("runs.csv"), &table[..length]).expect("written");
        fly(&directory, &["pair.toml", "--runs", "3"]);
        assert!(files(&results) == whole, "cut to {length}");
    }
}

#[test]
fn shards_in_any_order_merge_to_the_same_bytes() {
    let directory = with_pair("shards");
    fly(&directory, &["pair.toml", "--out", "whole"]);
    for shard in ["1/3", "2/3", "3/3"] {
        fly(&directory, &["pair.toml", "--shard", shard, "--out", "parts"]);
    }
    let part = |number: u32| format!("parts/pair.{number}-of-3");
    let merge =
        |parts: &[&str]| sil_host(&directory, &[&["merge", "--out", "all"], parts].concat());
    let (one, two, three) = (part(1), part(2), part(3));
    let output = merge(&[&three, &one, &two]);
    assert!(output.status.success(), "{}", complaint(&output));
    assert_same_files(&directory.join("whole/pair"), &directory.join("all/pair"));
    let summary = String::from_utf8(output.stdout).expect("UTF-8");
    assert!(summary.contains("second: 24 held, 0 violated, 0 refused"), "{summary}");

    let refused = |parts: &[&str], piece: &str| {
        let output = merge(parts);
        assert_eq!(output.status.code(), Some(2));
        assert!(complaint(&output).contains(piece), "{}", complaint(&output));
    };
    refused(&[&one, &three], "parts/pair.3-of-3: seeds 108 to 115 are missing");
    refused(
        &["whole", &two],
        "whole: no results here, but in the directory below it: give whole/pair",
    );
    refused(&["parts"], "give parts/pair.1-of-3 or parts/pair.2-of-3 or parts/pair.3-of-3 instead");
    refused(&["whole/pair/none"], "campaign.toml is missing; name the directory of a campaign");
    refused(&[&two, &one], "parts/pair.2-of-3: seeds 116 to 123 are missing");
    refused(&[&one, &two, &two, &three], "overlaps with another part from seed 108 on");
    fly(&directory, &["pair.toml", "--shard", "3/3", "--out", "other", "--set", "duration=0.2"]);
    refused(&[&one, &two, "other/pair.3-of-3"], "has another definition than parts/pair.1-of-3");
    let table = directory.join(&two).join("runs.csv");
    let text = fs::read_to_string(&table).expect("a table");
    let (kept, _) = text.trim_end().rsplit_once('\n').expect("lines");
    fs::write(&table, format!("{kept}\n")).expect("written");
    refused(&[&one, &two, &three], "parts/pair.2-of-3: seed 115 is not complete: continue it");
}

#[test]
fn a_run_is_repeated_by_its_seed_alone() {
    let directory = with_pair("only");
    fly(&directory, &["pair.toml"]);
    let row = rows(&directory.join("out/pair")).swap_remove(2 * 17 + 1);
    let only = ["campaign", "pair.toml", "--only", "117", "--variant", "second"];
    let output = sil_host(&directory, &[&only[..], &["--json"]].concat());
    assert!(output.status.success(), "{}", complaint(&output));
    assert!(directory.join("out/pair/seed-117/second/trace.csv").exists());
    let results = CampaignResults::open(&directory.join("out/pair")).expect("results");
    let guarantees = results.campaign().guarantees();
    let observed = |output: &Output| -> Vec<Option<f64>> {
        let value: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let verdicts = value["scenarios"][0]["verdicts"].as_array().expect("an array");
        let seen = |name| verdicts.iter().find(|verdict| verdict["name"] == name);
        guarantees.iter().map(|it| seen(it.name)?["observed"].as_f64()).collect()
    };
    // Through JSON as well, whose reader does not keep the last bit.
    let expected =
        serde_json::json!(row.guarantees.iter().map(|it| it.observed).collect::<Vec<_>>());
    let expected: Vec<Option<f64>> = serde_json::from_str(&expected.to_string()).expect("JSON");
    assert!(expected.iter().flatten().count() > 15);
    assert_eq!(observed(&output), expected);
    // The command that it tells does the same.
    let output = sil_host(&directory, &only);
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    let told = text.lines().next().expect("a line");
    let program = env!("CARGO_BIN_EXE_sil-host");
    let told = told.replacen("sil-host", &format!("'{program}'"), 1) + " --json";
    let shell = Command::new("sh").current_dir(&directory).args(["-c", &told]).output();
    assert_eq!(observed(&shell.expect("a shell")), expected);

    let output = sil_host(&directory, &["campaign", "pair.toml", "--only", "124"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        complaint(&output).contains("seed 124 is not a run of `pair`: choose one from 100 to 123")
    );
}

#[test]
fn refused_and_violated_runs_are_recorded_with_their_reason() {
    let directory = directory("refused");
    let text = r#"
name = "grid"
description = "Some cells are refused, some violate."
sampling = "grid"
scenario = "paper-saturated"
set = [
    "duration=0.01",
    "guarantees.settle_time=0",
    "guarantees.attitude_error_max=4",
    "guarantees.tilt_error_max=4",
]
[[vary]]
path = "initial.tilt_deg"
values = [0, 190]
[[vary]]
path = "guarantees.position_error_max"
logspace = { lower = 0.1, upper = 10, levels = 3 }
[[vary]]
path = "vehicle.inertia[0]"
linspace = { lower = 0.05, upper = 0.14, levels = 2 }
"#;
    fs::write(directory.join("grid.toml"), text).expect("written");
    let output = sil_host(&directory, &["campaign", "grid.toml"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("grid: flew 12 runs in "), "{}", complaint(&output));
    let table = String::from_utf8(output.stdout).expect("UTF-8");
    let expected = "paper-saturated: 2 held, 4 violated, 6 refused; assumptions broken in 3";
    assert!(table.contains(expected), "{table}");
    let rows = rows(&directory.join("out/grid"));
    let cells: Vec<_> = rows.iter().map(|row| row.parameters.clone()).collect();
    for (index, cell) in cells.iter().enumerate() {
        let expected = [[0.0, 190.0][index % 2], [0.1, 1.0, 10.0][index / 2 % 3]];
        assert!((cell[1] / expected[1] - 1.0).abs() < 1e-12 && cell[0] == expected[0], "{cells:?}");
        assert_eq!(cell[2], [0.05, 0.14][index / 6]);
    }
    for row in &rows {
        let outside = row.parameters[2] > 0.12;
        match (row.parameters[0] > 180.0, row.parameters[1] > 3.0) {
            (true, _) => {
                assert_eq!(row.outcome, RunOutcome::Refused);
                assert!(row.reason.ends_with("initial.tilt_deg: 190 must be in [0, 180] deg"));
                assert!(row.measures == vec![None; MEASURES.len()]);
            }
            (false, true) => assert_eq!((row.outcome, row.reason.as_str()), (RunOutcome::Held, "")),
            (false, false) => {
                assert_eq!(row.outcome, RunOutcome::Violated);
                assert_eq!(row.reason, "position error after settling");
                assert_eq!(row.assumptions_kept, !outside);
            }
        }
    }
}

#[test]
fn another_definition_does_not_touch_the_results() {
    let directory = with_pair("another");
    fly(&directory, &["pair.toml", "--runs", "2"]);
    let before = files(&directory.join("out/pair"));
    let output = sil_host(&directory, &["campaign", "pair.toml", "--runs", "3"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complaint(&output).contains("out/pair: holds results of another definition"));
    assert!(files(&directory.join("out/pair")) == before);
    fly(&directory, &["pair.toml", "--runs", "3", "--restart"]);
    assert_eq!(rows(&directory.join("out/pair")).len(), 6);
    // What the results say of their campaign flies it again.
    fly(&directory, &["out/pair/campaign.toml", "--out", "again"]);
    assert_same_files(&directory.join("out/pair"), &directory.join("again/pair"));
}

#[test]
fn a_table_that_was_tampered_with_is_refused() {
    let directory = with_pair("tampered");
    fly(&directory, &["pair.toml", "--runs", "3"]);
    let table = directory.join("out/pair/runs.csv");
    let text = fs::read_to_string(&table).expect("a table");
    let refused = |text: &str, piece: &str| {
        fs::write(&table, text).expect("written");
        let output = sil_host(&directory, &["campaign", "pair.toml", "--runs", "3"]);
        assert_eq!(output.status.code(), Some(2));
        assert!(complaint(&output).contains(piece), "{}", complaint(&output));
    };
    refused(&text.replace("\n101,second", "\n104,second"), "seed 104 in variant `second` is out");
    refused(&text.replace("tilt_peak", "tilt"), "runs.csv: has other columns");
    refused(&text.replace(",held,", ",well,"), "runs.csv: line 2 is not a row of runs");
}

#[test]
fn faults_of_a_definition_are_named_with_file_line_and_key() {
    for (old, new, path, piece) in [
        ("runs = 24", "runs = 0", "runs", "0 must be positive"),
        ("runs = 24", "rums = 24", "rums", "did you mean `runs`?"),
        ("first_seed = 100", "first_seed = 4294967290", "first_seed", "exceed 4294967295"),
        ("\"latin_hypercube\"", "\"latin\"", "sampling", "did you mean `latin_hypercube`?"),
        ("name = \"second\"", "name = \"first\"", "variant[1].name", "`first` is taken already"),
        (
            "name = \"second\"",
            "name = \"a b\"",
            "variant[1].name",
            "must be made of 1 to 64 letters",
        ),
        ("lower = 0.7", "lower = 1.7", "vary[0].uniform", "lower = 1.7 must be below"),
        ("lower = 0.03", "lower = -1", "vary[1].rigid_body", "lower = -1 must be positive"),
        ("mode = 0.5", "mode = 3", "vary[2].triangular", "mode = 3 must be in [0, 2]"),
        ("mode = 0.5", "modus = 3", "vary[2].triangular.modus", "did you mean `mode`?"),
        ("values = [0.03, 0.05]", "values = []", "vary[3].values", "must have an element"),
        ("path = \"initial.tilt_deg\"", "path = \"vehicle.mass\"", "vary[2].path", "already"),
        ("path = \"initial.tilt_deg\"", "path = \"seed\"", "vary[2].path", "`seed` always is"),
        ("\"vehicle.mass\", \"initial", "\"mass\", \"initial", "envelope", "is not varied"),
    ] {
        let kept = if PAIR.contains(new) { old } else { new };
        let text = PAIR.replace(old, new);
        let message = fault_after(old, new);
        assert!(message.starts_with("my.toml:"), "{message}");
        assert!(message.contains(&format!(": {path}: ")) && message.contains(piece), "{message}");
        let line: usize = message.split(':').nth(1).and_then(|it| it.parse().ok()).expect("a line");
        let written = text.lines().nth(line - 1).expect("a line");
        let key = path.rsplit('.').next().expect("a key");
        assert!(written.contains(key) || written.contains(kept), "{line}: {written}: {message}");
    }
}

#[test]
fn a_distribution_is_given_exactly_once() {
    let path = line_of("path = \"vehicle.mass\"") - 1;
    let none = fault_after("uniform = { lower = 0.7, upper = 1.0 }", "");
    assert_eq!(none, format!("my.toml:{path}: vary[0]: has no distribution"));
    let two = fault_after("unit = \"kg\"", "values = [0.8]");
    assert_eq!(two, format!("my.toml:{path}: vary[0]: has more than one distribution"));
}

#[test]
fn fields_that_no_scenario_has_are_refused_before_the_first_flight() {
    let message = fault_after("path = \"initial.tilt_deg\"", "path = \"initial.tilt\"");
    assert!(message.contains("initial.tilt: unknown field `tilt`"), "{message}");
    let message = fault_after("path = \"initial.tilt_deg\"", "path = \"vehicle.mass[3]\"");
    assert!(message.contains("vehicle.mass[3]: `mass` is not an array"), "{message}");
    let message = fault_after("path = \"initial.tilt_deg\"", "path = \"vehicle.inertia[3]\"");
    assert!(message.contains("`inertia` has 3 elements, the first is [0]"), "{message}");
    let message = fault_after("controller.saturated.torque_max", "controller.saturated.torque");
    assert!(message.contains("no variant's scenario has `controller.saturated.torque`"));
    let message = fault_after("scenario = \"paper-saturated\"", "scenario = \"paper\"");
    assert!(message.contains("variant[1].scenario: paper: ") && message.contains("No such file"));
    let message = fault_after("\"duration=0.1\"", "\"duration=-1\"");
    assert!(message.starts_with("--set duration=-1: duration: -1 must be in"), "{message}");
}

#[test]
fn a_grid_is_flown_whole() {
    let grid = PAIR.replace("latin_hypercube", "grid");
    assert_eq!(parse(&grid.replace("runs = 24", "")).expect("valid").runs(), 2);
    assert_eq!(parse(&grid).expect("valid").runs(), 24);
    let message = fault_after("runs = 24", "");
    assert_eq!(message, "my.toml: runs: missing: only a grid may omit it");
    let message = parse(&grid.replace("runs = 24", "runs = 23")).expect_err("refused");
    assert!(message.ends_with("runs: 23 must be positive and a multiple of the 2 cells"));
}

/// The option that was given is named, not `--set`, which nobody wrote.
#[test]
fn a_number_of_runs_from_the_command_line_is_refused_by_its_option() {
    let grid = PAIR.replace("latin_hypercube", "grid");
    for (text, runs, fault) in [
        (PAIR, 0, "--runs 0: runs: 0 must be positive"),
        (&grid, 23, "--runs 23: runs: 23 must be positive and a multiple of the 2 cells"),
    ] {
        let overrides = CampaignOverrides { runs: Some(runs), first_seed: None };
        let error =
            Campaign::parse("my.toml", text, Path::new(""), &overrides, &[]).expect_err("refused");
        assert_eq!(error.to_string(), fault);
    }
    let overrides = CampaignOverrides { runs: None, first_seed: Some(u32::MAX) };
    let error =
        Campaign::parse("my.toml", PAIR, Path::new(""), &overrides, &[]).expect_err("refused");
    let fault = "--first-seed 4294967295: first_seed: seeds of 24 runs exceed 4294967295";
    assert_eq!(error.to_string(), fault);
}

#[test]
fn sobol_is_refused_beyond_its_points() {
    let sobol = PAIR.replace("latin_hypercube", "sobol");
    assert!(parse(&sobol).is_ok());
    let message = parse(&sobol.replace("runs = 24", "runs = 65537")).expect_err("refused");
    assert!(
        message.contains("sampling: sobol has at most 65536 runs of 256 dimensions, not 65537")
    );
}

#[test]
fn built_in_campaigns_are_valid_and_listed() {
    let directory = directory("built-in");
    let output = sil_host(&directory, &["campaign", "--list"]);
    let listed = String::from_utf8(output.stdout).expect("UTF-8");
    for built_in in BuiltInCampaign::ALL {
        let campaign = Campaign::open(built_in.name, &CampaignOverrides::default(), &[]);
        let campaign = campaign.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(campaign.name(), built_in.name);
        assert!(listed.contains(&format!("{}  ", built_in.name)), "{listed}");
        let output = sil_host(&directory, &["campaign", built_in.name, "--show"]);
        assert_eq!(String::from_utf8(output.stdout).expect("UTF-8"), built_in.text);
    }
    assert_eq!(listed.lines().count(), BuiltInCampaign::ALL.len());
    let output = sil_host(&directory, &["campaign", "none"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complaint(&output).contains("built-in campaigns: paper-uncertainty"));
}
