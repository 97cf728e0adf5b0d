//! Scenario of a proposal: built-in scenarios filled with its values, so that keys, order and comments
//! are those of the files.

use ctrl_core::config::IntegralAction;
use ctrl_core::controller::ControllerConfig;
use ctrl_core::filter::RateFilterConfig;
use ctrl_core::rotors::RotorModel;
use glam::Vec3;
use sim::scenario::BuiltIn;
use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::digits::decimal;
use super::margin::Rotors;
use super::proposal::Proposal;

/// Scenario that hovers, with controller 1.
const HOVER: &str = "hover-gusts";

/// Scenario whose tables of controller 2 are taken.
const SATURATED: &str = "paper-saturated";

impl Proposal {
    /// A complete scenario: hover beside the reference, noise at the disturbances' bounds.
    #[must_use]
    pub fn scenario(&self) -> String {
        let Self { request, settle_time, duration, .. } = self;
        let mut document = template(&self.law);
        if let Some(mut key) = document.key_mut("name") {
            key.leaf_decor_mut().set_prefix(
                "# Gains proposed by `sil-host tune`. SI units unless the key says otherwise.\n\n",
            );
        }
        let reference = document["trajectory"]["hover"]["position_world"].as_array();
        let reference =
            reference.map(|it| it.iter().filter_map(Value::as_float).collect::<Vec<_>>());
        let offsets = self.start_offset().to_array();
        let start = reference.unwrap_or_default().into_iter().zip(offsets);
        let start: Array = start.map(|(reference, offset)| reference + offset).collect();
        let known = &request.known;
        let [position, attitude, tilt, heading] = self.bounds();
        let values: [(&[&str], Value); 14] = [
            (&["name"], request.name.as_str().into()),
            (&["description"], "Hover with the gains that sil-host tune proposes.".into()),
            (&["duration"], (*duration).into()),
            (&["vehicle", "mass"], decimal(request.initial.mass).into()),
            (&["vehicle", "inertia"], vector(request.initial.inertia).into()),
            (&["initial", "position"], start.into()),
            (
                &["disturbance", "noise", "acceleration"],
                decimal(known.disturbance_acceleration).into(),
            ),
            (&["disturbance", "noise", "torque"], per_axis(known.disturbance_torque)),
            (&["guarantees", "settle_time"], (*settle_time).into()),
            (&["guarantees", "position_error_max"], position.into()),
            (&["guarantees", "attitude_error_max"], attitude.into()),
            (&["guarantees", "tilt_error_max"], tilt.into()),
            (&["guarantees", "heading_error_max"], heading.into()),
            (&["guarantees", "lyapunov_window"], 1.0.into()),
        ];
        for (path, value) in values {
            fill(path.iter().fold(document.as_item_mut(), |item, key| &mut item[*key]), value);
        }
        if !request.rotors.is_prompt() {
            let mut actuation = Table::new();
            let Rotors { lag, delay } = request.rotors;
            for (key, value, comment) in [
                ("delay", delay, "of a command [s]"),
                ("rotor_lag", lag, "time constant of thrust and torque [s]"),
            ] {
                let value = Value::from(value).decorated(" ", format!("    # {comment}"));
                actuation.insert(key, Item::Value(value));
            }
            actuation.decor_mut().set_prefix("\n# Between command and wrench.\n");
            document["actuation"] = Item::Table(actuation);
        }
        if !request.rate_filter.is_empty() {
            document["rate_filter"] = Item::Table(filters(&request.rate_filter));
        }
        if let Some(disturbance) = document["disturbance"].as_table_mut() {
            disturbance.remove("gust");
        }
        document.to_string()
    }
}

/// The model of the rotors as a scenario has it.
fn rotors(law: &ControllerConfig) -> Table {
    let RotorModel { lag, residual_lag } = *law.rotors();
    let rows = [
        ("lag", lag, "of the torque behind its command [s]"),
        ("residual_lag", residual_lag, "what the lead leaves of it [s]"),
    ];
    commented("Model of the rotors inside the law.", &rows.map(|it| (it.0, it.1, it.2.to_owned())))
}

/// The integral action as a scenario has it.
fn integral(law: &ControllerConfig) -> Table {
    let IntegralAction { acceleration_max, gamma_d, torque_max, gamma_t } = *law.integral();
    let unit = if matches!(law, ControllerConfig::Saturated(_)) { "1/s^2" } else { "N m" };
    let rows = [
        ("acceleration_max", acceleration_max, "D_c, each horizontal component [m/s^2]"),
        ("gamma_d", gamma_d, "gain of d_hat [m/s^2]"),
        ("torque_max", torque_max, "D_t, each component [N m]"),
        ("gamma_t", gamma_t, &format!("gain of the torque's estimate [{unit}]")),
    ];
    let rows = rows.map(|it| (it.0, it.1, it.2.to_owned()));
    commented("Integral action: what lasts, on top of D1 and D2.", &rows)
}

/// A table with a comment above and one behind each value.
fn commented(title: &str, rows: &[(&str, f32, String)]) -> Table {
    let mut table = Table::new();
    table.decor_mut().set_prefix(format!("\n# {title}\n"));
    for (key, value, comment) in rows {
        let value = Value::from(decimal(*value)).decorated(" ", format!("    # {comment}"));
        table.insert(key, Item::Value(value));
    }
    table
}

