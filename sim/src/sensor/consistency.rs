//! Consistency of an estimator: are its errors as large as its covariance says?
//!
//! The normalised estimation error squared (NEES) `e^T P^-1 e` is chi-square distributed with as many degrees
//! of freedom as there are states, and the normalised innovation squared (NIS) with as many as there are
//! measured numbers, if the filter is consistent. Their means over independent flights lie within narrow
//! bounds around one per degree of freedom.

use super::ErrorState;

const STATES: usize = 15;

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
