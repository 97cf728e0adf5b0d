//! Defaults of PX4's parameters (`integrations/px4`) are what `tune` proposes for its vehicle file.

use std::collections::BTreeMap;

use ctrl_core::controller::ControllerConfig;
use sil_host::tune::propose;
use sil_host::tune::request::WantedOptions;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../integrations/px4/");

/// Names and defaults in the module's list of parameters.
fn defaults() -> BTreeMap<String, f32> {
    let path = format!("{FOLDER}src/modules/gyrfalcon_control/module.yaml");
    let text = std::fs::read_to_string(path).expect("module.yaml");
    let (mut defaults, mut name) = (BTreeMap::new(), String::new());
    for line in text.lines().map(str::trim) {
        if line.starts_with("GYR_") {
            name = line.trim_end_matches(':').to_owned();
        } else if let Some(value) = line.strip_prefix("default: ") {
            defaults.insert(name.clone(), value.parse().expect("a number"));
        }
    }
    defaults
}

#[test]
fn defaults_are_what_tune_proposes() {
    let file = format!("{FOLDER}vehicle.toml");
    let proposal = propose(&file, WantedOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let ControllerConfig::Saturated(law) = proposal.law else { panic!("controller 2") };
    let (known, gains, initial) = (law.uncertainty, law.cascade, law.initial);
    let mut wanted = [
        ("GYR_DT", law.step_period),
        ("GYR_MASS_LO", known.mass.lower),
        ("GYR_MASS_HI", known.mass.upper),
        ("GYR_MASS", initial.mass),
        ("GYR_D1", known.disturbance_acceleration),
        ("GYR_ACC_MAX", law.reference_acceleration_max),
        ("GYR_F_MAX", law.thrust_max),
        ("GYR_K1", gains.k1),
        ("GYR_K2", gains.k2),
        ("GYR_K5", law.k5),
        ("GYR_C", gains.c),
        ("GYR_M1", gains.m1),
        ("GYR_M2", gains.m2),
        ("GYR_GAMMA1", gains.gamma1),
        ("GYR_GAMMA3", law.gamma3),
        ("GYR_DELTA_1", gains.delta_1),
        ("GYR_DELTA_T", gains.delta_min_translation),
        ("GYR_DELTA_R", gains.delta_min_rotation),
    ]
    .map(|(name, value): (&str, f32)| (name.to_owned(), value))
    .to_vec();
    for (name, vector) in [
        ("GYR_J_LO", known.inertia.lower),
        ("GYR_J_HI", known.inertia.upper),
        ("GYR_J", initial.inertia),
        ("GYR_D2", known.disturbance_torque),
        ("GYR_TAU_MAX", law.torque_max),
        ("GYR_K3", gains.k3),
        ("GYR_K4", law.k4),
        ("GYR_GAMMA2", law.gamma2),
    ] {
        let axes = ["X", "Y", "Z"].into_iter().zip(vector.to_array());
        wanted.extend(axes.map(|(axis, value)| (format!("{name}_{axis}"), value)));
    }
    let defaults = defaults();
    for (name, value) in &wanted {
        assert_eq!(defaults.get(name), Some(value), "{name}");
        assert!(name.len() <= 16, "{name} is too long for PX4");
    }
    // Besides, three of the allocator's scale.
    assert_eq!(defaults.len(), wanted.len() + 3);
}
