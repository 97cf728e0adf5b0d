//! Properties of every topic in both formats.

use std::collections::BTreeSet;

use ctrl_core::vehicle::WrenchBounds;
use glam::Vec3;
use sim::quantity::{Quantity, TOPICS};

use super::moment::MOTORS;
use super::{PREFIX, px4, ticks_between};

const BOUNDS: WrenchBounds =
    WrenchBounds { thrust_min: 1.0, thrust_max: 12.0, torque_max: Vec3::new(0.05, 0.05, 0.02) };

/// A field of a ULog: name, unit, meaning, and size and number of its values.
type Field = (&'static str, &'static str, &'static str, (usize, usize));

/// Every topic of a ULog with its name there, its meaning and its fields; ours come first.
fn all() -> Vec<(String, &'static str, Vec<Field>)> {
    let own = TOPICS.iter().map(|topic| {
        let fields = topic.quantities.iter().map(field).collect();
        (format!("{PREFIX}_{}", topic.name), topic.meaning, fields)
    });
    let px4 = px4::topics(&BOUNDS, true).map(|topic| {
        let more = topic.more.iter().map(more);
        (topic.name.to_owned(), topic.meaning, topic.fields.iter().map(field).chain(more).collect())
    });
    own.chain(px4).collect()
}

fn field<I>(it: &Quantity<I>) -> Field {
    use sim::quantity::Value::{Bits, Count, Double, Quaternion, Single, Time, Vector};
    let size = match it.value {
        Single(_) | Vector(_) | Quaternion(_) => 4,
        Double(_) | Count(_) | Time(_) => 8,
        Bits(_) => 2,
    };
    (it.field, it.unit, it.meaning, (size, it.width()))
}

fn more(it: &px4::More) -> Field {
    let size = match it.value {
        px4::MoreValue::Motors(_) => (4, MOTORS),
        px4::MoreValue::State(_) => (1, 1),
    };
    (it.name, it.unit, it.meaning, size)
}

#[test]
fn names_are_unique_and_plain() {
    let plain = |name: &str| name.bytes().all(|c| matches!(c, b'a'..=b'z' | b'0'..=b'9' | b'_'));
    let mut names = BTreeSet::new();
    for (name, _, fields) in all() {
        assert!(plain(&name), "{name}");
        let mut unique = BTreeSet::from(["timestamp"]);
        assert!(fields.iter().all(|(field, ..)| plain(field) && unique.insert(field)));
        assert!(names.insert(name));
    }
}

#[test]
fn every_field_lies_at_a_multiple_of_its_size() {
    for (name, _, fields) in all() {
        let mut offset = 8;
        for (field, _, _, (size, count)) in fields {
            assert_eq!(offset % size, 0, "{name}.{field}");
            offset += size * count;
        }
    }
}

#[test]
fn the_rate_is_the_nearest_that_ticks_allow() {
    for (rate, ticks) in [(1000.0, 1), (100.0, 10), (300.0, 3), (1e9, 1), (0.1, 10_000)] {
        assert_eq!(ticks_between(rate, f64::from(1e-3_f32)), ticks, "{rate}");
    }
}

/// The rows of these topics on the page.
fn rows(topics: &[(String, &str, Vec<Field>)]) -> String {
    let mut rows = String::new();
    for (name, topic_meaning, fields) in topics {
        for (index, (field, unit, meaning, _)) in fields.iter().enumerate() {
            let first =
                if index == 0 { format!("`{name}`: {topic_meaning}") } else { String::new() };
            rows += &format!("| {first} | `{field}` | {unit} | {meaning} |\n");
        }
    }
    rows
}

#[test]
fn the_page_lists_every_topic() {
    let page = include_str!("../../../docs/logs.md");
    let all = all();
    let (own, px4) = all.split_at(TOPICS.len());
    for topics in [own, px4] {
        let rows = rows(topics);
        assert!(
            page.contains(&format!("|---|---|---|---|\n{rows}\n")),
            "docs/logs.md lacks\n{rows}"
        );
    }
}
