//! Logs and tables as other programs read them: `pyulog`, Python's `mcap`, Rerun and `pyarrow`, none of which
//! knows our code. The scripts in `tests/tests/python` hold every topic against the trace.
//!
//! Needs the packages of `tests/python-requirements.txt`: `cargo xtask setup`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use sil_host::log::description::Description;
use sim::scenario::LoadedScenario;

/// Arguments of the flights of both of the paper's scenarios.
const CHANGES: [&str; 2] = ["duration=4", "initial.tilt_deg=60"];
/// Ticks of a flight at 1 kHz.
const TICKS: usize = 4_000;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A program of the environment; says how to get it.
fn tool(name: &str) -> Command {
    let path = root().join("target/python/bin").join(name);
    assert!(path.exists(), "{} is missing: run `cargo xtask setup`", path.display());
    Command::new(path)
}

/// Runs to the end; what it printed.
fn printed(command: &mut Command) -> String {
    let Output { status, stdout, stderr } = command.output().expect("it starts");
    assert!(status.success(), "{command:?}: {}", String::from_utf8_lossy(&stderr));
    String::from_utf8(stdout).expect("UTF-8")
}

/// Flies a scenario with logs at `rate` (Hz); the directory of its results.
fn flown(name: &str, test: &str, formats: &str, rate: &str) -> PathBuf {
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("log-readers").join(test);
    let _ = fs::remove_dir_all(&out);
    let mut command = Command::new(env!("CARGO_BIN_EXE_sil-host"));
    command.args([
        "run",
        name,
        "--quiet",
        "--log",
        formats,
        "--log-rate",
        rate,
        "--trace-every",
        "1",
    ]);
    command.args(CHANGES.map(|change| format!("--set={change}")));
    let output = command.arg("--out").arg(&out).output().expect("it starts");
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    out.join(name)
}

/// Output of a script on a log that has every `every`-th tick.
fn read(script: &str, directory: &Path, file: &str, every: usize) -> Value {
    let mut python = tool("python3");
    python.arg("-B").arg(root().join("tests/tests/python").join(script));
    python.arg(directory.join(file)).arg(directory.join("trace.csv")).arg(every.to_string());
    let said: Value = serde_json::from_str(&printed(&mut python)).expect("JSON");
    assert_eq!(said["instants"], TICKS.div_ceil(every));
    said
}

fn description(name: &str) -> Description {
    let changes = CHANGES.map(str::to_owned);
    Description::new(&LoadedScenario::open(name, &changes).expect("valid")).expect("valid")
}

/// A note of this level and start at the start of the flight, and one for each guarantee at its end.
fn assert_notes(said: &Value, flag: &str) {
    let notes = said["notes"].as_array().expect("notes");
    let first = notes.iter().find(|note| note[2] == flag);
    assert!(first.is_some_and(|note| note[0] == "INFO" && note[1] == 0), "{notes:?}");
    let guarantees = |level: &str, start: &str| {
        let ends = |note: &&Value| note[0] == level && note[1] == 3_999_000;
        let starts = |note: &&Value| note[2].as_str().is_some_and(|text| text.starts_with(start));
        notes.iter().filter(ends).filter(starts).count()
    };
    // The flight ends before errors are judged: nothing was observed, which fails.
    assert_eq!(guarantees("ERROR", "guarantee VIOLATED: position error after settling"), 1);
    assert!(guarantees("INFO", "guarantee holds: ") > 5, "{notes:?}");
}

