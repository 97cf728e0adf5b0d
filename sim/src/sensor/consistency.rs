//! Consistency of an estimator: are its errors as large as its covariance says?
//!
//! The normalised estimation error squared (NEES) `e^T P^-1 e` is chi-square distributed with as many degrees
//! of freedom as there are states, and the normalised innovation squared (NIS) with as many as there are
//! measured numbers, if the filter is consistent. Their means over independent flights lie within narrow
//! bounds around one per degree of freedom.

use ctrl_core::estimator::covariance::STATES;
use ctrl_core::estimator::{SOURCES, Source};

use super::{ErrorState, Innovations};
use crate::scenario::{LoadedScenario, ScenarioError};

/// Two-sided 95 % quantile of the normal distribution.
const QUANTILE: f64 = 1.959_964;

/// `e^T P^-1 e`, by Cholesky's factors; none if `P` is not positive.
#[must_use]
pub fn normalised_error(error: &ErrorState, covariance: &[[f32; STATES]; STATES]) -> Option<f64> {
    // Scaled to correlations first, since the variances span many orders of magnitude.
    let scale: [f64; STATES] = std::array::from_fn(|i| f64::from(covariance[i][i]).sqrt());
    let mut lower = [[0.0; STATES]; STATES];
    let mut solved = [0.0; STATES];
    for i in 0..STATES {
        for j in 0..=i {
            let mut sum = f64::from(covariance[i][j]) / (scale[i] * scale[j]);
            sum -= (0..j).map(|k| lower[i][k] * lower[j][k]).sum::<f64>();
            lower[i][j] = if i == j { sum.sqrt() } else { sum / lower[j][j] };
        }
        let known: f64 = (0..i).map(|k| lower[i][k] * solved[k]).sum();
        solved[i] = (error[i] / scale[i] - known) / lower[i][i];
    }
    let square: f64 = solved.iter().map(|x| x * x).sum();
    square.is_finite().then_some(square)
}

/// Interval that holds the sum of squares per degree of freedom with a probability of 95 %, for `degrees`
/// degrees of freedom in all (many).
#[must_use]
pub fn bounds(degrees: f64) -> (f64, f64) {
    let half = QUANTILE * (2.0 / degrees).sqrt();
    (1.0 - half, 1.0 + half)
}

/// Mean per degree of freedom, and the interval that it should lie in with a probability of 95 %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// Mean of the normalised squares.
    pub value: f64,
    /// Lower and upper end of the interval.
    pub bounds: (f64, f64),
}

impl Mean {
    fn new(sum: f64, degrees: f64) -> Self {
        Self { value: sum / degrees, bounds: bounds(degrees) }
    }

    /// `true` if the mean lies within its interval.
    #[must_use]
    pub fn holds(&self) -> bool {
        (self.bounds.0..=self.bounds.1).contains(&self.value)
    }

    /// Distance from one, in standard deviations of the mean of a consistent filter.
    #[must_use]
    pub fn deviations(&self) -> f64 {
        2.0 * QUANTILE * (self.value - 1.0) / (self.bounds.1 - self.bounds.0)
    }
}

/// Sums over flights.
#[derive(Clone, Copy, Debug, Default)]
pub struct Consistency {
    /// Flights.
    pub flights: u64,
    normalised_error: f64,
    /// States over all flights.
    states: f64,
    /// Squares of each state's error in units of its variance.
    each: [f64; STATES],
    innovations: [Innovations; SOURCES.len()],
}

impl Consistency {
    /// Flies `scenario` with `seed` for `seconds`: the error is sampled at the end, innovations all the way.
    ///
    /// # Errors
    /// The parameter that is refused; a flight without sensors; a covariance that is not positive.
    pub fn of_flight(
        scenario: &LoadedScenario,
        seed: u64,
        seconds: f64,
    ) -> Result<Self, ConsistencyError> {
        let mut flight = scenario.flight_with_seed(seed)?;
        let period = f64::from(scenario.scenario().controller.step_period());
        flight.advance((seconds / period).round() as u64);
        // After `advance` the estimate is that of the last tick and the truth that of the next: one more step of
        // the sensors brings them together.
        let mut navigation = flight.navigation().ok_or(ConsistencyError::NoSensors)?.clone();
        navigation.measure(flight.truth());
        let covariance = navigation.state().covariance_matrix();
        let errors = navigation.errors(flight.truth());
        let normalised_error =
            normalised_error(&errors, &covariance).ok_or(ConsistencyError::NotPositive(seed))?;
        let each = std::array::from_fn(|k| errors[k] * errors[k] / f64::from(covariance[k][k]));
        let innovations = SOURCES.map(|source| navigation.innovations_of(source));
        // A barometer without drift has no bias state: its error is zero.
        let biased = navigation.estimator().config().barometer_bias.deviation > 0.0;
        let states = if biased { STATES } else { STATES - 1 } as f64;
        Ok(Self { flights: 1, normalised_error, states, each, innovations })
    }

