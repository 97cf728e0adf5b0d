//! Distributions of varied values, as quantile functions of a number in `[0, 1)`.

use serde::{Deserialize, Serialize};

use super::normal::truncated_quantile;

/// One thing that changes from run to run: where it goes, and one distribution.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Vary {
    /// Field of the scenario, as in `vehicle.mass` or `vehicle.inertia[0]`. Variants whose scenario
    /// does not have it keep what they have.
    pub path: String,
    /// More fields that get the same value, likewise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub also: Vec<String>,
    /// Unit for the report.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Equally likely between two ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uniform: Option<Range>,
    /// Its logarithm is equally likely between two ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub log_uniform: Option<Range>,
    /// Normal, cut off where ends are given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normal: Option<Normal>,
    /// Rises linearly to a mode and falls linearly from it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub triangular: Option<Triangular>,
    /// Any of these, equally likely; in a grid, its levels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub values: Option<Vec<f64>>,
    /// Equally spaced levels, both ends among them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub linspace: Option<Levels>,
    /// Levels at equal ratios, both ends among them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub logspace: Option<Levels>,
    /// The three principal moments of a rigid body, none larger than the sum of the other two.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rigid_body: Option<Range>,
}

/// Two ends.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Least value.
    pub lower: f64,
    /// Largest value.
    pub upper: f64,
}

/// A normal distribution, cut off where ends are given.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Normal {
    /// Mean before cutting.
    pub mean: f64,
    /// Standard deviation before cutting.
    pub deviation: f64,
    /// Least value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lower: Option<f64>,
    /// Largest value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub upper: Option<f64>,
}

/// A triangular distribution.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Triangular {
    /// Least value.
    pub lower: f64,
    /// Most likely value.
    pub mode: f64,
    /// Largest value.
    pub upper: f64,
}

/// Levels from one end to the other.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Levels {
    /// First level.
    pub lower: f64,
    /// Last level.
    pub upper: f64,
    /// Number of levels, at least two.
    pub levels: u32,
}

/// A checked distribution.
#[derive(Clone, Debug, PartialEq)]
pub enum Distribution {
    /// See [`Vary::uniform`].
    Uniform(Range),
    /// See [`Vary::log_uniform`].
    LogUniform(Range),
    /// See [`Vary::normal`]; ends may be infinite.
    Normal {
        /// Mean before cutting.
        mean: f64,
        /// Standard deviation before cutting.
        deviation: f64,
        /// Interval outside of which it is cut.
        range: Range,
    },
    /// See [`Vary::triangular`].
    Triangular(Triangular),
    /// See [`Vary::values`], [`Vary::linspace`], [`Vary::logspace`].
    Levels(Vec<f64>),
    /// See [`Vary::rigid_body`].
    RigidBody(Range),
}

impl Vary {
    /// The one distribution that it has.
    ///
    /// # Errors
    /// The key at fault, empty if it is none in particular, and what is wrong.
    pub fn distribution(&self) -> Result<Distribution, (&'static str, String)> {
        let range = |key, range: &Range, positive| ordered(*range, positive).map_err(|e| (key, e));
        let uniform = self.uniform.map(|r| Ok(Distribution::Uniform(range("uniform", &r, false)?)));
        let logarithmic =
            self.log_uniform.map(|r| Ok(Distribution::LogUniform(range("log_uniform", &r, true)?)));
        let body =
            self.rigid_body.map(|r| Ok(Distribution::RigidBody(range("rigid_body", &r, true)?)));
        let normal = self.normal.map(|normal| normal.checked().map_err(|e| ("normal", e)));
        let triangular =
            self.triangular.map(|triangular| triangular.checked().map_err(|e| ("triangular", e)));
        let values = self.values.clone().map(|list| listed(list).map_err(|e| ("values", e)));
        let linear = self.linspace.map(|it| it.linear().map_err(|e| ("linspace", e)));
        let ratios = self.logspace.map(|it| it.logarithmic().map_err(|e| ("logspace", e)));
        let all = [uniform, logarithmic, normal, triangular, values, linear, ratios, body];
        let mut given = all.into_iter().flatten();
        match (given.next(), given.next()) {
            (Some(one), None) => one,
            (None, _) => Err(("", "has no distribution".to_owned())),
            (Some(_), Some(_)) => Err(("", "has more than one distribution".to_owned())),
        }
    }
}

