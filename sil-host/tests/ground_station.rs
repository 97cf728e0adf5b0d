//! Ground stations and scripts that nobody here wrote, against `sil-host fly`: MAVSDK, pymavlink and MAVProxy.
//! The scripts are in `tests/tests/python`; everything passes over the loopback interface.
//!
//! Needs the packages of `tests/python-requirements.txt`: `cargo xtask setup`.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// Times real time: as fast as a station's timeouts allow.
const SPEED: &str = "4";
/// Time in which a script must be done.
const PATIENCE: Duration = Duration::from_secs(240);

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A program of the environment; says how to get it.
fn tool(name: &str) -> PathBuf {
    let path = root().join("target/python/bin").join(name);
    assert!(path.exists(), "{} is missing: run `cargo xtask setup`", path.display());
    path
}

/// A vehicle that flies until it is stopped.
struct Flown {
    program: Child,
    /// Kept to the end: it may have read further than the lines taken from it.
    stdout: BufReader<ChildStdout>,
    out: PathBuf,
    tcp: String,
    udp: u16,
    shown: Vec<String>,
}

impl Flown {
    fn start(test: &str, scenario: &str) -> Self {
        Self::start_with(test, scenario, &[])
    }

    fn start_with(test: &str, scenario: &str, options: &[&str]) -> Self {
        let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ground-station").join(test);
        let _ = fs::remove_dir_all(&out);
        // Free at this moment; the station binds it.
        let udp = UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr());
        let udp = udp.expect("a free port").port();
        let mut command = Command::new(env!("CARGO_BIN_EXE_sil-host"));
        command.args(["fly", scenario, "--speed", SPEED, "--tcp", "127.0.0.1:0", "--udp"]);
        command.arg(format!("127.0.0.1:{udp}")).arg("--out").arg(&out);
        command.args(options);
        let mut program = command.stdout(Stdio::piped()).spawn().expect("it starts");
        let mut stdout = BufReader::new(program.stdout.take().expect("piped"));
        let mut lines = stdout.by_ref().lines();
        let mut shown = Vec::new();
        let tcp = loop {
            let line = lines.next().expect("the ports are shown").expect("UTF-8");
            let address = line.trim().strip_prefix("TCP at ").map(str::to_owned);
            shown.push(line);
            if let Some(address) = address {
                break address.split(": ").next().expect("an address").to_owned();
            }
        };
        Self { program, stdout, out, tcp, udp, shown }
    }

    /// Runs a script to its end; what it printed.
    fn script(&self, name: &str, arguments: &[&str]) -> Value {
        let mut python = Command::new(tool("python3"));
        python.arg("-B").arg(root().join("tests/tests/python").join(name)).args(arguments);
        let mut script = python
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        let (stdout, stderr) = (reader(script.stdout.take()), reader(script.stderr.take()));
        let status = finish(&mut script, PATIENCE).unwrap_or_else(|| panic!("{name} hangs"));
        let (stdout, stderr) = (stdout.join().expect("read"), stderr.join().expect("read"));
        assert!(status, "{name}: {stderr}");
        let last = stdout.lines().rfind(|line| line.starts_with('{')).expect("JSON");
        serde_json::from_str(last).expect("JSON")
    }

    /// Stops the vehicle as Ctrl-C does; every guarantee of every flight must have held.
    fn stop(mut self) -> String {
        let id = self.program.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().expect("kill").success());
        let good = finish(&mut self.program, Duration::from_secs(60)).expect("it stops");
        let mut text = self.shown.join("\n");
        self.stdout.read_to_string(&mut text).expect("UTF-8");
        assert!(good, "a guarantee is violated, or the flight failed:\n{text}");
        text
    }
}

