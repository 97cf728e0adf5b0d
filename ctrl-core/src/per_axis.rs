//! Vectors of limits and gains, one element per body axis, as files have them: one number stands for
//! all three axes, and a vector of three equal elements is written as one number.
//!
//! ```
//! # #[cfg(feature = "serde")] {
//! use glam::Vec3;
//!
//! #[derive(serde::Serialize, serde::Deserialize)]
//! struct Limits {
//!     /// Torque limits (N m).
//!     #[serde(with = "ctrl_core::per_axis")]
//!     torque_max: Vec3,
//! }
//! # }
//! ```
//! Formats that are not for people, such as postcard, always have all three elements.

use core::fmt;

use glam::Vec3;
use serde::de::value::SeqAccessDeserializer;
use serde::de::{Deserializer, Error, SeqAccess, Visitor};
use serde::{Deserialize, Serialize, Serializer};

/// Writes a vector; one number if its elements are equal and the format is for people.
///
/// # Errors
/// Those of the format.
pub fn serialize<S: Serializer>(vector: &Vec3, serializer: S) -> Result<S::Ok, S::Error> {
    if serializer.is_human_readable() && *vector == Vec3::splat(vector.x) {
        serializer.serialize_f32(vector.x)
    } else {
        vector.serialize(serializer)
    }
}

/// Reads a vector, or one number for all three elements.
///
/// # Errors
/// Those of the format, and what is neither a number nor three of them.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec3, D::Error> {
    if deserializer.is_human_readable() {
        deserializer.deserialize_any(NumberOrVector)
    } else {
        Vec3::deserialize(deserializer)
    }
}

struct NumberOrVector;

impl<'de> Visitor<'de> for NumberOrVector {
    type Value = Vec3;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a number, or three of them, one per axis")
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Vec3, E> {
        Ok(Vec3::splat(number as f32))
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<Vec3, E> {
        Ok(Vec3::splat(number as f32))
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<Vec3, E> {
        Ok(Vec3::splat(number as f32))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, elements: A) -> Result<Vec3, A::Error> {
        Vec3::deserialize(SeqAccessDeserializer::new(elements))
    }
}