/// The range, if its ends are finite and in order, and positive if they must be.
fn ordered(range: Range, positive: bool) -> Result<Range, String> {
    let Range { lower, upper } = range;
    if !(lower.is_finite() && upper.is_finite() && lower < upper) {
        return Err(format!("lower = {lower} must be below upper = {upper}, both finite"));
    }
    if positive && lower <= 0.0 {
        return Err(format!("lower = {lower} must be positive"));
    }
    Ok(range)
}

fn listed(values: Vec<f64>) -> Result<Distribution, String> {
    if values.is_empty() {
        return Err("must have an element".to_owned());
    }
    match values.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(format!("{value} must be finite")),
        None => Ok(Distribution::Levels(values)),
    }
}

impl Normal {
    fn checked(self) -> Result<Distribution, String> {
        let Self { mean, deviation, .. } = self;
        if !(mean.is_finite() && deviation.is_finite() && deviation > 0.0) {
            return Err(format!("mean = {mean} must be finite, deviation = {deviation} positive"));
        }
        let lower = self.lower.unwrap_or(f64::NEG_INFINITY);
        let upper = self.upper.unwrap_or(f64::INFINITY);
        let reach = REACH * deviation;
        if !(lower < upper && lower < mean + reach && upper > mean - reach) {
            return Err(format!(
                "lower = {lower} must be below upper = {upper}, with some of the mean plus or \
                 minus {REACH} deviations between"
            ));
        }
        Ok(Distribution::Normal { mean, deviation, range: Range { lower, upper } })
    }
}

impl Triangular {
    fn checked(self) -> Result<Distribution, String> {
        let Self { lower, mode, upper } = self;
        ordered(Range { lower, upper }, false)?;
        if !(lower <= mode && mode <= upper) {
            return Err(format!("mode = {mode} must be in [{lower}, {upper}]"));
        }
        Ok(Distribution::Triangular(self))
    }
}

impl Levels {
    fn checked(self, positive: bool) -> Result<impl Iterator<Item = f64>, String> {
        ordered(Range { lower: self.lower, upper: self.upper }, positive)?;
        if !(2..=MOST_LEVELS).contains(&self.levels) {
            return Err(format!("levels = {} must be in [2, {MOST_LEVELS}]", self.levels));
        }
        let last = f64::from(self.levels - 1);
        Ok((0..self.levels).map(move |level| f64::from(level) / last))
    }

    fn linear(self) -> Result<Distribution, String> {
        let share = self.checked(false)?;
        let levels = share.map(|x| self.lower + x * (self.upper - self.lower)).collect();
        Ok(Distribution::Levels(ending(levels, self.upper)))
    }

    fn logarithmic(self) -> Result<Distribution, String> {
        let range = Range { lower: self.lower, upper: self.upper };
        let levels = self.checked(true)?.map(|x| geometric(range, x)).collect();
        Ok(Distribution::Levels(ending(levels, self.upper)))
    }
}

/// A normal distribution cut to what lies farther out than this would be a slip of the pen.
const REACH: f64 = 6.0;

/// More would be a slip of the pen.
const MOST_LEVELS: u32 = 100_000;

/// The levels with the last one exact.
fn ending(mut levels: Vec<f64>, upper: f64) -> Vec<f64> {
    if let Some(last) = levels.last_mut() {
        *last = upper;
    }
    levels
}

