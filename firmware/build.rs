//! Link arguments of the images, and the scenarios that they carry.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::{env, fs};

#[path = "src/scenario/document.rs"]
mod document;

#[path = "src/vehicle/document.rs"]
mod vehicle;

use ctrl_core::allocation::Allocator;
use ctrl_core::controller::TrackingController;
use ctrl_core::mode::Supervisor;
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::saturated::Saturated;
use document::{ControllerConfig, Document};
use vehicle::VehicleConfig;

/// Outputs of a board; `firmware::vehicle::ROTORS`.
const ROTORS: usize = 4;

/// Flown by the image unless the variable `GYRFALCON_SCENARIO` names another.
const FLOWN: &str = "paper-saturated";

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace").to_owned();
    link(&root);
    let directory = root.join("sil-host/scenarios");
    println!("cargo:rerun-if-changed={}", directory.display());
    println!("cargo:rerun-if-env-changed=GYRFALCON_SCENARIO");
    let flown = env::var("GYRFALCON_SCENARIO").unwrap_or_else(|_| FLOWN.to_owned());
    let mut code =
        "/// Every scenario, by name.\npub static SCENARIOS: &[Scenario] = &[\n".to_owned();
    let mut constants = None;
    for (name, path) in scenario_files(&directory) {
        let document: Document = read(&path);
        let bytes = postcard::to_allocvec(&document).expect("postcard takes any scenario");
        writeln!(code, "    Scenario {{ name: {name:?}, bytes: &{bytes:?} }},").expect("a string");
        if name == flown {
            constants = Some(flown_constants(&name, &document));
        }
    }
    code.push_str("];\n");
    code.push_str(&constants.unwrap_or_else(|| panic!("no scenario is called {flown}")));
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("set by Cargo"));
    fs::write(out.join("scenarios.rs"), code).expect("OUT_DIR is writable");
    fs::write(out.join("vehicle.postcard"), vehicle_bytes()).expect("OUT_DIR is writable");
}

/// The checked content of `vehicle.toml`.
fn vehicle_bytes() -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("vehicle.toml");
    println!("cargo:rerun-if-changed={}", path.display());
    let vehicle: VehicleConfig = read(&path);
    let fault = |error: &dyn std::fmt::Display| -> ! { panic!("{}: {error}", path.display()) };
    assert_eq!(vehicle.geometry.rotors.len(), ROTORS, "vehicle.toml: rotors");
    Supervisor::new(&vehicle.supervisor).unwrap_or_else(|error| fault(&error));
    Allocator::new(&vehicle.geometry).unwrap_or_else(|error| fault(&error));
    postcard::to_allocvec(&vehicle).expect("postcard takes any vehicle")
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

/// Name and path of each scenario, in order of the names.
fn scenario_files(directory: &Path) -> Vec<(String, PathBuf)> {
    let entries = fs::read_dir(directory).expect("sil-host/scenarios");
    let paths = entries.map(|entry| entry.expect("sil-host/scenarios").path());
    let mut files: Vec<_> = paths
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| (path.file_stem().expect("a name").to_string_lossy().into_owned(), path))
        .collect();
    files.sort();
    files
}

fn read<T: serde::de::DeserializeOwned>(path: &Path) -> T {
    let text = fs::read_to_string(path).expect("a readable file");
    toml_edit::de::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// What of the flown scenario is fixed in the image: controller and rate.
fn flown_constants(name: &str, document: &Document) -> String {
    let (module, controller, period) = match &document.controller {
        ControllerConfig::RobustAdaptive(config) => {
            check_flight(name, RobustAdaptive::new(config), document);
            ("robust_adaptive", "RobustAdaptive", config.step_period)
        }
        ControllerConfig::Saturated(config) => {
            check_flight(name, Saturated::new(config), document);
            ("saturated", "Saturated", config.step_period)
        }
    };
    let rate = (1.0 / period).round();
    assert!((rate * period - 1.0).abs() < 1e-6, "{name}: 1/step_period must be whole");
    format!(
        "\n/// Name of the scenario that this image flies.\npub const FLOWN: &str = {name:?};\n\
         \n/// The controller of that scenario.\n\
         pub use ctrl_core::{module}::{controller} as Controller;\n\
         \n/// Configuration of that controller.\n\
         pub use ctrl_core::config::{controller}Config as Config;\n\
         \n/// Control ticks a second [Hz], from its step period.\n\
         pub const CONTROL_RATE: u32 = {rate};\n"
    )
}

/// Refuses a scenario whose controller does not accept its trajectory.
fn check_flight<C: TrackingController>(
    name: &str,
    controller: Result<C, ctrl_core::error::ConfigError>,
    document: &Document,
) {
    let accepted = controller.and_then(|controller| {
        controller.accept(&document.trajectory.build(controller.step_period())?)
    });
    accepted.unwrap_or_else(|error| panic!("{name}: {error}"));
}
