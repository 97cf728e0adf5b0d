//! Limits, gains and bounds of their own about each axis: reached, kept, judged; one number is three.

use ctrl_core::config::SaturatedConfig;
use ctrl_core::controller::ControllerConfig;
use glam::Vec3;
use sim::guarantee::{Guarantees, Requirement};
use sim::observer::Observer;
use sim::scenario::LoadedScenario;
use sim::tick::Tick;

/// `paper-saturated` with limits of (8) of its own about each axis, tilted and turned away at the start.
const CHANGES: [&str; 6] = [
    "controller.saturated.torque_max=[0.05, 0.04, 0.02]",
    "controller.saturated.uncertainty.disturbance_torque=[0.05, 0.04, 0.015]",
    "disturbance.noise.torque=[0.05, 0.04, 0.015]",
    "initial.tilt_deg=60",
    "initial.tilt_direction_deg=30",
    "initial.heading_deg=40",
];

fn loaded(name: &str, changes: &[&str]) -> LoadedScenario {
    let changes: Vec<_> = changes.iter().map(ToString::to_string).collect();
    LoadedScenario::open(name, &changes).unwrap_or_else(|error| panic!("{error}"))
}

/// Ticks at the limit of each axis, the peaks, and the monitors.
struct Watch {
    limits: Vec3,
    at_limit: [u32; 3],
    peak: Vec3,
    guarantees: Guarantees,
}

impl Observer for Watch {
    fn observe(&mut self, tick: &Tick) {
        let torque = tick.output.wrench.torque_body.abs();
        for axis in 0..3 {
            self.at_limit[axis] += u32::from(torque[axis] == self.limits[axis]);
        }
        self.peak = self.peak.max(torque);
        self.guarantees.observe(tick);
    }
}

#[test]
fn the_limit_of_each_axis_is_reached_and_kept() {
    let loaded = loaded("paper-saturated", &CHANGES);
    let scenario = loaded.scenario();
    let limits = scenario.controller.torque_max().expect("controller 2");
    let guarantees = scenario.monitors();
    let mut watch = Watch { limits, at_limit: [0; 3], peak: Vec3::ZERO, guarantees };
    loaded.flight().expect("valid").observe(60_000, &mut watch);
    assert_eq!(watch.peak, limits);
    assert!(watch.at_limit.iter().all(|&ticks| ticks > 10), "{:?}", watch.at_limit);
    let rows = watch.guarantees.verdicts();
    for (axis, limit) in ["x", "y", "z"].into_iter().zip(limits.to_array()) {
        let name = format!("torque about {axis}, peak");
        let row = rows.iter().find(|row| row.name == name).expect("a row");
        assert_eq!(row.requirement, Requirement::AtMost(limit.into()));
        assert!(row.pass && row.margin == Some(0.0), "{row:?}");
    }
    let balance = rows.iter().find(|row| row.name.starts_with("Lyapunov balance")).expect("a row");
    assert!(balance.pass, "{balance:?}");
    let estimate = rows.iter().find(|row| row.name == "inertia estimate").expect("a row");
    assert!(estimate.pass, "{estimate:?}");
}

fn config(changes: &[&str]) -> SaturatedConfig {
    match loaded("paper-saturated", changes).scenario().controller {
        ControllerConfig::Saturated(config) => config,
        ControllerConfig::RobustAdaptive(_) => panic!("controller 2"),
    }
}

#[test]
fn one_number_means_all_three_axes_and_is_written_as_one() {
    let vectors = [
        "controller.saturated.torque_max=[0.05, 0.05, 0.05]",
        "controller.saturated.k4=[4, 4, 4]",
        "controller.saturated.uncertainty.inertia.lower=[0.03, 0.03, 0.03]",
    ];
    assert_eq!(config(&vectors), config(&[]));
    let written = toml_edit::ser::to_string(&config(&vectors)).expect("plain TOML");
    let expected = toml_edit::ser::to_string(&config(&[])).expect("plain TOML");
    assert_eq!(written, expected);
    assert!(written.contains("\nk4 = 4.0\n"), "{written}");
    let unlike = config(&["controller.saturated.k4=[4, 4, 3]"]);
    let written = toml_edit::ser::to_string(&unlike).expect("plain TOML");
    assert!(written.contains("\nk4 = [4.0, 4.0, 3.0]\n"), "{written}");
    assert_eq!(toml_edit::de::from_str::<SaturatedConfig>(&written).expect("reads"), unlike);
}

#[test]
fn refusals_name_the_axis_where_the_axes_are_unlike() {
    let refused = |change: &str| {
        LoadedScenario::open("paper-saturated", &[change.to_owned()])
            .expect_err("refused")
            .to_string()
    };
    let message = refused("controller.saturated.torque_max=-0.05");
    assert!(message.contains("torque_max = -0.05 must be positive"), "{message}");
    let message = refused("controller.saturated.torque_max=[0.05, 0.05, -0.01]");
    assert!(message.contains("torque_max[2] = -0.01 must be positive (M_tau, (8))"), "{message}");
    let message = refused("controller.saturated.k4=[4, 400, 4]");
    assert!(message.contains("J_hi/J_lo about y = "), "{message}");
    let message = refused("controller.saturated.uncertainty.inertia.upper=[0.12, 0.05, 0.12]");
    assert!(message.contains("initial.inertia[1] = 0.06 must be in [0.03, 0.05]"), "{message}");
    let message = refused("controller.saturated.k4=[4, 4]");
    assert!(message.contains("invalid length 2"), "{message}");
    let message = refused("controller.saturated.k4=\"fast\"");
    assert!(message.contains("expected a number, or three of them, one per axis"), "{message}");
    let message = refused("actuation.torque_max=[0.05, 0.0, 0.05]");
    assert!(message.contains("actuation.torque_max: 0 must be positive"), "{message}");
}