/// Reads a ULog back; whether it has PX4's torque setpoint.
fn assert_ulog(name: &str, rate: &str, every: usize) -> (Value, bool) {
    let directory = flown(name, &format!("ulog-{name}"), "ulog", rate);
    let said = read("read_ulog.py", &directory, "flight.ulg", every);
    let expected = description(name);
    assert_eq!(said["toml"], expected.toml);
    assert_eq!(said["information"]["scenario"], name);
    assert_eq!(said["information"]["seed"], 1);
    let parameters = said["parameters"].as_object().expect("parameters");
    assert_eq!(parameters.len(), expected.parameters.len() + 1);
    assert_eq!(parameters["MAV_TYPE"], 2);
    let version = said["information"]["ver_sw"].as_str().expect("a version");
    assert_eq!(version, sil_host::log::description::COMMIT);
    assert_eq!(said["information"]["ver_sw_release"], 0x0001_0000);
    for (key, value) in &expected.parameters {
        assert_eq!(parameters[key].as_f64().map(|x| x as f32), Some(*value), "{key}");
    }
    let thrust_max = said["thrust_max"].as_f64().expect("a number");
    assert!((thrust_max / f64::from(expected.bounds.thrust_max) - 1.0).abs() < 1e-6);
    let info = printed(tool("ulog_info").arg(directory.join("flight.ulg")));
    assert!(info.contains("gyrfalcon_lyapunov (0, 32)"), "{info}");
    let topics = said["topics"].as_array().expect("topics");
    let torque = topics.iter().any(|topic| topic == "vehicle_torque_setpoint");
    (said, torque)
}

#[test]
fn pyulog_reads_what_the_trace_says_of_controller_1() {
    let (_, torque) = assert_ulog("paper-robust-adaptive", "100", 10);
    assert!(!torque, "controller 1 has no bound to normalise torque by");
}

#[test]
fn pyulog_reads_what_the_trace_says_of_controller_2() {
    let (said, torque) = assert_ulog("paper-saturated", "300", 3);
    assert!(torque);
    assert_notes(&said, "torque saturated");
}

#[cfg(feature = "mcap")]
mod mcap {
    use super::*;

    fn assert_mcap(name: &str, every: usize, rate: &str) -> Value {
        let directory = flown(name, &format!("mcap-{name}"), "mcap", rate);
        let said = read("read_mcap.py", &directory, "flight.mcap", every);
        let expected = description(name);
        let flight = &said["metadata"]["flight"];
        assert_eq!((&flight["scenario"], &flight["seed"]), (&name.into(), &"1".into()));
        let parameters = said["metadata"]["parameters"].as_object().expect("parameters");
        assert_eq!(parameters.len(), expected.parameters.len());
        let attachment = [format!("{name}.toml"), "application/toml".to_owned(), expected.toml];
        assert_eq!(said["attachments"], serde_json::json!([attachment]));
        assert_eq!(said["path"], 1000);
        said
    }

    #[test]
    fn mcap_reads_what_the_trace_says_of_controller_1() {
        let said = assert_mcap("paper-robust-adaptive", 10, "100");
        assert_eq!(said["chunks"], 1);
    }

    #[test]
    fn mcap_reads_what_the_trace_says_of_controller_2() {
        let said = assert_mcap("paper-saturated", 2, "500");
        assert!(said["chunks"].as_u64().is_some_and(|chunks| chunks > 1));
        assert_notes(&said, "torque saturated");
    }

    /// Rerun's command line, which may not leave or send anything.
    fn rerun(home: &Path, arguments: &[&Path]) -> String {
        let mut command = tool("rerun");
        printed(command.env("HOME", home).env("XDG_CONFIG_HOME", home).args(arguments))
    }

    /// Rows of a component of an entity, from the list of chunks.
    fn rows(chunks: &str, component: &str) -> usize {
        let rows = |line: &str| {
            let (_, rest) = line.split_once(" with ")?;
            rest.split_once(" rows ")?.0.replace(' ', "").parse::<usize>().ok()
        };
        chunks.lines().filter(|line| line.contains(component)).filter_map(rows).sum()
    }

    /// Rerun with a home of its own below `directory`.
    fn rerun_in(directory: &Path) -> impl Fn(&str, &[&Path]) -> String {
        let home = directory.join("home");
        fs::create_dir_all(&home).expect("made");
        rerun(&home, &["analytics", "disable"].map(Path::new));
        move |words: &str, files: &[&Path]| {
            let words: Vec<_> =
                words.split(' ').map(Path::new).chain(files.iter().copied()).collect();
            rerun(&home, &words)
        }
    }

