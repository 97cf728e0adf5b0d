//! The app's `gains.h`, made of the scenario's controller.

use std::fs;
use std::path::Path;

use ctrl_core::controller::ControllerConfig;
use gyrfalcon::{GyrfalconConfig, GyrfalconVector};

const HEADER: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../integrations/crazyflie/app/src/gains.h");

/// Fails unless the checked-in header holds the gains of `config`.
pub fn check(config: &ControllerConfig) {
    let wanted = header(&config.into());
    let found = fs::read_to_string(HEADER).unwrap_or_default();
    if found != wanted {
        let renewed = Path::new(env!("CARGO_TARGET_TMPDIR")).join("gains.h");
        fs::write(&renewed, wanted).expect("a folder for temporary files");
        panic!("{HEADER} does not hold the scenario's gains; those are in {}", renewed.display());
    }
}

/// The gains as an initialiser in C: shortest decimals that give the same bits.
fn header(config: &GyrfalconConfig) -> String {
    let (known, initial, gains) = (&config.uncertainty, &config.initial, &config.cascade);
    let number = |x: f32| format!("{x:?}f");
    let vector =
        |v: GyrfalconVector| format!("{{{}, {}, {}}}", number(v.x), number(v.y), number(v.z));
    let fields = [
        ("step_period", number(config.step_period)),
        ("reference_acceleration_max", number(config.reference_acceleration_max)),
        ("uncertainty.mass.lower", number(known.mass.lower)),
        ("uncertainty.mass.upper", number(known.mass.upper)),
        ("uncertainty.inertia.lower", vector(known.inertia.lower)),
        ("uncertainty.inertia.upper", vector(known.inertia.upper)),
        ("uncertainty.disturbance_acceleration", number(known.disturbance_acceleration)),
        ("uncertainty.disturbance_torque", vector(known.disturbance_torque)),
        ("initial.mass", number(initial.mass)),
        ("initial.inertia", vector(initial.inertia)),
        ("cascade.k1", number(gains.k1)),
        ("cascade.k2", number(gains.k2)),
        ("cascade.k3", vector(gains.k3)),
        ("cascade.c", number(gains.c)),
        ("cascade.M1", number(gains.M1)),
        ("cascade.M2", number(gains.M2)),
        ("cascade.gamma1", number(gains.gamma1)),
        ("cascade.delta_1", number(gains.delta_1)),
        ("cascade.delta_min_translation", number(gains.delta_min_translation)),
        ("cascade.delta_min_rotation", number(gains.delta_min_rotation)),
        ("k4", vector(config.k4)),
        ("gamma2", vector(config.gamma2)),
        ("thrust_max", number(config.thrust_max)),
        ("torque_max", vector(config.torque_max)),
        ("k5", number(config.k5)),
        ("gamma3", number(config.gamma3)),
    ];
    let lines: String =
        fields.iter().map(|(name, value)| format!("        .{name} = {value}, \\\n")).collect();
    format!(
        "/* Gains of integrations/crazyflie/roll-recovery.toml; the test `crazyflie` compares them. */\n\
         #pragma once\n\n\
         #define GYRFALCON_CRAZYFLIE_GAINS \\\n    {{ \\\n        \
         .struct_size = sizeof(gyrfalcon_config), \\\n        \
         .abi_version = GYRFALCON_ABI_VERSION, \\\n        \
         .kind = GYRFALCON_SATURATED, \\\n\
         {lines}    }}\n",
    )
}
