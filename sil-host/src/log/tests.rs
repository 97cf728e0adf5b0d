//! What holds for every topic, and for both formats.

use std::collections::BTreeSet;

use ctrl_core::vehicle::WrenchBounds;

use super::topic::{Topic, Value};
use super::topics::{PREFIX, TOPICS};
use super::{px4, ticks_between};

const BOUNDS: WrenchBounds = WrenchBounds { thrust_min: 1.0, thrust_max: 12.0, torque_max: 0.05 };

/// Every topic of a ULog with its name there.
fn all() -> Vec<(String, &'static Topic)> {
    let own = TOPICS.iter().map(|topic| (format!("{PREFIX}_{}", topic.name), *topic));
    own.chain(px4::topics(&BOUNDS).map(|topic| (topic.name.to_owned(), topic))).collect()
}

#[test]
fn names_are_unique_and_plain() {
    let plain = |name: &str| name.bytes().all(|c| matches!(c, b'a'..=b'z' | b'0'..=b'9' | b'_'));
    let mut names = BTreeSet::new();
    for (name, topic) in all() {
        assert!(plain(&name), "{name}");
        let mut fields = BTreeSet::from(["timestamp"]);
        assert!(topic.fields.iter().all(|field| plain(field.name) && fields.insert(field.name)));
        assert!(names.insert(name));
    }
}

#[test]
fn every_field_lies_at_a_multiple_of_its_size() {
    for (name, topic) in all() {
        let mut offset = 8;
        for field in topic.fields {
            let (size, count) = match field.value {
                Value::Float(_) => (4, 1),
                Value::Vector(_) => (4, 3),
                Value::Quaternion(_) => (4, 4),
                Value::Double(_) | Value::Count(_) => (8, 1),
                Value::Bits(_) => (2, 1),
            };
            assert_eq!(offset % size, 0, "{name}.{}", field.name);
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

/// The rows that the page must have for these topics.
fn rows<'a>(topics: impl Iterator<Item = (String, &'a Topic)>) -> String {
    let mut rows = String::new();
    for (name, topic) in topics {
        for (index, field) in topic.fields.iter().enumerate() {
            let first =
                if index == 0 { format!("`{name}`: {}", topic.what) } else { String::new() };
            let row = [&*first, &format!("`{}`", field.name), field.unit, field.what];
            rows += &format!("| {} |\n", row.join(" | "));
        }
    }
    rows
}

#[test]
fn the_page_lists_every_topic() {
    let page = include_str!("../../../docs/logs.md");
    let own = rows(all().into_iter().take(TOPICS.len()));
    assert!(page.contains(&own), "docs/logs.md lacks\n{own}");
    let known = rows(all().into_iter().skip(TOPICS.len()));
    assert!(page.contains(&known), "docs/logs.md lacks\n{known}");
}
