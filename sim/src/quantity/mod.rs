//! The quantities of a flight: name, unit, meaning, type, and the function that reads each from a
//! [`Tick`].
//!
//! This one table serves the trace, every log format, the figures, the replay and the tables in the
//! documentation. [`TOPICS`] groups the logged quantities as logs do; [`table`] defines them.

pub mod table;
mod topic;

pub use topic::{TOPICS, Topic};

use glam::{Quat, Vec3};

use crate::tick::Tick;

/// A quantity of a flight, read from `I`.
#[derive(Clone, Copy, Debug)]
pub struct Quantity<I = Tick> {
    /// Name, unique in the table: lower case with underscores.
    pub name: &'static str,
    /// Name among the quantities of its topic.
    pub field: &'static str,
    /// Unit, `-` for none.
    pub unit: &'static str,
    /// Symbol, equation and frame; equation numbers are the paper's.
    pub meaning: &'static str,
    /// Type, and the function that reads it.
    pub value: Value<I>,
}

/// The type of a quantity together with the function that reads it.
#[derive(Clone, Copy, Debug)]
pub enum Value<I = Tick> {
    /// A number in single precision.
    Single(fn(&I) -> f32),
    /// A number in double precision.
    Double(fn(&I) -> f64),
    /// Three numbers in single precision: x, y, z.
    Vector(fn(&I) -> Vec3),
    /// Four numbers in single precision, written scalar first: w, x, y, z.
    Quaternion(fn(&I) -> Quat),
    /// A time (s), not negative; each format writes it in a resolution of its own.
    Time(fn(&I) -> f64),
    /// A count.
    Count(fn(&I) -> u64),
    /// Bits.
    Bits(fn(&I) -> u16),
}

impl<I> Quantity<I> {
    /// Number of components.
    #[must_use]
    pub const fn width(&self) -> usize {
        self.suffixes().len()
    }

    /// Endings of the components' names, in the order of writing.
    #[must_use]
    pub const fn suffixes(&self) -> &'static [&'static str] {
        match self.value {
            Value::Vector(_) => &["_x", "_y", "_z"],
            Value::Quaternion(_) => &["_w", "_x", "_y", "_z"],
            _ => &[""],
        }
    }

    /// Names of the components, in the order of writing.
    pub fn columns(&self) -> impl Iterator<Item = String> {
        let name = self.name;
        self.suffixes().iter().map(move |suffix| format!("{name}{suffix}"))
    }

    /// Passes the components to `take`, in the order of writing.
    #[inline]
    pub fn components(&self, input: &I, mut take: impl FnMut(f64)) {
        match self.value {
            Value::Single(read) => take(read(input).into()),
            Value::Double(read) | Value::Time(read) => take(read(input)),
            Value::Vector(read) => read(input).to_array().into_iter().for_each(|x| take(x.into())),
            Value::Quaternion(read) => {
                scalar_first(read(input)).into_iter().for_each(|x| take(x.into()));
            }
            Value::Count(read) => take(read(input) as f64),
            Value::Bits(read) => take(read(input).into()),
        }
    }
}

/// Components of a quaternion, scalar first.
#[inline]
#[must_use]
pub fn scalar_first(Quat { x, y, z, w }: Quat) -> [f32; 4] {
    [w, x, y, z]
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::guarantee::test_flight::{both, sample};

    #[test]
    fn names_are_unique_and_plain() {
        let plain = |name: &str| name.bytes().all(|c| matches!(c, b'a'..=b'z' | b'_'));
        let mut names = BTreeSet::new();
        for topic in TOPICS {
            let mut fields = BTreeSet::new();
            assert!(plain(topic.name));
            for quantity in topic.quantities {
                assert!(plain(quantity.name) && names.insert(quantity.name), "{}", quantity.name);
                assert!(fields.insert(quantity.field), "{}.{}", topic.name, quantity.field);
            }
        }
    }

    #[test]
    fn components_are_as_many_as_names_and_the_scalar_comes_first() {
        let mut tick = sample(&both(1e-3)[1]);
        tick.truth.attitude = glam::DQuat::from_xyzw(0.1, 0.2, 0.3, 0.9);
        tick.truth.position_world = glam::DVec3::new(4.0, 5.0, 6.0);
        let read = |quantity: &Quantity| {
            let mut components = Vec::new();
            quantity.components(&tick, |component| components.push(component));
            components
        };
        for quantity in TOPICS.iter().flat_map(|topic| topic.quantities) {
            assert_eq!(read(quantity).len(), quantity.width(), "{}", quantity.name);
            assert_eq!(quantity.columns().count(), quantity.width());
        }
        assert_eq!(read(&table::ATTITUDE), [0.9f32, 0.1, 0.2, 0.3].map(f64::from));
        assert_eq!(read(&table::POSITION), [4.0, 5.0, 6.0]);
        let columns: Vec<_> = table::ATTITUDE.columns().collect();
        assert_eq!(columns, ["attitude_w", "attitude_x", "attitude_y", "attitude_z"]);
    }
}
