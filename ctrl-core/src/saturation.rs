//! Saturations and the smooth sign, each with what the chain rule needs.
//!
//! ```text
//! sigma(x) = M tanh(x)               sigma' = M (1 - tanh^2 x)    sigma'' = -2 tanh(x) sigma'
//! h(x, delta) = x/sqrt(x^2+delta^2)  h' = delta^2/(x^2+delta^2)^(3/2)  h'' = -3 x h'/(x^2+delta^2)
//! clip(x, M) = max(-M, min(M, x))          M: a limit per element
//! ```
//! All act element-wise on vectors. `delta` counts as constant when `h` is differentiated.

use core::hint::cold_path;

use glam::Vec3;

use crate::sqrt::sqrt;

/// A function `s` at one point, for the chain rule along a motion `x(t)`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Response {
    /// `s(x)`.
    pub value: Vec3,
    /// `s'(x)`.
    pub slope: Vec3,
    /// `s''(x)/s'(x)`.
    pub bend: Vec3,
}

impl Response {
    /// First time derivative of `s(x(t))`, given `x'`.
    #[inline(always)]
    #[must_use]
    pub fn first(&self, x_dot: Vec3) -> Vec3 {
        self.slope * x_dot
    }

    /// Second time derivative of `s(x(t))`, given `x'` and `x''`.
    #[inline(always)]
    #[must_use]
    pub fn second(&self, x_dot: Vec3, x_ddot: Vec3) -> Vec3 {
        self.slope * (x_ddot + self.bend * x_dot * x_dot)
    }
}

/// `sigma(x) = limit tanh(x)`, element-wise; `|sigma| <= limit`, odd, increasing.
#[inline(always)]
#[must_use]
pub fn sigma(x: Vec3, limit: f32) -> Response {
    let tanh = tanh_each(x);
    let slope = limit * (1.0 - tanh * tanh);
    Response { value: limit * tanh, slope, bend: -2.0 * tanh }
}

/// `h(x, delta) = x/sqrt(x^2 + delta^2)` (17), element-wise; takes `delta^2 > 0`.
#[inline(always)]
#[must_use]
pub fn smooth_sign(x: Vec3, delta_squared: f32) -> Response {
    let square = x * x + delta_squared;
    let inverse = Vec3::new(1.0 / sqrt(square.x), 1.0 / sqrt(square.y), 1.0 / sqrt(square.z));
    let value = x * inverse;
    let slope = delta_squared * inverse * inverse * inverse;
    Response { value, slope, bend: -3.0 * value * inverse }
}

/// The value of [`smooth_sign`] alone.
#[inline(always)]
#[must_use]
pub fn smooth_sign_value(x: Vec3, delta_squared: f32) -> Vec3 {
    let square = x * x + delta_squared;
    x / Vec3::new(sqrt(square.x), sqrt(square.y), sqrt(square.z))
}

/// `sigma_3`, the hard clip of each element to its `[-limit, limit]` (37); NaN stays NaN.
#[inline(always)]
#[must_use]
pub fn clip(x: Vec3, limit: Vec3) -> Vec3 {
    let clip = |x: f32, limit: f32| if x.abs() > limit { limit.copysign(x) } else { x };
    Vec3::new(clip(x.x, limit.x), clip(x.y, limit.y), clip(x.z, limit.z))
}

/// [`clip`], and `true` if it changed an element; NaN is none.
#[inline(always)]
#[must_use]
pub fn clip_seen(x: Vec3, limit: Vec3) -> (Vec3, bool) {
    let size = x.abs();
    if size.x > limit.x || size.y > limit.y || size.z > limit.z {
        (clip(x, limit), true)
    } else {
        (x, false)
    }
}

/// `x` clipped to `[lower, upper]`; NaN stays NaN. Unlike `f32::clamp` it has no panic for
/// unordered ends, which the constructors exclude.
#[inline(always)]
#[must_use]
pub fn clip_between(x: f32, lower: f32, upper: f32) -> f32 {
    if x < lower {
        lower
    } else if x > upper {
        upper
    } else {
        x
    }
}

/// Hyperbolic tangent, within 5e-7 of the exact value everywhere and never beyond +-1.
///
/// A rational function `x P(x^2)/Q(x^2)` with the least relative error (1.7e-7 before rounding)
/// on `|x| <= 7.8`; beyond, +-1, which is off by less than 3.4e-7. Coefficients: iteratively
/// reweighted linear least squares on Chebyshev points, Q monic. The same bits on every platform,
/// and a quarter of the instructions of a correctly rounded one.
#[inline(always)]
#[must_use]
pub fn tanh(x: f32) -> f32 {
    tanh_each(Vec3::splat(x)).x
}

