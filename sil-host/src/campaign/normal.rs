//! Quantiles of the normal distribution, cut off at either end.

use core::f64::consts::FRAC_1_SQRT_2;

/// Beyond it lies 1e-19 of the probability: less than any sampling resolves.
const END: f64 = 9.0;

/// Probability below `z`.
fn probability_below(z: f64) -> f64 {
    0.5 * libm::erfc(-z * FRAC_1_SQRT_2)
}

/// The `x`-quantile, `x` in `[0, 1)`, of a standard normal variable that is known to lie in
/// `[lower, upper]`, which may be infinite.
///
/// Bisection: 60 halvings of at most 18 leave less than rounding does, and libm's `erfc` gives the
/// same bits on every machine.
pub(super) fn truncated_quantile(x: f64, lower: f64, upper: f64) -> f64 {
    if lower > 0.0 {
        // The upper tail, seen from below, where probabilities are small and exact.
        return -truncated_quantile(1.0 - x, -upper, -lower);
    }
    let (mut below, mut above) = (lower.max(-END), upper.min(END));
    let (least, most) = (probability_below(below), probability_below(above));
    let target = least + x * (most - least);
    for _ in 0..60 {
        let middle = 0.5 * (below + above);
        if probability_below(middle) < target {
            below = middle;
        } else {
            above = middle;
        }
    }
    0.5 * (below + above)
}

#[cfg(test)]
mod tests {
    use super::truncated_quantile;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (x, z) in [
            (0.5, 0.0),
            (0.841_344_746_068_542_9, 1.0),
            (0.975, 1.959_963_984_540_054),
            (0.999, 3.090_232_306_167_813_5),
            (1e-6, -4.753_424_308_822_899),
        ] {
            let found = truncated_quantile(x, f64::NEG_INFINITY, f64::INFINITY);
            assert!((found - z).abs() < 1e-12, "{x}: {found} instead of {z}");
        }
    }

    #[test]
    fn cut_off_quantiles_stay_inside_and_keep_their_share() {
        // Half of what lies in [0, 1] lies below the quantile of (0.5 + 0.841...)/2.
        assert!((truncated_quantile(0.5, 0.0, 1.0) - 0.441_7).abs() < 1e-4);
        for (lower, upper) in [(-1.0, 2.0), (3.0, 4.0), (-5.0, -4.0), (5.5, f64::INFINITY)] {
            let quantiles =
                [0.0, 0.1, 0.5, 0.9, 0.999].map(|x| truncated_quantile(x, lower, upper));
            assert!(quantiles.is_sorted(), "{quantiles:?}");
            assert!(quantiles.iter().all(|z| (lower..=upper).contains(z)), "{quantiles:?}");
        }
    }
}
