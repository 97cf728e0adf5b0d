//! Step 1 of the cascade from the truth: `G` (16), `alpha` (13) and the translational part of V.

use ctrl_core::vehicle::GRAVITY;
use glam::DVec3;

use super::parameters::Parameters;
use crate::evaluation::Translation;
use crate::tick::Tick;

impl Translation {
    pub(super) fn new(
        p: &Parameters,
        tick: &Tick,
        inverse_mass: f64,
        d_hat: DVec3,
        delta: f64,
    ) -> Self {
        let (truth, reference) = (&tick.truth, &tick.reference);
        let e_p = truth.position_world - reference.position_world.as_dvec3();
        let e_v = truth.velocity_world - reference.velocity_world.as_dvec3();
        let (l1, l2) = (p.k1 * e_p + p.k2 * e_v, p.k2 * e_v);
        let (tanh_1, ln_cosh_1) = tanh_and_ln_cosh(l1);
        let (tanh_2, ln_cosh_2) = tanh_and_ln_cosh(l2);
        let (sigma_1, sigma_2) = (p.m1 * tanh_1, p.m2 * tanh_2);
        let g = p.k2 * (sigma_1 + sigma_2) + p.k1 * e_v; // (16)
        let needed = f64::from(GRAVITY) * DVec3::Z + reference.acceleration_world.as_dvec3();
        let sign = smooth_sign(g, delta);
        let mut acceleration = needed - sigma_1 - sigma_2 - p.d1 * sign;
        if p.integral.is_some() {
            acceleration -= d_hat;
        }
        Self {
            position_error: e_p,
            velocity_error: e_v,
            sigma_1,
            g,
            sign,
            alpha: acceleration / inverse_mass, // (13)
            potential: p.m1 * ln_cosh_1 + p.m2 * ln_cosh_2 + 0.5 * p.k1 * e_v.length_squared(),
            decrease: p.k2 * (sigma_1 + sigma_2).length_squared() + p.k1 / p.k2 * l2.dot(sigma_2),
        }
    }
}

/// `tanh(x_j)` for each component, and the sum of `ln cosh(x_j)`, which never overflows.
///
/// With `t = exp(-2|x|) - 1`: `tanh|x| = -t/(2 + t)` and `ln cosh x = |x| + ln(1 + t/2)`.
fn tanh_and_ln_cosh(x: DVec3) -> (DVec3, f64) {
    let magnitude = x.abs();
    let t = DVec3::from_array(magnitude.to_array().map(|x| (-2.0 * x).exp_m1()));
    let tanh = (-t / (t + 2.0)).copysign(x);
    let logarithms = t.to_array().iter().map(|t| (0.5 * t).ln_1p()).sum::<f64>();
    (tanh, magnitude.element_sum() + logarithms)
}

/// `h(x, delta)` (17).
pub(super) fn smooth_sign(x: DVec3, delta: f64) -> DVec3 {
    DVec3::from_array(x.to_array().map(|x| x / (x * x + delta * delta).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tanh_and_ln_cosh_match_the_definitions() {
        for x in [-30.0, -2.5, -1e-9, 0.0, 1e-4, 0.7, 300.0] {
            let (tanh, ln_cosh) = tanh_and_ln_cosh(DVec3::new(x, 0.0, 0.0));
            assert!((tanh.x - f64::tanh(x)).abs() <= 4e-16, "{x}: {tanh}");
            let expected =
                if x.abs() < 100.0 { x.cosh().ln() } else { x.abs() - core::f64::consts::LN_2 };
            assert!((ln_cosh - expected).abs() <= 1e-15 * (1.0 + x.abs()), "{x}: {ln_cosh}");
        }
    }

    #[test]
    fn the_smooth_sign_error_has_the_constant_of_the_balance() {
        let worst = (0..4000)
            .map(|i| f64::from(i) * 1e-3)
            .map(|x| x - x * smooth_sign(DVec3::new(x, 0.0, 0.0), 1.0).x)
            .fold(0.0, f64::max);
        let constant = super::super::balance::SMOOTHING;
        assert!(worst <= constant && worst > constant - 1e-6, "{worst} {constant}");
    }
}