/// `lower^(1 - x) upper^x`; libm gives the same bits on every machine.
fn geometric(Range { lower, upper }: Range, x: f64) -> f64 {
    let logarithm = libm::log(lower) + x * (libm::log(upper) - libm::log(lower));
    libm::exp(logarithm).clamp(lower, upper)
}

impl Distribution {
    /// Number of coordinates in `[0, 1)` that it takes, and of values that it gives.
    #[must_use]
    pub fn dimensions(&self) -> usize {
        if matches!(self, Self::RigidBody(_)) { 3 } else { 1 }
    }

    /// The levels, where it has some.
    #[must_use]
    pub fn levels(&self) -> Option<&[f64]> {
        match self {
            Self::Levels(levels) => Some(levels),
            _ => None,
        }
    }

    /// The values at the point `unit`, whose [`dimensions`](Self::dimensions) components are in
    /// `[0, 1)`: quantiles, so that strata of `unit` are strata of probability.
    pub fn sample(&self, unit: &[f64], values: &mut Vec<f64>) {
        match (self, unit) {
            (Self::RigidBody(range), &[x, y, z]) => values.extend(rigid_body(*range, [x, y, z])),
            (_, &[x]) => values.push(self.quantile(x)),
            _ => unreachable!("as many numbers as `dimensions`"),
        }
    }

    fn quantile(&self, x: f64) -> f64 {
        match self {
            Self::Uniform(range) | Self::RigidBody(range) => linear(*range, x),
            Self::LogUniform(range) => geometric(*range, x),
            Self::Normal { mean, deviation, range } => {
                let standard = |end: f64| (end - mean) / deviation;
                let z = truncated_quantile(x, standard(range.lower), standard(range.upper));
                (mean + deviation * z).clamp(range.lower, range.upper)
            }
            Self::Triangular(triangle) => triangle.quantile(x),
            Self::Levels(levels) => {
                levels[((x * levels.len() as f64) as usize).min(levels.len() - 1)]
            }
        }
    }
}

fn linear(Range { lower, upper }: Range, x: f64) -> f64 {
    (lower + x * (upper - lower)).clamp(lower, upper)
}

impl Triangular {
    fn quantile(&self, x: f64) -> f64 {
        let Self { lower, mode, upper } = *self;
        let width = upper - lower;
        let value = if x * width < mode - lower {
            lower + (x * width * (mode - lower)).sqrt()
        } else {
            upper - ((1.0 - x) * width * (upper - mode)).sqrt()
        };
        value.clamp(lower, upper)
    }
}

