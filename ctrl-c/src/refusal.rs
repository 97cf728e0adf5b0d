//! Refusal of a parameter, in plain memory of the caller.

use core::ffi::c_char;

use ctrl_core::error::{Bound, ConfigError};

use crate::access::Sized32;
use crate::result::Failure;
use crate::result::code::GYRFALCON_PARAMETER_REFUSED;

/// Bytes of each text of a refusal, with its closing zero.
pub const GYRFALCON_NAME_SIZE: usize = 96;

/// Kinds of bounds.
pub mod bound {
    /// Of a kind that this version of the interface does not name: `source` tells.
    pub const GYRFALCON_BOUND_OTHER: u32 = 0;
    /// Finite.
    pub const GYRFALCON_BOUND_FINITE: u32 = 1;
    /// Finite and above zero.
    pub const GYRFALCON_BOUND_POSITIVE: u32 = 2;
    /// Finite and not negative.
    pub const GYRFALCON_BOUND_NOT_NEGATIVE: u32 = 3;
    /// Below `upper`.
    pub const GYRFALCON_BOUND_BELOW: u32 = 4;
    /// At most `upper`.
    pub const GYRFALCON_BOUND_AT_MOST: u32 = 5;
    /// At least `lower`.
    pub const GYRFALCON_BOUND_AT_LEAST: u32 = 6;
    /// From `lower` to `upper`, both included.
    pub const GYRFALCON_BOUND_INSIDE: u32 = 7;
}

use bound::*;

/// A parameter outside the set in which the guarantees hold.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct GyrfalconRefusal {
    /// `sizeof(gyrfalcon_refusal)`.
    pub struct_size: u32,
    /// Kind of the bound, one of `GYRFALCON_BOUND_*`.
    pub bound: u32,
    /// Value of the parameter.
    pub value: f32,
    /// Smallest permitted value; minus infinity if there is none.
    pub lower: f32,
    /// Largest permitted value; infinity if there is none.
    pub upper: f32,
    /// Name of the parameter as in the configuration, or the expression of several; ends with a zero.
    pub parameter: [c_char; GYRFALCON_NAME_SIZE],
    /// Origin of the bound: an equation, or the reason in a few words; ends with a zero.
    pub source: [c_char; GYRFALCON_NAME_SIZE],
}

impl Sized32 for GyrfalconRefusal {}

impl GyrfalconRefusal {
    /// No refusal yet.
    pub const EMPTY: Self = Self {
        struct_size: Self::SIZE,
        bound: 0,
        value: 0.0,
        lower: 0.0,
        upper: 0.0,
        parameter: [0; GYRFALCON_NAME_SIZE],
        source: [0; GYRFALCON_NAME_SIZE],
    };

    /// Takes the content of `error`.
    fn fill(&mut self, error: &ConfigError) {
        let (kind, lower, upper) = match error.bound {
            Bound::Finite => (GYRFALCON_BOUND_FINITE, f32::NEG_INFINITY, f32::INFINITY),
            Bound::Positive => (GYRFALCON_BOUND_POSITIVE, 0.0, f32::INFINITY),
            Bound::NotNegative => (GYRFALCON_BOUND_NOT_NEGATIVE, 0.0, f32::INFINITY),
            Bound::Below(limit) => (GYRFALCON_BOUND_BELOW, f32::NEG_INFINITY, limit),
            Bound::AtMost(limit) => (GYRFALCON_BOUND_AT_MOST, f32::NEG_INFINITY, limit),
            Bound::AtLeast(limit) => (GYRFALCON_BOUND_AT_LEAST, limit, f32::INFINITY),
            Bound::Inside(lower, upper) => (GYRFALCON_BOUND_INSIDE, lower, upper),
            _ => (GYRFALCON_BOUND_OTHER, f32::NEG_INFINITY, f32::INFINITY),
        };
        (self.bound, self.value, self.lower, self.upper) = (kind, error.value, lower, upper);
        copy(error.parameter, &mut self.parameter);
        copy(error.source, &mut self.source);
    }
}

/// Copies as much of `text` as fits in front of a closing zero.
fn copy(text: &str, to: &mut [c_char; GYRFALCON_NAME_SIZE]) {
    *to = [0; GYRFALCON_NAME_SIZE];
    let room = to.iter_mut().take(GYRFALCON_NAME_SIZE - 1);
    room.zip(text.bytes()).for_each(|(to, byte)| *to = byte as c_char);
}

/// Hands `error` to the caller, who may not want it.
pub(crate) fn refused(error: &ConfigError, refusal: Option<&mut GyrfalconRefusal>) -> Failure {
    if let Some(refusal) = refusal {
        refusal.fill(error);
    }
    Failure(GYRFALCON_PARAMETER_REFUSED)
}
