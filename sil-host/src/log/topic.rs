//! What a topic is: a name and fields, each with its type, unit and where its value comes from.

use glam::{DQuat, DVec3, Vec3};

use super::moment::Moment;

/// Values of one instant that are written together, after the time.
#[derive(Debug)]
pub struct Topic {
    /// Name, lower case with underscores.
    pub name: &'static str,
    /// What it shows.
    pub what: &'static str,
    /// Its fields in the order of writing.
    pub fields: &'static [Field],
}

/// One value of a topic.
#[derive(Debug)]
pub struct Field {
    /// Name, lower case with underscores.
    pub name: &'static str,
    /// Unit, `-` for none.
    pub unit: &'static str,
    /// What it is.
    pub what: &'static str,
    /// Its type, and how to get it.
    pub value: Value,
}

/// The type of a field together with the function that reads it.
#[derive(Clone, Copy, Debug)]
pub enum Value {
    /// A single number.
    Float(fn(&Moment<'_>) -> f32),
    /// A number in double precision.
    Double(fn(&Moment<'_>) -> f64),
    /// Three numbers: x, y, z.
    Vector(fn(&Moment<'_>) -> Vec3),
    /// Four numbers, scalar first: w, x, y, z.
    Quaternion(fn(&Moment<'_>) -> [f32; 4]),
    /// A count.
    Count(fn(&Moment<'_>) -> u64),
    /// Bits.
    Bits(fn(&Moment<'_>) -> u16),
}

/// A quaternion in single precision, scalar first.
#[must_use]
pub fn scalar_first(q: DQuat) -> [f32; 4] {
    [q.w, q.x, q.y, q.z].map(|component| component as f32)
}

/// A vector in single precision.
#[must_use]
pub fn single(v: DVec3) -> Vec3 {
    v.as_vec3()
}

/// A field; for tables.
#[must_use]
pub const fn field(
    name: &'static str,
    unit: &'static str,
    what: &'static str,
    value: Value,
) -> Field {
    Field { name, unit, what, value }
}
