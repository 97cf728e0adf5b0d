//! The page for users, against the code.

use std::path::Path;
use std::{format, fs};

use super::*;

const PAGE: &str = include_str!("../../../docs/how-to/ground-station.md");

/// Names in backquotes in the last column of a table.
fn tests() -> impl Iterator<Item = (&'static str, &'static str)> {
    let last = PAGE.lines().filter_map(|line| line.strip_suffix("` |")?.rsplit('`').next());
    last.filter_map(|cell| cell.split_once("::"))
}

#[test]
fn every_documented_test_exists() {
    assert!(tests().count() > 30);
    for (module, name) in tests() {
        let file = format!("src/tests/{module}.rs");
        let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(&file));
        let text = text.unwrap_or_else(|error| panic!("{file}: {error}"));
        assert!(text.contains(&format!("fn {name}(")), "{module}::{name} does not exist");
    }
}

#[test]
fn every_parameter_is_documented_under_both_names() {
    for ParameterName { short, long } in NAMES {
        let row = format!("| `{short}` | `{long}` |\n");
        assert!(PAGE.contains(&row), "the page lacks {row}");
    }
    let rows =
        PAGE.lines().filter(|line| line.starts_with("| `CTL_") || line.starts_with("| `VEH_"));
    let controllers =
        NAMES.iter().filter(|n| n.short.starts_with("CTL_") || n.short.starts_with("VEH_"));
    assert_eq!(rows.count(), controllers.count());
}

#[test]
fn every_stream_is_documented() {
    for id in 0..1000 {
        let mut air = Air::new();
        air.vehicle.lasting =
            Some(Lasting { acceleration_world: Vec3::ZERO, torque_body: Vec3::ZERO });
        let Some(frame) = air.protocol.telemetry(id, &mut air.vehicle) else { continue };
        use mavlink::Message;
        use mavlink::dialects::common::MavMessage;
        let message = MavMessage::default_message_from_id(sent(&frame).id).unwrap();
        let name = format!("`{}`", message.message_name());
        assert!(PAGE.contains(&name), "the page lacks {name}");
    }
}
