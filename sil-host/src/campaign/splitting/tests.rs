//! Splitting on scores whose probability is known in closed form.

use super::Splitting;
use super::estimate::RareProbability;
use super::replica::Replica;

fn splitting(particles: u32, replicas: u32, steps: u32) -> Splitting {
    Splitting {
        guarantee: "x".to_owned(),
        failure_probability: None,
        confidence: 0.95,
        particles,
        replicas,
        steps,
    }
}

/// Estimate of the probability that `score` of `dimensions` normal variables is positive.
fn estimate(
    splitting: &Splitting,
    seed: u32,
    dimensions: usize,
    score: impl Fn(&[f64]) -> f64,
) -> RareProbability {
    let (mut replaced, mut flights) = (Vec::new(), 0);
    for number in 0..splitting.replicas {
        let mut replica = Replica::new(splitting, seed, number, dimensions);
        while let Some(place) = replica.ask() {
            let score = score(&place.z);
            replica.tell(place, Some(score));
            flights += 1;
        }
        replaced.push(replica.replaced);
    }
    let unset = RareProbability {
        guarantee: String::new(),
        probability: 0.0,
        lower: 0.0,
        upper: 1.0,
        confidence: splitting.confidence,
        demanded: None,
        finished: true,
        replaced: 0,
        dispersion: 0.0,
        acceptance: 0.0,
        flights,
        equivalent_draws: 0.0,
    };
    unset.estimated(&replaced, splitting.particles)
}

/// Probability above `z` of a standard normal variable.
fn above(z: f64) -> f64 {
    0.5 * libm::erfc(z * core::f64::consts::FRAC_1_SQRT_2)
}

/// Mean of the estimates over the truth, and the share of intervals that hold it.
fn repeated(truth: f64, dimensions: usize, score: impl Fn(&[f64]) -> f64) -> (f64, f64) {
    let (count, splitting) = (25, splitting(20, 10, 10));
    let (mut sum, mut held) = (0.0, 0);
    for seed in 0..count {
        let rare = estimate(&splitting, seed, dimensions, &score);
        sum += rare.probability / truth;
        held += u32::from((rare.lower..=rare.upper).contains(&truth));
    }
    (sum / f64::from(count), f64::from(held) / f64::from(count))
}

#[test]
fn a_half_space_has_the_probability_of_the_normal_tail() {
    // p = 1 - Phi(4.75) = 1.0e-6, whatever the number of dimensions.
    for dimensions in [1, 4] {
        let length = (dimensions as f64).sqrt();
        let (mean, held) =
            repeated(above(4.75), dimensions, |z| z.iter().sum::<f64>() / length - 4.75);
        assert!((mean - 1.0).abs() < 0.25, "{dimensions}: {mean}");
        assert!(held >= 0.85, "{dimensions}: {held}");
    }
}

#[test]
fn two_places_of_failure_are_both_found() {
    // |z_1| > 4.9: 9.6e-7.
    let (mean, held) = repeated(2.0 * above(4.9), 2, |z| z[0].abs() - 4.9);
    assert!((mean - 1.0).abs() < 0.25, "{mean}");
    assert!(held >= 0.85, "{held}");
}

#[test]
fn scores_in_steps_are_counted_too() {
    // Only whole numbers are seen: the level 5 is reached beyond z = 4.5.
    let (mean, held) = repeated(above(4.5), 1, |z| z[0].round() - 4.0);
    assert!((mean - 1.0).abs() < 0.25, "{mean}");
    assert!(held >= 0.85, "{held}");
}

#[test]
fn walks_that_are_too_short_show_in_the_dispersion() {
    let score = |z: &[f64]| z.iter().sum::<f64>() / 20f64.sqrt() - 4.0;
    let good = estimate(&splitting(10, 60, 20), 1, 20, score);
    let bad = estimate(&splitting(10, 60, 1), 1, 20, score);
    assert!(
        good.dispersion < 2.0 && bad.dispersion > 3.0,
        "{} {}",
        good.dispersion,
        bad.dispersion
    );
    assert!(bad.upper / bad.lower > good.upper / good.lower);
}
