//! Numbers as text for tables and messages.

/// Five significant digits.
#[must_use]
pub fn number(x: f64) -> String {
    let magnitude = x.abs();
    if x == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e5).contains(&magnitude) {
        let decimals = 4 - (magnitude.log10().floor() as i32).clamp(-4, 4);
        let text = format!("{x:.*}", decimals as usize);
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        }
    } else {
        format!("{x:.3e}")
    }
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn numbers_keep_five_significant_digits() {
        for (x, text) in [
            (0.0, "0"),
            (12.0, "12"),
            (0.05, "0.05"),
            (-10.25999, "-10.26"),
            (0.0012345678, "0.0012346"),
            (99_999.4, "99999"),
            (0.000_123_4, "1.234e-4"),
            (f64::INFINITY, "inf"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(number(x), text);
        }
    }
}
