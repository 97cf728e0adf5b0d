//! The firmware in QEMU's STM32F405: the same bits as on the host, faults that leave evidence, a
//! log that decodes.
//!
//! Needs `qemu-system-arm` and the target `thumbv7em-none-eabihf`; the images are built here.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};
use std::{env, fs, thread};

use ctrl_core::controller::TrackingController;
use ctrl_core::reference::Reference;
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::saturated::Saturated;
use ctrl_core::vehicle::VehicleState;
use firmware::replay::{Reply, Sample};
use firmware::scenario::{ControllerConfig, Scenario};
use glam::{Quat, Vec3};

/// Longest that an emulated run may take.
const PATIENCE: Duration = Duration::from_secs(60);

/// Builds both images, once, and returns the directory they are in.
fn images() -> &'static Path {
    static IMAGES: OnceLock<PathBuf> = OnceLock::new();
    IMAGES.get_or_init(|| {
        let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().unwrap();
        let built = Command::new(env!("CARGO"))
            .args(["build", "--quiet", "--package", "firmware", "--release"])
            .args(["--target", "thumbv7em-none-eabihf", "--features", "emulator"])
            .args(["--target-dir".as_ref(), target.as_os_str()])
            .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap())
            .status()
            .expect("cargo");
        assert!(built.success(), "the images do not build");
        target.join("thumbv7em-none-eabihf/release")
    })
}

/// Runs an image until it ends; the exit status is the image's.
fn emulate(image: &str, directives: &[String]) -> Output {
    let mut semihosting = format!("enable=on,target=native,arg={image}");
    for directive in directives {
        semihosting += &format!(",arg={directive}");
    }
    let child = Command::new("qemu-system-arm")
        .args(["-machine", "netduinoplus2", "-nodefaults", "-display", "none"])
        .args(["-monitor", "none", "-serial", "null", "-serial", "null"])
        .args(["-icount", "shift=3,sleep=off"])
        .args(["-semihosting-config", &semihosting])
        .args(["-kernel".as_ref(), images().join(image).as_os_str()])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("qemu-system-arm must be installed");
    finish(child)
}

/// Waits for the end of a child, but not for ever.
fn finish(mut child: Child) -> Output {
    let end = Instant::now() + PATIENCE;
    while child.try_wait().unwrap().is_none() {
        if Instant::now() > end {
            child.kill().unwrap();
            let output = child.wait_with_output().unwrap();
            panic!("still running after {PATIENCE:?}: {}", text(&output.stderr));
        }
        thread::sleep(Duration::from_millis(10));
    }
    child.wait_with_output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Replies of the emulated firmware to `samples`, flown with a scenario's controller.
fn replay(scenario: &str, test: &str, samples: &[Sample]) -> Vec<Reply> {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let input = directory.join(format!("{test}-{scenario}-samples"));
    let output = directory.join(format!("{test}-{scenario}-replies"));
    let bytes: Vec<u8> = samples.iter().flat_map(|sample| sample.encode().unwrap()).collect();
    fs::write(&input, bytes).unwrap();
    let directives = [
        format!("scenario={scenario}"),
        format!("input={}", input.display()),
        format!("output={}", output.display()),
    ];
    let run = emulate("replay", &directives);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let bytes = fs::read(&output).unwrap();
    let (records, rest) = bytes.as_chunks();
    assert!(rest.is_empty(), "a reply was cut");
    records.iter().map(|record| Reply::decode(record).unwrap()).collect()
}

/// Replies of the same law on the host.
fn replay_on_host(scenario: &str, samples: &[Sample]) -> Vec<Reply> {
    fn steps<C: TrackingController>(controller: &C, samples: &[Sample]) -> Vec<Reply> {
        let mut state = controller.initial_state();
        samples.iter().map(|sample| sample.step(controller, &mut state)).collect()
    }
    match Scenario::named(scenario).unwrap().load().unwrap().controller {
        ControllerConfig::RobustAdaptive(config) => {
            steps(&RobustAdaptive::new(&config).unwrap(), samples)
        }
        ControllerConfig::Saturated(config) => steps(&Saturated::new(&config).unwrap(), samples),
    }
}

/// Asserts that every reply has the same bits.
fn assert_same_bits(scenario: &str, emulated: &[Reply], host: &[Reply]) {
    assert_eq!(emulated.len(), host.len(), "{scenario}");
    for (tick, (emulated, host)) in emulated.iter().zip(host).enumerate() {
        let (left, right) = (emulated.encode().unwrap(), host.encode().unwrap());
        assert_eq!(left, right, "{scenario}, tick {tick}: {emulated:?} is not {host:?}");
    }
}

/// Numbers that a broken sensor may send, between good ones.
fn hostile_samples() -> Vec<Sample> {
    let hostile = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        f32::MIN_POSITIVE,
        1e-40,
        -0.0,
        1e30,
        -1e8,
    ];
    let mut samples = Vec::new();
    for index in 0..37 {
        for number in hostile {
            samples.extend([good_sample(samples.len()); 3]);
            let mut bytes = good_sample(samples.len()).encode().unwrap();
            bytes[4 * index..4 * index + 4].copy_from_slice(&number.to_le_bytes());
            samples.push(Sample::decode(&bytes).unwrap());
        }
    }
    samples
}

/// A large but lawful error, different at every tick.
fn good_sample(tick: usize) -> Sample {
    let phase = tick as f32 * 0.37;
    let wave = |k: f32| (phase * k) % 2.0 - 1.0;
    let attitude = Quat::from_xyzw(wave(1.0), wave(1.3), wave(1.7), wave(2.1) + 0.1).normalize();
    let vehicle = VehicleState {
        position_world: Vec3::new(wave(0.9), wave(1.1), wave(0.7)) * 5.0,
        velocity_world: Vec3::new(wave(1.9), wave(0.3), wave(2.7)) * 2.0,
        attitude,
        rate_body: Vec3::new(wave(2.9), wave(1.2), wave(0.8)) * 3.0,
    };
    Sample { vehicle, reference: Reference::hover(Vec3::ZERO) }
}

#[test]
fn hostile_inputs_give_the_same_bits_as_on_the_host() {
    let samples = hostile_samples();
    for scenario in ["paper-robust-adaptive", "paper-saturated"] {
        let emulated = replay(scenario, "hostile", &samples);
        let host = replay_on_host(scenario, &samples);
        assert_same_bits(scenario, &emulated, &host);
        assert!(host.iter().any(|reply| reply.status != 0));
        assert!(host.windows(2).any(|pair| pair[0].wrench != pair[1].wrench));
    }
}

#[test]
fn a_fault_leaves_evidence_for_the_next_boot() {
    for (fault, cause) in [("panic", "panic"), ("hard-fault", "hard fault")] {
        let run = emulate("firmware", &[format!("provoke={fault}")]);
        let report = text(&run.stderr);
        assert!(run.status.success(), "{report}");
        let has = |line: &str| report.lines().any(|found| found == line);
        assert!(has(&format!("fault before this boot: {cause}")), "{report}");
        assert!(has("uptime: 500 ticks"), "{report}");
        if fault == "panic" {
            assert!(has("text: provoked at firmware/src/board/emulator.rs"), "{report}");
        } else {
            assert!(has("r0: 0x60000000") && has("bfar: 0x60000000"), "{report}");
            assert!(has("hfsr: 0x40000000"), "{report}");
        }
    }
}
