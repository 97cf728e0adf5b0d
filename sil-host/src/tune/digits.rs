//! Four significant digits: what a person would write into a file.

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