/// The filters of the rate as a scenario has them.
fn filters(filter: &RateFilterConfig) -> Table {
    let section = |frequency: f32, quality: f32| {
        let values = [("frequency", frequency), ("quality", quality)];
        values.map(|(key, value)| (key, decimal(value))).into_iter().collect::<InlineTable>()
    };
    let mut table = Table::new();
    table
        .decor_mut()
        .set_prefix("\n# Between the body rate and the controller; frequencies in Hz.\n");
    if let Some(it) = filter.low_pass {
        table.insert("low_pass", Item::Value(section(it.frequency, it.quality).into()));
    }
    if !filter.notches.is_empty() {
        let notches = filter.notches.iter().map(|it| section(it.frequency, it.quality));
        table.insert("notches", Item::Value(notches.collect::<Array>().into()));
    }
    table
}

fn vector(x: Vec3) -> Array {
    x.to_array().map(decimal).into_iter().collect()
}

/// One number for three that are equal.
fn per_axis(x: Vec3) -> Value {
    if x == Vec3::splat(x.x) { decimal(x.x).into() } else { vector(x).into() }
}

/// The controller's tables as a scenario has them.
#[must_use]
pub fn controller(law: &ControllerConfig) -> String {
    let mut document = template(law);
    document.as_table_mut().retain(|key, _| key == "controller");
    document.to_string().trim_start().to_owned()
}

/// The scenario that hovers, with `law` in its place.
fn template(law: &ControllerConfig) -> DocumentMut {
    let mut document = built_in(HOVER);
    if matches!(law, ControllerConfig::Saturated(_)) {
        let mut controller = built_in(SATURATED)["controller"].clone();
        place(&mut controller["saturated"], &document["controller"]["robust_adaptive"]);
        document["controller"] = controller;
    }
    let mut values = toml_edit::ser::to_document(law).expect("a configuration is plain TOML");
    if let Some(own) = values[law.key()].as_table_like_mut() {
        own.remove("integral");
        own.remove("rotors");
    }
    let place = document["controller"][law.key()]["uncertainty"].as_table().cloned();
    let place = place.and_then(|it| it.position());
    let on = [
        ("integral", *law.integral() != IntegralAction::OFF, integral(law)),
        ("rotors", *law.rotors() != RotorModel::OFF, rotors(law)),
    ];
    for (key, _, mut table) in on.into_iter().filter(|(_, on, _)| *on) {
        table.set_position(place);
        document["controller"][law.key()][key] = Item::Table(table);
    }
    let known = &mut document["controller"][law.key()]["uncertainty"];
    if let Some(known) = known.as_table_mut() {
        known.decor_mut().set_prefix("\n# What the controller is told of the vehicle.\n");
    }
    if let Some(controller) = document["controller"].as_table_like_mut() {
        merge(controller, values.as_table());
    }
    document
}

fn built_in(name: &str) -> DocumentMut {
    let text = BuiltIn::named(name).map(|it| it.text).expect("a built-in scenario");
    text.parse().expect("a built-in scenario is TOML")
}

/// Gives `item` and its tables the places in the file that `other` and its tables of the same names have.
fn place(item: &mut Item, other: &Item) {
    let (Some(table), Some(other)) = (item.as_table_mut(), other.as_table()) else { return };
    table.set_position(other.position());
    for (key, item) in table.iter_mut() {
        if let Some(other) = other.get(key.get()) {
            place(item, other);
        }
    }
}

/// Puts every value of `values` in its place in `table`; what is not there is added.
fn merge(table: &mut dyn TableLike, values: &dyn TableLike) {
    for (key, item) in values.iter() {
        match (table.get_mut(key), item.as_table_like(), item.as_value()) {
            (Some(old), Some(values), _) => {
                if let Some(table) = old.as_table_like_mut() {
                    merge(table, values);
                }
            }
            (Some(old), None, Some(value)) => fill(old, short(value)),
            (None, _, Some(value)) => {
                table.insert(key, Item::Value(short(value)));
            }
            _ => {
                table.insert(key, item.clone());
            }
        }
    }
}

/// Replaces a value; the comment behind it stays in its column where there is room.
fn fill(item: &mut Item, mut value: Value) {
    if let Some(old) = item.as_value() {
        let width = |value: &Value| value.clone().decorated("", "").to_string().len();
        let comment = old.decor().suffix().and_then(|suffix| suffix.as_str()).unwrap_or_default();
        let spaces = comment.len() - comment.trim_start().len() + width(old);
        let spaces =
            if comment.is_empty() { 0 } else { spaces.saturating_sub(width(&value)).max(1) };
        let suffix = format!("{:spaces$}{}", "", comment.trim_start());
        *value.decor_mut() = old.decor().clone();
        value.decor_mut().set_suffix(suffix);
    }
    *item = Item::Value(value);
}

/// A number of the core's precision in its shortest decimals; TOML has `f64` alone.
fn short(value: &Value) -> Value {
    match value {
        Value::Float(number) => decimal(*number.value() as f32).into(),
        Value::Array(array) => array.iter().map(short).collect::<Array>().into(),
        other => other.clone(),
    }
}
