//! Names, reading and writing of parameters.

use std::collections::HashSet;
use std::string::String;

use super::*;
use ctrl_core::config::{CascadeGains, IntegralAction, RobustAdaptiveConfig, SaturatedConfig};
use ctrl_core::rotors::RotorModel;
use ctrl_core::saturated::Saturated;
use ctrl_core::vehicle::{InitialEstimate, Interval, Uncertainty, VectorInterval};

fn cascade() -> CascadeGains {
    CascadeGains {
        k1: 0.5,
        k2: 1.0,
        k3: Vec3::new(2.0, 2.1, 1.2),
        c: 0.001,
        m1: 0.45,
        m2: 0.46,
        gamma1: 0.05,
        delta_1: 0.1,
        delta_min_translation: 0.11,
        delta_min_rotation: 0.051,
    }
}

fn saturated() -> SaturatedConfig {
    SaturatedConfig {
        step_period: 1e-3,
        reference_acceleration_max: 0.25,
        uncertainty: Uncertainty {
            mass: Interval { lower: 0.7, upper: 1.01 },
            inertia: VectorInterval {
                lower: Vec3::new(0.03, 0.031, 0.032),
                upper: Vec3::new(0.12, 0.121, 0.122),
            },
            disturbance_acceleration: 0.052,
            disturbance_torque: Vec3::new(0.053, 0.0531, 0.02),
        },
        initial: InitialEstimate { mass: 0.75, inertia: Vec3::new(0.06, 0.061, 0.062) },
        cascade: cascade(),
        thrust_max: 13.0,
        torque_max: Vec3::new(0.054, 0.055, 0.022),
        k4: Vec3::new(4.0, 4.1, 3.2),
        k5: 0.55,
        gamma2: Vec3::new(0.01, 0.013, 0.014),
        gamma3: 0.012,
        integral: IntegralAction::OFF,
        rotors: RotorModel::OFF,
    }
}

/// Every number of a configuration as text, by its path.
fn numbers(value: &serde_json::Value, path: &str, found: &mut Vec<(String, f64)>) {
    match value {
        serde_json::Value::Object(fields) => {
            for (name, value) in fields {
                let dot = if path.is_empty() { "" } else { "." };
                numbers(value, &std::format!("{path}{dot}{name}"), found);
            }
        }
        serde_json::Value::Array(items) => {
            for (name, value) in ["x", "y", "z"].into_iter().zip(items) {
                numbers(value, &std::format!("{path}.{name}"), found);
            }
        }
        value => found.push((path.into(), value.as_f64().unwrap())),
    }
}

/// Asserts that the table names every number of the configuration but the step period.
fn assert_complete<C: Parameters + serde::Serialize>(config: C) {
    let mut found = Vec::new();
    numbers(&serde_json::to_value(config).unwrap(), "", &mut found);
    found.retain(|(name, _)| name != "step_period");
    assert_eq!(found.len(), C::NAMES.len());
    for (name, value) in found {
        let index = C::parameter_index(&name).unwrap_or_else(|| panic!("{name} is missing"));
        assert_eq!(config.parameter_at(index), Some((C::NAMES[usize::from(index)], value as f32)));
    }
    let names: HashSet<_> = C::NAMES.iter().collect();
    assert!(names.len() == C::NAMES.len() && names.iter().all(|name| name.len() <= NAME_MAX));
}

#[test]
fn every_number_of_both_configurations_has_a_name() {
    assert_complete(saturated());
    let SaturatedConfig { step_period, reference_acceleration_max, uncertainty, initial, .. } =
        saturated();
    assert_complete(RobustAdaptiveConfig {
        step_period,
        reference_acceleration_max,
        uncertainty,
        initial,
        cascade: cascade(),
        k4: Vec3::new(3.0, 3.1, 2.2),
        gamma2: Vec3::new(0.01, 0.013, 0.014),
        integral: IntegralAction::OFF,
        rotors: RotorModel::OFF,
    });
}

#[test]
fn writing_changes_the_named_field_only() {
    for (index, &name) in (0..).zip(SaturatedConfig::NAMES) {
        let changed = saturated().with_parameter(name, 123.0).unwrap();
        for other in 0..SaturatedConfig::NAMES.len() as u16 {
            let expected =
                if other == index { Some((name, 123.0)) } else { saturated().parameter_at(other) };
            assert_eq!(changed.parameter_at(other), expected);
        }
        assert_eq!(changed.step_period, saturated().step_period);
    }
}

#[test]
fn unknown_names_and_indices_are_refused() {
    assert!(saturated().with_parameter("step_period", 1.0).is_none());
    assert!(saturated().with_parameter("", 1.0).is_none());
    assert_eq!(SaturatedConfig::parameter_index("cascade.k9"), None);
    assert_eq!(saturated().parameter_at(SaturatedConfig::NAMES.len() as u16), None);
}

#[test]
fn the_constructor_judges_what_is_written() {
    let refused = |name: &str, value| {
        let written = saturated().with_parameter(name, value).unwrap();
        Saturated::new(&written).err()
    };
    assert_eq!(refused("cascade.k1", 0.6), None);
    assert_eq!(refused("k4.y", -1.0).unwrap().parameter, "k4[1]");
    for (name, value) in [
        ("cascade.k1", f32::NAN),
        ("cascade.M1", 9.0),
        ("torque_max.z", -1.0),
        ("initial.mass", 2.0),
    ] {
        let error = refused(name, value).unwrap_or_else(|| panic!("{name} = {value} is taken"));
        assert!(matches!(Rejection::from(error), Rejection::Invalid { .. }));
    }
}

#[test]
fn all_values_are_read_and_set_in_the_order_of_the_table() {
    let mut values = [0.0; 60];
    let count = SaturatedConfig::NAMES.len();
    saturated().read_all(&mut values);
    for (index, value) in (0..).zip(&values[..count]) {
        assert_eq!(saturated().parameter_at(index).unwrap().1, *value);
    }
    let doubled = values.map(|value| value * 2.0);
    let mut back = [0.0; 60];
    saturated().with_all(&doubled).read_all(&mut back);
    assert_eq!(back[..count], doubled[..count]);
    // No more than there is room for, and no more than there are.
    saturated().read_all(&mut back[..3]);
    assert_eq!(back[..4], [values[0], values[1], values[2], doubled[3]]);
    assert_eq!(saturated().with_all(&values), saturated());
    assert_eq!(saturated().with_all(&[]), saturated());
}
