//! Ground stations that nobody here wrote fly the firmware's image: MAVSDK, pymavlink and MAVProxy over its own port, QEMU's USART3
//! on TCP, with the plant in lock step on the link.
//!
//! Needs `qemu-system-arm`, the target `thumbv7em-none-eabihf` and the packages of `tests/python-requirements.txt`.

#[allow(dead_code, reason = "the part that starts images; the rest is firmware_emulator's")]
#[path = "firmware_emulator/emulator.rs"]
mod emulator;

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use serde_json::Value;
use sil_host::fly::{FlyError, ImageOptions, ImageReport, fly_image};
use sim::scenario::LoadedScenario;

/// Times real time, as far as the machine is fast enough.
const SPEED: f64 = 2.0;
/// Time in which a script must be done.
const PATIENCE: Duration = Duration::from_secs(400);

/// A program of the environment; says how to get it.
fn program(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/python/bin").join(name);
    assert!(path.exists(), "{} is missing: run `cargo xtask setup`", path.display());
    path
}

/// An image that flies until it is stopped.
struct Flown {
    address: SocketAddr,
    interrupts: Arc<AtomicUsize>,
    flight: JoinHandle<Result<ImageReport, FlyError>>,
}

impl Flown {
    fn start(scenario: &str) -> Self {
        let loaded = LoadedScenario::open(scenario, &[]).expect("a scenario");
        let options = ImageOptions {
            emulator: emulator::emulator("firmware"),
            tcp: "127.0.0.1:0".parse().expect("an address"),
            speed: SPEED,
            duration: None,
        };
        let interrupts = Arc::new(AtomicUsize::new(0));
        let (listening, address) = mpsc::channel();
        let stop = Arc::clone(&interrupts);
        let flight = thread::spawn(move || {
            fly_image(&loaded, &options, &stop, &mut |address| {
                listening.send(address).expect("the test waits");
            })
        });
        let address = address.recv_timeout(Duration::from_secs(120)).expect("the image starts");
        Self { address, interrupts, flight }
    }

    /// Runs a script to its end; the steps that it passed.
    fn script(&self, name: &str, place: &str) -> Vec<String> {
        let said = self.say(name, &[place]);
        let steps = said["steps"].as_array().expect("steps");
        steps.iter().filter_map(Value::as_str).map(str::to_owned).collect()
    }

    /// Runs a script to its end; the JSON that it printed last. `ADDRESS` in an argument is the image's.
    fn say(&self, name: &str, arguments: &[&str]) -> Value {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let address = self.address.to_string();
        let script = Command::new(program("python3"))
            .arg("-B")
            .arg(root.join("tests/tests/python").join(name))
            .args(arguments.iter().map(|argument| argument.replace("ADDRESS", &address)))
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        let id = script.id().to_string();
        let (done, output) = mpsc::channel();
        thread::spawn(move || done.send(script.wait_with_output()));
        let output = output.recv_timeout(PATIENCE).unwrap_or_else(|_| {
            let _ = Command::new("kill").arg(id).status();
            panic!("{name} hangs")
        });
        let Output { status, stdout, stderr } = output.expect("it ran");
        assert!(status.success(), "{name}: {}", emulator::text(&stderr));
        let stdout = emulator::text(&stdout);
        let last = stdout.lines().rfind(|line| line.starts_with('{')).expect("JSON");
        serde_json::from_str(last).expect("JSON")
    }

    /// Stops the image; every wrench must have been inside its bounds.
    fn stop(self) -> ImageReport {
        self.interrupts.store(1, Ordering::Relaxed);
        let begin = Instant::now();
        let report = self.flight.join().expect("no panic").expect("it flew");
        assert!(begin.elapsed() < Duration::from_secs(60));
        assert!(report.bounded && report.flights >= 1, "{report:?}");
        report
    }
}

#[test]
fn mavsdk_sees_tunes_and_flies_the_image() {
    let image = Flown::start("paper-saturated");
    let steps = image.script("station_mavsdk.py", "tcpout://ADDRESS");
    assert!(steps.len() >= 46, "{steps:?}");
    let wanted = ["offboard position", "offboard velocity", "mission flown to its end", "no logs"];
    assert!(wanted.iter().all(|step| steps.iter().any(|passed| passed == step)), "{steps:?}");
    let report = image.stop();
    assert!((2.8..3.5).contains(&report.height_max), "{report:?}");
}

#[test]
fn pymavlink_loses_the_image_comes_back_and_flies_a_mission_to_its_end() {
    let image = Flown::start("lemniscate");
    let steps = image.script("station_pymavlink.py", "tcp:ADDRESS");
    assert!(steps.len() >= 38, "{steps:?}");
    let wanted = ["hold after silence", "mission flown to its end", "alive after a flood"];
    assert!(wanted.iter().all(|step| steps.iter().any(|passed| passed == step)), "{steps:?}");
    image.stop();
}

#[test]
fn mavproxy_has_the_parameters_of_the_image_and_flies_it() {
    let image = Flown::start("paper-robust-adaptive");
    let proxy = program("mavproxy.py").display().to_string();
    let said = image.say("station_mavproxy.py", &[&proxy, "tcp:ADDRESS"]);
    // Without the refusal of its file transfer it waits ten seconds for them.
    let time = said["times"]["parameters"].as_f64().expect("a time");
    assert!(time < 8.0, "parameters after {time} s");
    let report = image.stop();
    assert!((1.8..2.3).contains(&report.height_max), "{report:?}");
}
