//! The app's `gains.h`, made of the scenario's controller.

use std::fs;
use std::path::Path;

use ctrl_core::controller::ControllerConfig;
use gyrfalcon::GyrfalconConfig;

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
    let inertia = initial.inertia;
    format!(
        "/* Gains of integrations/crazyflie/roll-recovery.toml; the test `crazyflie` compares them. */\n\
         #pragma once\n\n\
         #define GYRFALCON_CRAZYFLIE_GAINS \\\n    {{ \\\n        \
         .struct_size = sizeof(gyrfalcon_config), \\\n        \
         .abi_version = GYRFALCON_ABI_VERSION, \\\n        \
         .kind = GYRFALCON_SATURATED, \\\n        \
         .step_period = {:?}f, \\\n        \
         .reference_acceleration_max = {:?}f, \\\n        \
         .uncertainty = {{.mass = {{{:?}f, {:?}f}}, .inertia = {{{:?}f, {:?}f}}, \\\n                        \
         .disturbance_acceleration = {:?}f, .disturbance_torque = {:?}f}}, \\\n        \
         .initial = {{.mass = {:?}f, .inertia = {{{:?}f, {:?}f, {:?}f}}}}, \\\n        \
         .cascade = {{.k1 = {:?}f, .k2 = {:?}f, .k3 = {:?}f, .c = {:?}f, \\\n                    \
         .M1 = {:?}f, .M2 = {:?}f, .gamma1 = {:?}f, .delta_1 = {:?}f, \\\n                    \
         .delta_min_translation = {:?}f, .delta_min_rotation = {:?}f}}, \\\n        \
         .k4 = {:?}f, .gamma2 = {:?}f, .thrust_max = {:?}f, .torque_max = {:?}f, \\\n        \
         .k5 = {:?}f, .gamma3 = {:?}f \\\n    }}\n",
        config.step_period,
        config.reference_acceleration_max,
        known.mass.lower,
        known.mass.upper,
        known.inertia.lower,
        known.inertia.upper,
        known.disturbance_acceleration,
        known.disturbance_torque,
        initial.mass,
        inertia.x,
        inertia.y,
        inertia.z,
        gains.k1,
        gains.k2,
        gains.k3,
        gains.c,
        gains.M1,
        gains.M2,
        gains.gamma1,
        gains.delta_1,
        gains.delta_min_translation,
        gains.delta_min_rotation,
        config.k4,
        config.gamma2,
        config.thrust_max,
        config.torque_max,
        config.k5,
        config.gamma3,
    )
}
