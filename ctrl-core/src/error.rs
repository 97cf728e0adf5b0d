//! The error of every validating constructor: which parameter, its value, the bound it violates; and
//! the conditions of a controller, for the headroom of a configuration.

use core::fmt;

use glam::Vec3;

use crate::vehicle::Interval;

/// A parameter outside the set in which the guarantees hold.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ConfigError {
    /// Name of the parameter as in the configuration structs, or the expression of several.
    pub parameter: &'static str,
    /// Its value.
    pub value: f32,
    /// The bound that it violates.
    pub bound: Bound,
    /// Origin of the bound: an equation, or the reason in a few words.
    pub source: &'static str,
}

/// A bound on one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Bound {
    /// Finite.
    Finite,
    /// Finite and above zero.
    Positive,
    /// Finite and not negative.
    NotNegative,
    /// Below a number.
    Below(f32),
    /// At most a number.
    AtMost(f32),
    /// At least a number.
    AtLeast(f32),
    /// Inside a closed interval.
    Inside(f32, f32),
}

impl Bound {
    /// Returns `true` if `x` keeps the bound; `false` for NaN and the infinities.
    #[must_use]
    pub fn holds(self, x: f32) -> bool {
        x.is_finite()
            && match self {
                Self::Finite => true,
                Self::Positive => x > 0.0,
                Self::NotNegative => x >= 0.0,
                Self::Below(limit) => x < limit,
                Self::AtMost(limit) => x <= limit,
                Self::AtLeast(limit) => x >= limit,
                Self::Inside(lower, upper) => lower <= x && x <= upper,
            }
    }
}

impl Bound {
    /// Lower and upper end of the values that keep it; an end that is not a number of the bound is the
    /// largest finite one.
    #[must_use]
    pub const fn ends(self) -> (f32, f32) {
        match self {
            Self::Finite => (f32::MIN, f32::MAX),
            Self::Positive | Self::NotNegative => (0.0, f32::MAX),
            Self::Below(limit) | Self::AtMost(limit) => (f32::MIN, limit),
            Self::AtLeast(limit) => (limit, f32::MAX),
            Self::Inside(lower, upper) => (lower, upper),
        }
    }
}

impl From<Interval> for Bound {
    fn from(Interval { lower, upper }: Interval) -> Self {
        Self::Inside(lower, upper)
    }
}

impl fmt::Display for Bound {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Finite => out.write_str("finite"),
            Self::Positive => out.write_str("positive"),
            Self::NotNegative => out.write_str("zero or positive"),
            Self::Below(limit) => write!(out, "below {limit}"),
            Self::AtMost(limit) => write!(out, "at most {limit}"),
            Self::AtLeast(limit) => write!(out, "at least {limit}"),
            Self::Inside(lower, upper) => write!(out, "in [{lower}, {upper}]"),
        }
    }
}

impl ConfigError {
    /// The error of a constructor, of a controller of one's own too.
    #[must_use]
    pub const fn new(
        parameter: &'static str,
        value: f32,
        bound: Bound,
        source: &'static str,
    ) -> Self {
        Self { parameter, value, bound, source }
    }
}

impl fmt::Display for ConfigError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { parameter, value, bound, source } = self;
        write!(out, "{parameter} = {value} must be {bound} ({source})")
    }
}

impl core::error::Error for ConfigError {}

/// Condition of a constructor on one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Condition {
    /// Name of the parameter as in the configuration structs, or the expression of several.
    pub parameter: &'static str,
    /// Its value.
    pub value: f32,
    /// The bound that it must keep.
    pub bound: Bound,
    /// Origin of the bound: an equation, or the reason in a few words.
    pub source: &'static str,
}

impl Condition {
    /// Returns `true` if the value keeps its bound.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.bound.holds(self.value)
    }
}

/// Receiver of the conditions of a constructor, one after the other; a constructor stops at its first error.
pub(crate) trait Judge {
    /// Judges `condition`; an error stops the constructor.
    fn judge(&mut self, condition: Condition) -> Result<(), ConfigError>;

    /// [`judge`](Self::judge) of a condition in its parts. Not inlined, for its size.
    #[inline(never)]
    fn require(
        &mut self,
        parameter: &'static str,
        value: f32,
        bound: Bound,
        source: &'static str,
    ) -> Result<(), ConfigError> {
        self.judge(Condition { parameter, value, bound, source })
    }

    /// A condition on each axis of `value`; one condition while all axes are alike. Not inlined: a constructor
    /// has ten of them, and each would take code and stack of its own.
    #[inline(never)]
    fn require_axes(
        &mut self,
        names: &'static AxisNames,
        value: Vec3,
        bounds: [Bound; 3],
        source: &'static str,
    ) -> Result<(), ConfigError> {
        let [x, y, z] = value.to_array();
        let alike = x.to_bits() == y.to_bits() && x.to_bits() == z.to_bits();
        if alike && bounds[0] == bounds[1] && bounds[0] == bounds[2] {
            return self.require(names.all, x, bounds[0], source);
        }
        let [of_x, of_y, of_z] = bounds;
        self.require(names.each[0], x, of_x, source)?;
        self.require(names.each[1], y, of_y, source)?;
        self.require(names.each[2], z, of_z, source)
    }
}

/// Names of a condition on the three body axes: on all of them, while they are alike, and on each.
#[derive(Clone, Copy)]
pub(crate) struct AxisNames {
    pub all: &'static str,
    pub each: [&'static str; 3],
}

/// [`AxisNames`] of a field, `name[0]`, or of an expression, `name about x`.
macro_rules! axis_names {
    ($name:literal) => {
        axis_names!($name, "[0]", "[1]", "[2]")
    };
    (expression $name:literal) => {
        axis_names!($name, " about x", " about y", " about z")
    };
    ($name:literal, $x:literal, $y:literal, $z:literal) => {
        &$crate::error::AxisNames {
            all: $name,
            each: [concat!($name, $x), concat!($name, $y), concat!($name, $z)],
        }
    };
}
pub(crate) use axis_names;

/// The constructors' judge: the first condition that does not hold is the error.
pub(crate) struct Strict;

impl Judge for Strict {
    fn judge(&mut self, condition: Condition) -> Result<(), ConfigError> {
        let Condition { parameter, value, bound, source } = condition;
        require(parameter, value, bound, source)
    }
}

/// Shows every condition to `F`, whether it holds or not.
pub(crate) struct Audit<F>(pub F);

impl<F: FnMut(&Condition)> Judge for Audit<F> {
    fn judge(&mut self, condition: Condition) -> Result<(), ConfigError> {
        (self.0)(&condition);
        Ok(())
    }
}

/// Returns the error unless `value` keeps `bound`.
pub(crate) fn require(
    parameter: &'static str,
    value: f32,
    bound: Bound,
    source: &'static str,
) -> Result<(), ConfigError> {
    if bound.holds(value) { Ok(()) } else { Err(ConfigError { parameter, value, bound, source }) }
}
