//! Link arguments of the images, and the configurations that they carry.

use std::collections::BTreeMap;
use std::fmt::{Debug, Write};
use std::path::{Path, PathBuf};
use std::{env, fs};

#[path = "src/scenario/document.rs"]
mod document;

#[path = "src/vehicle/document.rs"]
mod vehicle;

use ctrl_core::allocation::Allocator;
use ctrl_core::controller::{AdaptiveController, ControllerConfig, TrackingController};
use ctrl_core::filter::RateFilter;
use ctrl_core::mode::Supervisor;
use ctrl_core::mode::safety::Safety;
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::saturated::Saturated;
use document::{BuiltInMission, Document, Tuning};
use link::ControllerKind;
use vehicle::VehicleConfig;

/// Outputs of a board; `firmware::vehicle::ROTORS`.
const ROTORS: usize = 4;

/// Scenario of the built-in mission unless the variable `GYRFALCON_SCENARIO` names another.
const BUILT_IN: &str = "paper-saturated";

/// Scenarios that give the numbers of the controller that the flown one does not use.
const PAPER: [&str; 2] = ["paper-robust-adaptive", "paper-saturated"];

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace").to_owned();
    link(&root);
    let directory = root.join("scenarios");
    println!("cargo:rerun-if-changed={}", directory.display());
    println!("cargo:rerun-if-env-changed=GYRFALCON_SCENARIO");
    println!("cargo:rerun-if-env-changed=GYRFALCON_CONTROL_RATE");
    let name = env::var("GYRFALCON_SCENARIO").unwrap_or_else(|_| BUILT_IN.to_owned());
    let scenarios: BTreeMap<String, Document> =
        scenario_files(&directory).map(|(name, path)| (name, read(&path))).collect();
    let flown = flown(&scenarios, &name);
    let rate = control_rate(&flown);
    let code = code(&scenarios, &name, rate);
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("set by Cargo"));
    let write = |name: &str, content: &[u8]| fs::write(out.join(name), content).expect("OUT_DIR");
    write("scenarios.rs", code.as_bytes());
    write("built_in_mission.rs", source(&flown).as_bytes());
    write("vehicle.rs", source(&vehicle(1.0 / rate as f32)).as_bytes());
}

/// The built-in mission; `GYRFALCON_CONTROL_RATE` (Hz) stands for the scenario's step period.
fn flown(scenarios: &BTreeMap<String, Document>, name: &str) -> BuiltInMission {
    let find =
        |name: &str| scenarios.get(name).unwrap_or_else(|| panic!("no scenario is called {name}"));
    let (mut kind, mut robust_adaptive, mut saturated) = (None, None, None);
    for name in [name].into_iter().chain(PAPER) {
        kind.get_or_insert(match find(name).controller {
            ControllerConfig::RobustAdaptive(config) => {
                robust_adaptive.get_or_insert(config);
                ControllerKind::RobustAdaptive
            }
            ControllerConfig::Saturated(config) => {
                saturated.get_or_insert(config);
                ControllerKind::Saturated
            }
        });
    }
    let mut tuning = Tuning {
        kind: kind.expect("a scenario"),
        robust_adaptive: robust_adaptive.expect("the paper's first controller"),
        saturated: saturated.expect("the paper's second controller"),
    };
    if let Ok(rate) = env::var("GYRFALCON_CONTROL_RATE") {
        let rate: f32 = rate.parse().expect("GYRFALCON_CONTROL_RATE is a number of hertz");
        tuning.robust_adaptive.step_period = 1.0 / rate;
        tuning.saturated.step_period = 1.0 / rate;
    }
    BuiltInMission { tuning, trajectory: find(name).trajectory.clone() }
}

/// Control ticks a second; both controllers must accept it, and the chosen one the trajectory.
fn control_rate(flown: &BuiltInMission) -> u32 {
    let Tuning { robust_adaptive, saturated, .. } = flown.tuning;
    let period = robust_adaptive.step_period;
    assert_eq!(period, saturated.step_period, "step periods of the two controllers");
    let rate = (1.0 / period).round();
    assert!((rate * period - 1.0).abs() < 1e-6, "1/step_period must be whole");
    // The other controller must be valid, too: the host may select it.
    RobustAdaptive::new(&robust_adaptive).expect("robust_adaptive");
    Saturated::new(&saturated).expect("saturated");
    let controller = flown.tuning.controller().expect("the chosen controller");
    let trajectory = flown.trajectory.build(controller.step_period()).expect("trajectory");
    controller.accept(&trajectory).expect("the trajectory suits the controller");
    rate as u32
}

/// Scenarios and constants as Rust.
fn code(scenarios: &BTreeMap<String, Document>, flown: &str, rate: u32) -> String {
    let mut code =
        "/// Every scenario, by name.\npub static SCENARIOS: &[Scenario] = &[\n".to_owned();
    for (name, document) in scenarios {
        let bytes = postcard::to_allocvec(document).expect("postcard takes any");
        writeln!(code, "    Scenario {{ name: {name:?}, bytes: &{bytes:?} }},").expect("a string");
    }
    code + &format!(
        "];\n\n/// Name of the scenario that this image flies.\npub const BUILT_IN: &str = {flown:?};\n\
         \n/// Control ticks a second (Hz), from its step period.\n\
         pub const CONTROL_RATE: u32 = {rate};\n"
    )
}

/// A configuration as an expression of Rust: its `Debug` form, with a constructor around each list.
///
/// A `static` of it lies in the flash, is read in place, and needs no parser in the image. The names of
/// types are imported beside the `include!`; a test compares the static with the file.
fn source(config: &impl Debug) -> String {
    format!("{config:?}").replace("[]", "none()").replace('[', "list([").replace(']', "])")
}

/// The checked content of `vehicle.toml`, for control ticks each `step_period` (s).
fn vehicle(step_period: f32) -> VehicleConfig {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("vehicle.toml");
    println!("cargo:rerun-if-changed={}", path.display());
    let vehicle: VehicleConfig = read(&path);
    let fault = |error: &dyn std::fmt::Display| -> ! { panic!("{}: {error}", path.display()) };
    assert_eq!(vehicle.geometry.rotors.len(), ROTORS, "vehicle.toml: rotors");
    Supervisor::new(&vehicle.supervisor).unwrap_or_else(|error| fault(&error));
    Allocator::new(&vehicle.geometry).unwrap_or_else(|error| fault(&error));
    Safety::new(&vehicle.safety, step_period).unwrap_or_else(|error| fault(&error));
    RateFilter::new(&vehicle.rate_filter, step_period).unwrap_or_else(|error| fault(&error));
    vehicle
}

/// Only images for the target are linked with `memory.x`.
fn link(root: &Path) {
    println!("cargo:rerun-if-changed={}", root.join("memory.x").display());
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        println!("cargo:rustc-link-search={}", root.display());
        for argument in ["-Tlink.x", "-Tdefmt.x", "--nmagic"] {
            println!("cargo:rustc-link-arg-bins={argument}");
        }
    }
}

/// Name and path of each scenario.
fn scenario_files(directory: &Path) -> impl Iterator<Item = (String, PathBuf)> {
    let entries = fs::read_dir(directory).expect("scenarios");
    let paths = entries.map(|entry| entry.expect("scenarios").path());
    paths
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| (path.file_stem().expect("a name").to_string_lossy().into_owned(), path))
}

fn read<T: serde::de::DeserializeOwned>(path: &Path) -> T {
    let text = fs::read_to_string(path).expect("a readable file");
    toml_edit::de::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}