    #[test]
    fn layouts_of_foxglove_and_rerun_show_fields_that_a_log_has() {
        let directory = flown("paper-saturated", "layouts", "mcap", "50");
        let rerun = rerun_in(&directory);
        let (flight, recording) = (directory.join("flight.mcap"), directory.join("flight.rrd"));
        rerun("mcap convert --application-id gyrfalcon --output", &[&recording, &flight]);
        let mut written = tool("python3");
        written.env("HOME", directory.join("home")).arg("-B");
        printed(written.arg(root().join("integrations/viewers/layouts.py")).arg(&directory));
        rerun("rrd verify", &[&directory.join("rerun.rbl")]);
        let read = |path: &Path| fs::read_to_string(path).expect("a layout");
        let checked_in = root().join("integrations/viewers/foxglove.json");
        assert!(read(&directory.join("foxglove.json")) == read(&checked_in), "run layouts.py");
        let mut python = tool("python3");
        python.arg("-B").arg(root().join("tests/tests/python/read_layouts.py"));
        let said = printed(python.args([&flight, &recording, &directory]));
        let said: Value = serde_json::from_str(&said).expect("JSON");
        assert_eq!((&said["foxglove"], &said["rerun"]), (&49.into(), &49.into()), "{said}");
    }

    #[test]
    fn rerun_makes_three_dimensional_entities_of_it() {
        let directory = flown("paper-saturated", "rerun", "mcap", "50");
        let rerun = rerun_in(&directory);
        let (flight, converted) = (directory.join("flight.mcap"), directory.join("flight.rrd"));
        rerun("mcap check", &[&flight]);
        rerun("mcap convert --output", &[&converted, &flight]);
        rerun("rrd verify", &[&converted]);
        let chunks = rerun("rrd print -v", &[&converted]);
        let instants = TICKS / 20;
        for component in [
            "/vehicle/pose@InstancePoses3D:translations",
            "/vehicle/pose@InstancePoses3D:quaternions",
            "/reference/pose@InstancePoses3D:translations",
            "/tf@Transform3D:translation",
            "/tf@Transform3D:quaternion",
            "/gyrfalcon/wrench@gyrfalcon.Wrench:message",
        ] {
            assert_eq!(rows(&chunks, component), instants, "{component} in {chunks}");
        }
        assert_eq!(rows(&chunks, "/reference/path@InstancePoses3D:translations"), 1);
        assert!(rows(&chunks, "/log@TextLog:text") > 10, "{chunks}");
    }
}

#[cfg(feature = "parquet")]
#[test]
fn pyarrow_reads_a_campaigns_table_and_what_it_says_about_itself() {
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("log-readers/parquet");
    let _ = fs::remove_dir_all(&out);
    let mut command = Command::new(env!("CARGO_BIN_EXE_sil-host"));
    command.args(["campaign", "paper-uncertainty", "--quiet", "--runs", "40"]);
    // Nothing has settled so early, which violates a guarantee.
    let flown = command.args(["--set", "duration=0.1", "--out"]).arg(&out).output();
    assert_eq!(flown.expect("it starts").status.code(), Some(1));
    let mut python = tool("python3");
    python.arg("-B").arg(root().join("tests/tests/python/read_parquet.py"));
    let said = printed(python.arg(out.join("paper-uncertainty")));
    let said: Value = serde_json::from_str(&said).expect("JSON");
    assert_eq!((&said["campaign"], &said["rows"]), (&"paper-uncertainty".into(), &80.into()));
    assert_eq!(said["version"], sil_host::log::description::VERSION);
    assert_eq!(said["commit"], sil_host::log::description::COMMIT);
    assert_eq!(said["units"]["position_error_peak"], "m");
    assert_eq!(said["compression"], serde_json::json!(["SNAPPY"]));
    let words = serde_json::json!(["variant", "outcome", "reason", "assumptions"]);
    assert_eq!(said["dictionaries"], words);
}