    /// Adds the sums of other flights.
    #[must_use]
    pub fn plus(mut self, other: &Self) -> Self {
        self.flights += other.flights;
        self.normalised_error += other.normalised_error;
        self.states += other.states;
        self.each.iter_mut().zip(&other.each).for_each(|(sum, x)| *sum += x);
        for (sum, x) in self.innovations.iter_mut().zip(&other.innovations) {
            *sum = sum.plus(x);
        }
        self
    }

    /// NEES per state.
    #[must_use]
    pub fn nees(&self) -> Mean {
        Mean::new(self.normalised_error, self.states)
    }

    /// NIS per measured number.
    #[must_use]
    pub fn nis(&self) -> Mean {
        let all = self.innovations();
        Mean::new(all.sum, all.components as f64)
    }

    /// NIS of one source; none if it gave nothing.
    #[must_use]
    pub fn nis_of(&self, source: Source) -> Option<Mean> {
        let Innovations { sum, components, .. } = self.innovations[source as usize];
        (components > 0).then(|| Mean::new(sum, components as f64))
    }

    /// Squares of each state's error in units of its variance, mean over the flights.
    #[must_use]
    pub fn each_state(&self) -> [f64; STATES] {
        self.each.map(|sum| sum / self.flights as f64)
    }

    /// Innovations of all sources.
    #[must_use]
    pub fn innovations(&self) -> Innovations {
        self.innovations.iter().fold(Innovations::default(), |sum, x| sum.plus(x))
    }

    /// `true` if NEES and NIS lie within their intervals.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.nees().holds() && self.nis().holds()
    }
}

/// Cause of a flight without result.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum ConsistencyError {
    /// The scenario.
    Scenario(ScenarioError),
    /// The scenario has no `[sensors]`.
    NoSensors,
    /// The covariance at the end of the flight with this seed is not positive.
    NotPositive(u64),
}

impl From<ScenarioError> for ConsistencyError {
    fn from(error: ScenarioError) -> Self {
        Self::Scenario(error)
    }
}

impl std::fmt::Display for ConsistencyError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Scenario(error) => error.fmt(f),
            Self::NoSensors => f.write_str("the scenario has no [sensors]: nothing is estimated"),
            Self::NotPositive(seed) => {
                write!(f, "seed {seed}: the covariance at the end of the flight is not positive")
            }
        }
    }
}

impl std::error::Error for ConsistencyError {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::random::Normal;

    #[test]
    fn the_normalised_error_of_normal_errors_has_its_distribution() {
        let mut normal = Normal::new(1, 1);
        // P = L L^T of a fixed lower triangle; errors are L times independent numbers.
        let factor: [[f64; STATES]; STATES] = std::array::from_fn(|i| {
            std::array::from_fn(|j| if j > i { 0.0 } else { 1.0 / (1.0 + (i + 2 * j) as f64) })
        });
        let covariance = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                (0..STATES).map(|k| factor[i][k] * factor[j][k]).sum::<f64>() as f32
            })
        });
        let (mut sum, runs) = (0.0, 4_000);
        for _ in 0..runs {
            let x: [f64; STATES] = std::array::from_fn(|_| normal.number());
            let error = std::array::from_fn(|i| (0..STATES).map(|k| factor[i][k] * x[k]).sum());
            let square = normalised_error(&error, &covariance).unwrap();
            sum += square;
        }
        let degrees = f64::from(runs) * STATES as f64;
        let (lower, upper) = bounds(degrees);
        assert!((lower..upper).contains(&(sum / degrees)), "{} {lower} {upper}", sum / degrees);
    }

    #[test]
    fn an_indefinite_covariance_has_no_normalised_error() {
        let mut covariance = [[0.0; STATES]; STATES];
        (0..STATES).for_each(|k| covariance[k][k] = 1.0);
        covariance[1][0] = 2.0;
        covariance[0][1] = 2.0;
        assert_eq!(normalised_error(&[1.0; STATES], &covariance), None);
    }
}
