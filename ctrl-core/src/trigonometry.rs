//! Sine and cosine without double precision.
//!
//! libm's compute in f64, which a microcontroller with a single-precision unit emulates: 1,250 instructions
//! for the pair, where a control step takes 1,400, and its reduction of large angles loops as long as the
//! angle wants. Nothing here needs more than a few turns, which f32 reduces exactly enough.
//!
//! The polynomials are those of Cephes (S. Moshier, `sinf.c`), minimax on [-pi/4, pi/4].

use core::f32::consts::FRAC_2_PI;

/// `pi/2` in three parts; the first two have so few bits that their product with a small integer is exact.
const QUARTER: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];

/// Sine and cosine of an angle of at most an eighth of a turn (rad), each accurate to 7e-8.
#[inline]
pub fn sin_cos_small(angle: f32) -> (f32, f32) {
    let z = angle * angle;
    let sine = (-1.951_529_6e-4 * z + 8.332_161e-3) * z - 1.666_665_5e-1;
    let cosine = (2.443_315_7e-5 * z - 1.388_731_6e-3) * z + 4.166_664_6e-2;
    (sine * z * angle + angle, cosine * z * z - 0.5 * z + 1.0)
}

/// Sine and cosine of an angle of at most 100 rad, together accurate to 1.2e-7 and the rounding of the angle.
///
/// Total: a larger angle gives less accurate numbers, and one that is not finite gives NaN.
pub fn sin_cos(angle: f32) -> (f32, f32) {
    let turned = angle * FRAC_2_PI;
    // Rounds half away from zero, and saturates.
    let quarters = if turned < 0.0 { turned - 0.5 } else { turned + 0.5 } as i32;
    let [high, middle, low] = QUARTER.map(|part| quarters as f32 * part);
    rotated(quarters as u32, sin_cos_small(angle - high - middle - low))
}

/// Sine and cosine after so many quarter turns.
#[inline]
pub(crate) fn rotated(quarters: u32, (sin, cos): (f32, f32)) -> (f32, f32) {
    match quarters % 4 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_are_accurate_over_many_turns() {
        let (mut small, mut large) = (0.0_f64, 0.0_f64);
        for i in -400_000..=400_000 {
            let angle = i as f32 * 1.000_1e-4;
            let (sin, cos) = sin_cos(angle);
            let (exact_sin, exact_cos) = f64::from(angle).sin_cos();
            let error = (f64::from(sin) - exact_sin).hypot(f64::from(cos) - exact_cos);
            large = large.max(error);
            if angle.abs() <= core::f32::consts::FRAC_PI_4 {
                assert_eq!((sin, cos), sin_cos_small(angle));
                small = small.max(error);
            }
        }
        assert!(small < 8e-8 && large < 1.2e-7, "{small:e} {large:e}");
    }

    #[test]
    fn no_angle_panics_and_none_is_nan() {
        for angle in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let (sin, cos) = sin_cos(angle);
            assert!(sin.is_nan() && cos.is_nan());
        }
        for angle in [1e5, -1e5] {
            let (sin, cos) = sin_cos(angle);
            assert!((sin * sin + cos * cos - 1.0).abs() < 1e-6, "{angle}");
        }
        sin_cos(f32::MAX);
    }
}
