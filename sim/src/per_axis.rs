//! Vectors of limits, one element per body axis, as scenario files have them: one number stands for all
//! three axes, and a vector of three equal elements is written as one number. `ctrl_core::per_axis` in `f64`.

use glam::DVec3;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A vector as a file has it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number, or three of them, one per axis")]
enum NumberOrVector {
    Number(f64),
    Vector(DVec3),
}

impl From<DVec3> for NumberOrVector {
    fn from(vector: DVec3) -> Self {
        let alike = vector == DVec3::splat(vector.x);
        if alike { Self::Number(vector.x) } else { Self::Vector(vector) }
    }
}

impl From<NumberOrVector> for DVec3 {
    fn from(read: NumberOrVector) -> Self {
        match read {
            NumberOrVector::Number(number) => Self::splat(number),
            NumberOrVector::Vector(vector) => vector,
        }
    }
}

/// Writes a vector; one number if its elements are equal.
///
/// # Errors
/// Those of the format.
pub fn serialize<S: Serializer>(vector: &DVec3, serializer: S) -> Result<S::Ok, S::Error> {
    NumberOrVector::from(*vector).serialize(serializer)
}

/// Reads a vector, or one number for all three elements.
///
/// # Errors
/// Those of the format, and what is neither a number nor three of them.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<DVec3, D::Error> {
    NumberOrVector::deserialize(deserializer).map(DVec3::from)
}

/// The same of a vector that may be absent.
pub mod optional {
    use super::{DVec3, Deserialize, Deserializer, NumberOrVector, Serialize, Serializer};

    /// Writes a vector, if there is one.
    ///
    /// # Errors
    /// As [`serialize`](super::serialize).
    pub fn serialize<S: Serializer>(
        vector: &Option<DVec3>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        vector.map(NumberOrVector::from).serialize(serializer)
    }

    /// Reads a vector that is there.
    ///
    /// # Errors
    /// As [`deserialize`](super::deserialize).
    pub fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<DVec3>, D::Error> {
        Ok(Option::<NumberOrVector>::deserialize(deserializer)?.map(DVec3::from))
    }
}
