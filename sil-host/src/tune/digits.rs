//! Numbers as a person would write them into a file.

/// The double whose shortest decimals are those of `x`: without what widening adds.
pub(super) fn decimal(x: f32) -> f64 {
    x.to_string().parse().unwrap_or_else(|_| f64::from(x))
}

/// To four significant digits.
pub(super) fn rounded(x: f64) -> f64 {
    to_digits(x, f64::round)
}

/// To four significant digits, not above `x`.
pub(super) fn rounded_down(x: f64) -> f64 {
    to_digits(x, f64::floor)
}

/// To four significant digits, not below `x`.
pub(super) fn rounded_up(x: f64) -> f64 {
    to_digits(x, f64::ceil)
}

fn to_digits(x: f64, round: fn(f64) -> f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let digits = 3 - x.abs().log10().floor() as i32;
    // A quotient by a power of ten is the double nearest to the decimal number; a product is not.
    if digits > 0 {
        let unit = 10f64.powi(digits);
        round(x * unit) / unit
    } else {
        let unit = 10f64.powi(-digits);
        round(x / unit) * unit
    }
}