/// [`tanh`] of each element; the three share the loads of the coefficients.
#[inline(always)]
fn tanh_each(x: Vec3) -> Vec3 {
    /// Square of the end of the fitted range.
    const RANGE_SQUARED: f32 = 7.8 * 7.8;
    const P: [f32; 5] = [5024.807, 639.6316, 13.637163, 0.0366609, -3.209_071_3e-5];
    const Q: [f32; 3] = [5024.808, 2314.5605, 115.19264];

    let y = x * x;
    let p = (((P[4] * y + P[3]) * y + P[2]) * y + P[1]) * y + P[0];
    let q = ((y + Q[2]) * y + Q[1]) * y + Q[0];
    let t = x * p / q;
    let limited = |y: f32, t: f32, x: f32| {
        if y > RANGE_SQUARED {
            cold_path();
            return 1.0_f32.copysign(x);
        }
        t
    };
    Vec3::new(limited(y.x, t.x, x.x), limited(y.y, t.y, x.y), limited(y.z, t.z, x.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{assert, format, vec::Vec};

    #[test]
    fn tanh_keeps_its_error_bound_and_its_limits() {
        let mut worst = 0.0_f64;
        let mut previous = -1.0_f32;
        for i in -1_000_000..=1_000_000 {
            let x = i as f32 * 1e-5;
            let t = tanh(x);
            worst = worst.max((f64::from(t) - f64::from(x).tanh()).abs());
            assert!(t.abs() <= 1.0, "tanh({x}) = {t}");
            assert!(t >= previous - 5e-7, "tanh falls by more than its error at {x}");
            previous = t;
        }
        assert!(worst <= 5e-7, "error {worst:e}");
        assert_eq!(tanh(f32::INFINITY), 1.0);
        assert_eq!(tanh(f32::NEG_INFINITY), -1.0);
        assert!(tanh(f32::NAN).is_nan());
    }

    #[test]
    fn tanh_is_odd_and_relative_to_small_arguments() {
        for exponent in -40..3 {
            let x = 1.37 * libm::exp2f(exponent as f32);
            assert_eq!(tanh(-x).to_bits(), (-tanh(x)).to_bits());
            let exact = f64::from(x).tanh();
            let relative = (f64::from(tanh(x)) / exact - 1.0).abs();
            assert!(relative <= 5e-7, "x = {x:e}: {relative:e}");
        }
    }

    /// Central differences in f64 of the exact functions against slope and curvature.
    #[test]
    fn slopes_and_curvatures_are_those_of_the_exact_functions() {
        let delta_squared = 0.04_f32;
        for i in -400..=400 {
            let x = i as f32 * 0.02;
            let step = 1e-4_f64;
            let check = |response: Response, exact: &dyn Fn(f64) -> f64, name: &str| {
                let x = f64::from(x);
                let (low, mid, high) = (exact(x - step), exact(x), exact(x + step));
                let pairs: Vec<(f32, f64)> = [
                    (response.value.x, mid),
                    (response.slope.x, (high - low) / (2.0 * step)),
                    (response.bend.x * response.slope.x, (high - 2.0 * mid + low) / (step * step)),
                ]
                .into();
                for (order, (got, want)) in pairs.into_iter().enumerate() {
                    let scale = 25.0_f64.powi(i32::try_from(order).unwrap());
                    let what = format!("{name}, derivative {order}, x = {x}: {got} != {want}");
                    assert!((f64::from(got) - want).abs() < 5e-6 * scale, "{what}");
                }
            };
            check(sigma(Vec3::splat(x), 3.0), &|x| 3.0 * x.tanh(), "sigma");
            check(
                smooth_sign(Vec3::splat(x), delta_squared),
                &|x| x / (x * x + f64::from(delta_squared)).sqrt(),
                "smooth sign",
            );
        }
    }

    #[test]
    fn clip_is_exact() {
        let x = Vec3::new(0.3, -7.0, 9.0);
        assert_eq!(clip(x, Vec3::splat(0.5)), Vec3::new(0.3, -0.5, 0.5));
        assert_eq!(clip(x, Vec3::new(0.2, 8.0, 0.5)), Vec3::new(0.2, -7.0, 0.5));
    }
}
