//! Ground stations that nobody here wrote fly the firmware's image: MAVSDK, pymavlink and MAVProxy over its own port, QEMU's USART3,
//! with the plant in lock step on the link. Every flight leaves its log, and the bits of the law on the host.
//!
//! Needs `qemu-system-arm`, the target `thumbv7em-none-eabihf` and the packages of `tests/python-requirements.txt`.

#[allow(dead_code, reason = "the part that starts images; the rest is firmware_emulator's")]
#[path = "firmware_emulator/emulator.rs"]
mod emulator;

use std::net::{SocketAddr, UdpSocket};
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use serde_json::Value;
use sil_host::fly::{
    FlyError, FlyEvent, ImageOptions, ImageReport, PortOptions, SigningKey, fly_image, read_key,
};
use sil_host::log::LogOptions;
use sil_host::log::format::Format;
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
    /// Port that a station may listen to.
    udp: u16,
    interrupts: Arc<AtomicUsize>,
    flight: JoinHandle<Result<ImageReport, FlyError>>,
}

impl Flown {
    fn start(scenario: &str) -> Self {
        Self::start_with(scenario, None, None)
    }

    fn start_with(
        scenario: &str,
        memory: Option<PathBuf>,
        signing_key: Option<SigningKey>,
    ) -> Self {
        let loaded = LoadedScenario::open(scenario, &[]).expect("a scenario");
        // Free at this moment; a station binds it.
        let udp = UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr());
        let udp = udp.expect("a free port");
        // Tests run side by side: those with a memory have directories of their own.
        let own = if memory.is_some() { "image-station-signed" } else { "image-station" };
        let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join(own);
        let _ = std::fs::remove_dir_all(out.join(scenario));
        let options = ImageOptions {
            emulator: emulator::emulator("firmware"),
            ports: PortOptions { udp: vec![udp], tcp: "127.0.0.1:0".parse().ok() },
            memory,
            signing_key,
            speed: SPEED,
            duration: None,
            out,
            log: LogOptions { formats: vec![Format::Ulog], rate: 100.0 },
            trace_every: NonZeroU32::new(10).expect("not zero"),
        };
        let interrupts = Arc::new(AtomicUsize::new(0));
        let (listening, address) = mpsc::channel();
        let stop = Arc::clone(&interrupts);
        let flight = thread::spawn(move || {
            fly_image(&loaded, &options, &stop, &mut |event| {
                if let FlyEvent::Listening(address) = event {
                    listening.send(address.expect("TCP is open")).expect("the test waits");
                }
            })
        });
        let address = address.recv_timeout(Duration::from_secs(120)).expect("the image starts");
        Self { address, udp: udp.port(), interrupts, flight }
    }

    /// Runs a script to its end; the steps that it passed.
    fn script(&self, name: &str, place: &str) -> Vec<String> {
        let said = self.say(name, &[place]);
        let steps = said["steps"].as_array().expect("steps");
        steps.iter().filter_map(Value::as_str).map(str::to_owned).collect()
    }

    /// A station over UDP that reads the parameters and watches the vehicle until it has landed.
    fn watch(&self) -> JoinHandle<Value> {
        let script = "import json, os, sys; os.environ['MAVLINK20'] = '1'\n\
            from pymavlink import mavutil\n\
            link = mavutil.mavlink_connection('udpin:127.0.0.1:' + sys.argv[1], source_system=251)\n\
            link.wait_heartbeat(timeout=60)\n\
            link.mav.param_request_list_send(1, 1)\n\
            names, highest = set(), 0.0\n\
            while True:\n    \
                seen = link.recv_match(blocking=True, timeout=300)\n    \
                kind = seen.get_type()\n    \
                if kind == 'PARAM_VALUE': names.add(seen.param_id)\n    \
                if kind == 'LOCAL_POSITION_NED': highest = max(highest, -seen.z)\n    \
                if kind == 'EXTENDED_SYS_STATE' and seen.landed_state == 1 and highest > 1: break\n\
            print(json.dumps({'parameters': len(names), 'highest': highest}))\n";
        let mut python = Command::new(program("python3"));
        python.args(["-B", "-c", script, &self.udp.to_string()]);
        thread::spawn(move || {
            let Output { status, stdout, stderr } = python.output().expect("it starts");
            assert!(status.success(), "{}", emulator::text(&stderr));
            serde_json::from_slice(&stdout).expect("JSON")
        })
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

    /// Stops an image that has not flown; on the ground's springs it settles by micrometres.
    fn stop_on_the_ground(self) {
        self.interrupts.store(1, Ordering::Relaxed);
        let report = self.flight.join().expect("no panic").expect("it flew");
        assert!(report.passed() && report.height_max < 1e-4, "{report:?}");
    }

    /// Stops the image: every guarantee of every flight has held, with the bits of the law on the host, and every flight
    /// has left a log that pyulog reads.
    fn stop(self) -> ImageReport {
        self.interrupts.store(1, Ordering::Relaxed);
        let begin = Instant::now();
        let report = self.flight.join().expect("no panic").expect("it flew");
        assert!(begin.elapsed() < Duration::from_secs(60));
        assert!(report.passed() && !report.flights.is_empty(), "{report:?}");
        let flown: f64 = report.flights.iter().map(|flight| flight.flight_time).sum();
        // Armed time counts as flight, and a busy image skips telemetry.
        assert!(report.compared as f64 * 1e-3 > 0.5 * flown, "{} of {flown} s", report.compared);
        for flight in &report.flights {
            let log = flight.directory.join("flight.ulg");
            let info = Command::new(program("ulog_info")).arg(log).output().expect("it starts");
            let text = emulator::text(&info.stdout);
            assert!(info.status.success() && text.contains("vehicle_local_position"), "{text}");
            assert!(flight.directory.join("trace.csv").exists());
        }
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
    // A second station, over UDP, sees the flight that the first one commands.
    let watch = image.watch();
    let said = image.say("station_mavproxy.py", &[&proxy, "tcp:ADDRESS"]);
    // Without the refusal of its file transfer it waits ten seconds for them.
    let time = said["times"]["parameters"].as_f64().expect("a time");
    assert!(time < 8.0, "parameters after {time} s");
    let seen = watch.join().expect("it watched");
    assert!(
        seen["parameters"].as_u64() > Some(40) && seen["highest"].as_f64() > Some(1.8),
        "{seen}"
    );
    let report = image.stop();
    assert!((1.8..2.3).contains(&report.height_max), "{report:?}");
}

#[test]
fn the_image_keeps_a_key_over_a_restart_and_refuses_what_was_recorded_before_it() {
    let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("image-signing");
    let _ = std::fs::remove_dir_all(&place);
    std::fs::create_dir_all(&place).expect("a directory");
    let [memory, recorded] = ["memory", "recorded"].map(|name| place.join(name));
    let digits = "c2eb71c56733482ad43db8f9b5d517f4eeb2f6365877aac8c13de0322b3f6fb1";
    let file = place.join("key");
    std::fs::write(&file, digits).expect("written");
    let key = read_key(&file).expect("a key");
    for (given, steps) in [(Some(key), 14), (None, 4)] {
        let image = Flown::start_with("paper-saturated", Some(memory.clone()), given);
        let arguments = ["ADDRESS", digits, &recorded.display().to_string()];
        let said = image.say("station_signing.py", &arguments);
        assert!(said["steps"].as_array().expect("steps").len() >= steps, "{said}");
        image.stop_on_the_ground();
    }
}