/// Two moments uniform in the range, the third uniform in what a rigid body and the range leave of
/// it: no moment is larger than the sum of the other two. Which one is third takes turns with `x`,
/// so that no axis is special.
fn rigid_body(range: Range, [x, y, z]: [f64; 3]) -> [f64; 3] {
    let turn = 3.0 * x;
    let axis = (turn as usize).min(2);
    let (a, b) = (linear(range, turn - axis as f64), linear(range, y));
    let third = Range { lower: (a - b).abs().max(range.lower), upper: (a + b).min(range.upper) };
    let mut moments = [0.0; 3];
    moments[axis] = linear(third, z);
    moments[(axis + 1) % 3] = a;
    moments[(axis + 2) % 3] = b;
    moments
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distribution(toml: &str) -> Distribution {
        let vary: Vary = toml_edit::de::from_str(&format!("path = 'a'\n{toml}")).unwrap();
        vary.distribution().unwrap()
    }

    fn quantiles(toml: &str, at: &[f64]) -> Vec<f64> {
        let distribution = distribution(toml);
        let mut values = Vec::new();
        at.iter().for_each(|&x| distribution.sample(&[x], &mut values));
        values
    }

    /// Mean and standard deviation.
    fn moments(toml: &str) -> (f64, f64) {
        let n = 20_000;
        let at: Vec<_> = (0..n).map(|i| (f64::from(i) + 0.5) / f64::from(n)).collect();
        let values = quantiles(toml, &at);
        assert!(values.is_sorted(), "quantiles rise");
        let mean = values.iter().sum::<f64>() / f64::from(n);
        let square = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / f64::from(n);
        (mean, square.sqrt())
    }

    fn assert_near(found: (f64, f64), expected: (f64, f64)) {
        let near = |x: f64, y: f64| (x - y).abs() < 2e-3 * y.abs();
        assert!(near(found.0, expected.0) && near(found.1, expected.1), "{found:?} {expected:?}");
    }

    #[test]
    fn moments_are_those_of_the_textbook() {
        assert_near(moments("uniform = {lower = 1, upper = 4}"), (2.5, 3.0 / 12f64.sqrt()));
        // Variance: (a^2 + b^2 + c^2 - ab - bc - ca)/18.
        let triangle = moments("triangular = {lower = 1, mode = 2, upper = 4}");
        assert_near(triangle, (7.0 / 3.0, (7.0f64 / 18.0).sqrt()));
        assert_near(moments("normal = {mean = 3, deviation = 0.5}"), (3.0, 0.5));
        // Of a half normal distribution.
        let half = moments("normal = {mean = 1, deviation = 1, lower = 1}");
        assert_near(half, (1.0 + (2.0 / core::f64::consts::PI).sqrt(), 0.602_81));
        let mean: f64 = 99.0 / 100f64.ln();
        let deviation = (9_999.0 / (2.0 * 100f64.ln()) - mean * mean).sqrt();
        assert_near(moments("log_uniform = {lower = 1, upper = 100}"), (mean, deviation));
    }

    #[test]
    fn quantiles_start_and_end_at_the_ends() {
        // A root takes half of the digits with it at the end of a triangle.
        let last = 1.0f64.next_down();
        for (toml, lower, middle, upper) in [
            ("uniform = {lower = -1, upper = 3}", -1.0, 1.0, 3.0),
            ("log_uniform = {lower = 0.01, upper = 100}", 0.01, 1.0, 100.0),
            ("triangular = {lower = 0, mode = 0, upper = 1}", 0.0, 1.0 - 0.5f64.sqrt(), 1.0),
            ("normal = {mean = 5, deviation = 9, lower = 0, upper = 10}", 0.0, 5.0, 10.0),
            ("values = [3, 1, 2]", 3.0, 1.0, 2.0),
            ("linspace = {lower = 0, upper = 1, levels = 11}", 0.0, 0.5, 1.0),
            ("logspace = {lower = 0.1, upper = 10, levels = 3}", 0.1, 1.0, 10.0),
        ] {
            for (found, expected) in
                quantiles(toml, &[0.0, 0.5, last]).iter().zip([lower, middle, upper])
            {
                assert!((found - expected).abs() < 1e-7, "{toml}: {found} {expected}");
            }
        }
    }

    #[test]
    fn moments_of_inertia_are_those_of_a_rigid_body() {
        let body = distribution("rigid_body = {lower = 0.03, upper = 0.12}");
        let shares = || (0..24).map(|i| f64::from(i) / 23.999);
        let (mut least, mut largest): ([f64; 3], [f64; 3]) = ([1.0; 3], [0.0; 3]);
        for point in
            shares().flat_map(|x| shares().flat_map(move |y| shares().map(move |z| [x, y, z])))
        {
            let mut moments = Vec::new();
            body.sample(&point, &mut moments);
            for axis in 0..3 {
                let [a, b, c] = [0, 1, 2].map(|i| moments[(axis + i) % 3]);
                assert!((0.03..=0.12).contains(&a) && a <= b + c + 1e-15, "{moments:?}");
                least[axis] = least[axis].min(a);
                largest[axis] = largest[axis].max(a);
            }
        }
        // Every axis takes its whole interval.
        assert!(least.iter().all(|&x| x < 0.031) && largest.iter().all(|&x| x > 0.115));
    }
}
