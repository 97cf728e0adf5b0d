//! A permutation of `0..n` that can be asked for a single element: nothing is stored.
//!
//! A Feistel network permutes the numbers of an even count of bits that cover `n`; a result
//! outside `0..n` is permuted again until it is inside (cycle walking), which keeps the map one-to-one.
//! The cover is less than four times `n`, so this takes less than four steps in the mean.

use super::hash;

/// Enough that neither half of a number can be guessed from the other.
const ROUNDS: u64 = 6;

/// Image of `index`, below `n`, under the permutation that `key` chooses.
pub(super) fn permuted(index: u32, n: u32, key: u64) -> u32 {
    debug_assert!(index < n);
    let bits = (u32::BITS - n.saturating_sub(1).leading_zeros()).div_ceil(2).max(1);
    let mask = (1u64 << bits) - 1;
    let mut number = u64::from(index);
    loop {
        let (mut left, mut right) = (number >> bits, number & mask);
        for round in 0..ROUNDS {
            (left, right) = (right, left ^ (hash(key ^ hash(right << 8 | round)) & mask));
        }
        number = left << bits | right;
        if number < u64::from(n) {
            return number as u32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::permuted;

    #[test]
    fn every_number_is_met_once() {
        for n in [1, 2, 3, 4, 5, 16, 17, 1000, 4096, 4097] {
            for key in 0..5 {
                let mut met = vec![false; n as usize];
                for index in 0..n {
                    let place = permuted(index, n, key) as usize;
                    assert!(!core::mem::replace(&mut met[place], true), "{n} {key} {index}");
                }
            }
        }
    }

    #[test]
    fn keys_give_different_orders_without_correlation() {
        let n = 10_000;
        let centred = |key| (0..n).map(move |i| f64::from(permuted(i, n, key)) / 1e4 - 0.5);
        let correlation = |a, b| -> f64 {
            centred(a).zip(centred(b)).map(|(x, y)| 12.0 * x * y).sum::<f64>() / f64::from(n)
        };
        for key in 1..20 {
            // Three deviations of the mean of n products.
            assert!(correlation(key, key + 1).abs() < 0.03, "{key}");
            let order: f64 =
                centred(key).enumerate().map(|(i, x)| 12.0 * x * (i as f64 / 1e4 - 0.5)).sum();
            assert!((order / 1e4).abs() < 0.04, "{key}");
        }
    }
}
