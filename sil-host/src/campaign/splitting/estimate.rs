//! Estimate of a probability and its interval from the steps of all replicas.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};
use statrs::function::gamma::gamma_lr;

/// Probability of a violation by splitting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RareProbability {
    /// The guarantee, by the stem of its columns.
    pub guarantee: String,
    /// Estimate `(1 - 1/N)^J`.
    pub probability: f64,
    /// Ends of the interval.
    pub lower: f64,
    /// Upper end of the interval.
    pub upper: f64,
    /// Probability with which the interval holds.
    pub confidence: f64,
    /// Demanded bound of the probability, if there is one.
    pub demanded: Option<f64>,
    /// `true` if every particle violates the guarantee at the end; otherwise the estimate is that of a level
    /// before, and only the upper end holds.
    pub finished: bool,
    /// `J`, in all replicas.
    pub replaced: u64,
    /// Variance of the replicas' `J` over their mean: 1 if walks forget where they began.
    pub dispersion: f64,
    /// Share of proposals that were accepted.
    pub acceptance: f64,
    /// Flights, those of them that were refused included.
    pub flights: u64,
    /// Flights that independent draws would need for an interval of the same relative width.
    pub equivalent_draws: f64,
}

impl RareProbability {
    /// Sets probability and interval from the number of particles replaced in each replica of so many `particles`.
    pub fn estimated(mut self, replaced: &[u64], particles: u32) -> Self {
        let replicas = replaced.len() as f64;
        let all = replicas * f64::from(particles);
        let total: u64 = replaced.iter().sum();
        let (mean, variance) = moments(replaced);
        let tail = 0.5 * (1.0 - self.confidence);
        // Garwood's interval of a Poisson mean; and Student's of the replicas' mean, if they scatter more.
        let poisson = (poisson_lower(total, tail), poisson_upper(total, tail));
        let reach = student(1.0 - tail, replicas - 1.0) * (variance * replicas).sqrt();
        let count = total as f64;
        let (least, most) = (poisson.0.min((count - reach).max(0.0)), poisson.1.max(count + reach));
        self.replaced = total;
        self.probability = libm::exp(count * libm::log1p(-1.0 / all));
        self.lower = if self.finished { libm::exp(-most / all) } else { 0.0 };
        self.upper = libm::exp(-least / all);
        self.dispersion = if mean > 0.0 { variance / mean } else { 1.0 };
        let relative = (-libm::log(self.probability) / all).max(1e-300);
        self.equivalent_draws = (1.0 - self.probability) / (self.probability * relative);
        self
    }

    /// `true` if a demanded bound is shown; without a demand, if the estimate is finished.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.demanded.map_or(self.finished, |demanded| self.upper <= demanded)
    }

    /// In a sentence.
    #[must_use]
    pub fn sentence(&self) -> String {
        let Self { guarantee, probability, lower, upper, confidence, flights, .. } = self;
        format!(
            "probability of violating {guarantee}: {probability:.2e}, {lower:.1e} to {upper:.1e} with confidence \
             {confidence}, by {flights} flights (independent draws: {:.1e}); dispersion {:.2}, acceptance {:.2}",
            self.equivalent_draws, self.dispersion, self.acceptance
        )
    }
}

fn moments(values: &[u64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<u64>() as f64 / count;
    let squares: f64 = values.iter().map(|&value| (value as f64 - mean).powi(2)).sum();
    (mean, squares / (count - 1.0))
}

/// The least mean of a Poisson variable that gives `count` or more with a probability of `tail`.
fn poisson_lower(count: u64, tail: f64) -> f64 {
    if count == 0 { 0.0 } else { gamma_quantile(count as f64, tail) }
}

/// The largest mean that gives `count` or fewer with a probability of `tail`.
fn poisson_upper(count: u64, tail: f64) -> f64 {
    gamma_quantile(count as f64 + 1.0, 1.0 - tail)
}

/// Quantile of the gamma distribution of that shape, by bisection.
fn gamma_quantile(shape: f64, probability: f64) -> f64 {
    let (mut below, mut above) = (0.0, shape + 1.0);
    while gamma_lr(shape, above) < probability {
        above *= 2.0;
    }
    for _ in 0..200 {
        let middle = 0.5 * (below + above);
        *(if gamma_lr(shape, middle) < probability { &mut below } else { &mut above }) = middle;
    }
    0.5 * (below + above)
}

/// Quantile of Student's distribution.
fn student(probability: f64, freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom.max(1.0))
        .map_or(f64::INFINITY, |it| it.inverse_cdf(probability))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poisson_bounds_are_those_of_garwood() {
        // scipy.stats.chi2.ppf(tail, 2 k)/2 and chi2.ppf(1 - tail, 2 k + 2)/2.
        for (count, lower, upper) in [
            (0, 0.0, 3.688_879_454_113_936),
            (1, 0.025_317_807_984_289_897, 5.571_643_390_938_898),
            (10, 4.795_388_696_13, 18.390_356_042),
            (100, 81.363_991_250_9, 121.626_793_792),
        ] {
            assert!((poisson_lower(count, 0.025) - lower).abs() < 1e-6 * lower.max(1.0), "{count}");
            assert!((poisson_upper(count, 0.025) - upper).abs() < 1e-6 * upper, "{count}");
        }
        assert!((student(0.975, 15.0) - 2.131_449_545_559_323).abs() < 1e-6);
    }

    #[test]
    fn the_estimate_of_a_poisson_count_has_no_bias() {
        // E[(1 - 1/N)^J] = p for J Poisson with mean -N ln p.
        let (n, p) = (50.0f64, 1e-3f64);
        let mean = -n * p.ln();
        let (mut weight, mut sum) = ((-mean).exp(), 0.0);
        for count in 0..2_000 {
            sum += weight * (1.0 - 1.0 / n).powi(count);
            weight *= mean / f64::from(count + 1);
        }
        assert!((sum / p - 1.0).abs() < 1e-9, "{sum}");
    }
}