impl Drop for Flown {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

/// Reads a pipe on a thread of its own, so that it never fills.
fn reader(pipe: Option<impl Read + Send + 'static>) -> std::thread::JoinHandle<String> {
    std::thread::spawn(move || {
        let mut text = Vec::new();
        pipe.expect("piped").read_to_end(&mut text).expect("a pipe");
        String::from_utf8_lossy(&text).into_owned()
    })
}

/// Waits for the end of a program; whether it succeeded, or none if it had to be killed.
fn finish(program: &mut Child, patience: Duration) -> Option<bool> {
    let start = Instant::now();
    while start.elapsed() < patience {
        if let Some(status) = program.try_wait().expect("a child") {
            return Some(status.success());
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    program.kill().expect("a child");
    program.wait().expect("a child");
    None
}

fn steps(said: &Value) -> Vec<&str> {
    said["steps"].as_array().expect("steps").iter().filter_map(Value::as_str).collect()
}

#[test]
fn mavsdk_sees_tunes_and_flies_the_vehicle_and_fetches_its_log() {
    let vehicle = Flown::start("mavsdk", "paper-saturated");
    let out = vehicle.out.display().to_string();
    let said = vehicle.script("station_mavsdk.py", &[&format!("tcpout://{}", vehicle.tcp), &out]);
    assert!(steps(&said).len() >= 45, "{said}");
    let flown = fs::read(vehicle.out.join("paper-saturated/flight-001/flight.ulg")).expect("a log");
    let fetched = fs::read(vehicle.out.join("downloaded.ulg")).expect("the log");
    assert!(flown == fetched, "{} bytes became {}", flown.len(), fetched.len());
    let readable = Command::new(tool("ulog_info")).arg(vehicle.out.join("downloaded.ulg")).output();
    let readable = readable.expect("it starts");
    let info = String::from_utf8_lossy(&readable.stdout).into_owned();
    assert!(readable.status.success() && info.contains("vehicle_local_position"), "{info}");
    let shown = vehicle.stop();
    assert!(shown.contains("flight 1") && shown.contains("every guarantee holds"), "{shown}");
}

#[test]
fn pymavlink_loses_the_link_comes_back_and_flies_a_mission_to_its_end() {
    let vehicle = Flown::start("pymavlink", "paper-saturated");
    let said =
        vehicle.script("station_pymavlink.py", &[&format!("udpin:127.0.0.1:{}", vehicle.udp)]);
    assert!(steps(&said).len() >= 38, "{said}");
    vehicle.stop();
}

#[test]
fn a_vehicle_with_a_key_obeys_pymavlinks_signatures_and_refuses_replays() {
    let key = "c2eb71c56733482ad43db8f9b5d517f4eeb2f6365877aac8c13de0322b3f6fb1";
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ground-station.key");
    fs::write(&file, format!("{key}  -\n")).expect("written");
    let options = ["--signing-key", file.to_str().expect("UTF-8")];
    let vehicle = Flown::start_with("signing", "paper-saturated", &options);
    let said = vehicle.script("station_signing.py", &[&vehicle.tcp, key]);
    assert!(steps(&said).len() >= 18, "{said}");
    let shown = vehicle.stop();
    assert!(
        shown.contains("signed: stations need the same key") && !shown.contains(key),
        "{shown}"
    );
}

#[test]
fn mavproxy_has_the_parameters_at_once_and_flies_the_other_controller() {
    let vehicle = Flown::start("mavproxy", "lemniscate");
    let master = format!("tcp:{}", vehicle.tcp);
    let program = tool("mavproxy.py").display().to_string();
    let said = vehicle.script("station_mavproxy.py", &[&program, &master]);
    // Without the refusal of its file transfer it waits ten seconds for them.
    let time = said["times"]["parameters"].as_f64().expect("a time");
    assert!(time < 8.0, "parameters after {time} s");
    vehicle.stop();
}

#[test]
fn a_vehicle_in_the_air_lands_before_the_session_ends() {
    let vehicle = Flown::start("interrupted", "paper-saturated");
    let script = "import os, sys; os.environ['MAVLINK20'] = '1'\n\
        from pymavlink import mavutil\n\
        link = mavutil.mavlink_connection('tcp:' + sys.argv[1], source_system=250)\n\
        def order(number, *p):\n    \
            link.mav.command_long_send(1, 1, number, 0, *p, *[0] * (7 - len(p)))\n    \
            assert link.recv_match(type='COMMAND_ACK', blocking=True, timeout=5).result == 0\n\
        order(400, 1); order(22, *[float('nan')] * 7)\n\
        while link.recv_match(type='EXTENDED_SYS_STATE', blocking=True).landed_state != 2: pass\n\
        print('{}')\n";
    let file = vehicle.out.join("take_off.py");
    fs::create_dir_all(&vehicle.out).and_then(|()| fs::write(&file, script)).expect("written");
    let tcp = vehicle.tcp.clone();
    vehicle.script(&file.display().to_string(), &[&tcp]);
    let trace = vehicle.out.join("paper-saturated/flight-001/trace.csv");
    let shown = vehicle.stop();
    assert!(shown.contains("landing; again to stop at once"), "{shown}");
    let trace = fs::read_to_string(trace).expect("a trace");
    let header: Vec<_> = trace.lines().next().expect("a header").split(',').collect();
    let height = header.iter().position(|name| *name == "position_z").expect("a column");
    let heights: Vec<f64> = trace
        .lines()
        .skip(1)
        .map(|row| row.split(',').nth(height).expect("a cell").parse().expect("a number"))
        .collect();
    let highest = heights.iter().copied().fold(0.0, f64::max);
    // It stands on springs, which take its weight within 2 mm while it comes to rest.
    let stands = heights.last().is_some_and(|height| height.abs() < 2e-3);
    assert!(highest > 0.3 && stands, "{highest}, then {:?}", heights.last());
}
