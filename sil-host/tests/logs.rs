//! Logs that the program writes: which files, what bytes, what it says when it cannot.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Every format of this build, as the option takes them.
const FORMATS: &str = if cfg!(feature = "mcap") { "ulog,mcap" } else { "ulog" };
const FILES: &[&str] =
    if cfg!(feature = "mcap") { &["flight.ulg", "flight.mcap"] } else { &["flight.ulg"] };

fn fresh(name: &str) -> PathBuf {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("logs").join(name);
    let _ = fs::remove_dir_all(&directory);
    directory
}

/// Flies two seconds into `directory`.
fn fly(directory: &Path, more: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sil-host"));
    command.args(["run", "paper-saturated", "--quiet", "--set", "duration=2", "--out"]);
    command.arg(directory).args(more).output().expect("it starts")
}

fn complained(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("UTF-8")
}

fn read(directory: &Path, file: &str) -> Vec<u8> {
    let path = directory.join("paper-saturated").join(file);
    fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn there_is_no_log_unless_asked_for() {
    let directory = fresh("none");
    fly(&directory, &[]);
    read(&directory, "trace.csv");
    assert!(FILES.iter().all(|file| !directory.join("paper-saturated").join(file).exists()));
}

#[test]
fn the_same_scenario_leaves_the_same_bytes() {
    let directories = ["once", "twice"].map(fresh);
    for directory in &directories {
        let output = fly(directory, &["--log", FORMATS]);
        assert_eq!(complained(&output), "");
    }
    for file in FILES {
        let [once, twice] = directories.each_ref().map(|directory| read(directory, file));
        assert!(once.len() > 100_000, "{file}: {}", once.len());
        assert!(once == twice, "{file}");
    }
    let directory = fresh("seed");
    fly(&directory, &["--log", FORMATS, "--seed", "2"]);
    assert!(FILES.iter().all(|file| read(&directory, file) != read(&directories[0], file)));
}

#[test]
fn what_is_no_format_or_no_rate_is_wrong_usage() {
    for (arguments, said) in [
        (["--log", "csv"], "the formats are ulog and mcap"),
        (["--log-rate", "0"], "must be finite and above 0 Hz"),
        (["--log-rate", "often"], "expected a rate in Hz"),
    ] {
        let output = fly(&fresh("wrong"), &arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(complained(&output).contains(said), "{}", complained(&output));
    }
}

#[test]
fn a_log_that_cannot_be_written_exits_with_three_and_is_named() {
    for file in FILES {
        let directory = fresh("blocked");
        fs::create_dir_all(directory.join("paper-saturated").join(file)).expect("made");
        let output = fly(&directory, &["--log", FORMATS]);
        assert_eq!(output.status.code(), Some(3), "{}", complained(&output));
        assert!(complained(&output).contains(file), "{}", complained(&output));
    }
}

/// A file system that is full only when the buffers are written.
#[test]
#[cfg(target_os = "linux")]
fn a_log_that_fails_later_exits_with_three_and_is_named() {
    for file in FILES {
        let directory = fresh("full");
        fs::create_dir_all(directory.join("paper-saturated")).expect("made");
        let path = directory.join("paper-saturated").join(file);
        std::os::unix::fs::symlink("/dev/full", path).expect("made");
        let output = fly(&directory, &["--log", FORMATS]);
        assert_eq!(output.status.code(), Some(3), "{}", complained(&output));
        assert!(complained(&output).contains(file), "{}", complained(&output));
    }
}
