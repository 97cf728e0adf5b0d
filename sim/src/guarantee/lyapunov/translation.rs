//! Step 1 of the cascade from the truth: `G` (16), `alpha` (13) and the translational part of V.

use ctrl_core::vehicle::GRAVITY;
use glam::DVec3;

use super::parameters::Parameters;
use crate::exponential::{exp_m1, ln_1p};
use crate::guarantee::block::Block;
use crate::lanes::{Scalars, Vectors, all, copysign};

/// Everything translational at each tick of a block.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Translation {
    pub position_error: Vectors,
    pub velocity_error: Vectors,
    /// `sig_1(L1)`.
    pub sigma_1: Vectors,
    /// `G` (16).
    pub g: Vectors,
    /// `h(G, delta_t)` (17).
    pub sign: Vectors,
    /// `beta alpha` (13) before the integral action (m/s^2).
    pub acceleration: Vectors,
    /// `V1` without its mass term.
    pub potential: Scalars,
    /// `k2 |sig_1 + sig_2|^2 + (k1/k2) L2 . sig_2(L2)` (18).
    pub decrease: Scalars,
}

impl Translation {
    pub(super) fn new(p: &Parameters, block: &Block, delta: Scalars) -> Self {
        let e_p = block.position - block.reference.position;
        let e_v = block.velocity - block.reference.velocity;
        let (l1, l2) = (e_p * p.k1 + e_v * p.k2, e_v * p.k2);
        let (tanh_1, ln_cosh_1) = tanh_and_ln_cosh(l1);
        let (tanh_2, ln_cosh_2) = tanh_and_ln_cosh(l2);
        let (sigma_1, sigma_2) = (tanh_1 * p.m1, tanh_2 * p.m2);
        let g = (sigma_1 + sigma_2) * p.k2 + e_v * p.k1; // (16)
        let gravity = Vectors::all(f64::from(GRAVITY) * DVec3::Z);
        let needed = gravity + block.reference.acceleration;
        let sign = smooth_sign(g, delta);
        Self {
            position_error: e_p,
            velocity_error: e_v,
            sigma_1,
            g,
            sign,
            acceleration: needed - sigma_1 - sigma_2 - sign * p.d1,
            potential: all(p.m1) * ln_cosh_1
                + all(p.m2) * ln_cosh_2
                + all(0.5 * p.k1) * e_v.length_squared(),
            decrease: all(p.k2) * (sigma_1 + sigma_2).length_squared()
                + all(p.k1 / p.k2) * l2.dot(sigma_2),
        }
    }
}

/// `tanh(x_j)` for each component, and the sum of `ln cosh(x_j)`, which never overflows.
///
/// With `t = exp(-2|x|) - 1`: `tanh|x| = -t/(2 + t)` and `ln cosh x = |x| + ln(1 + t/2)`.
fn tanh_and_ln_cosh(x: Vectors) -> (Vectors, Scalars) {
    let magnitude = x.map(Scalars::abs);
    let t = magnitude.map(|x| exp_m1(all(-2.0) * x));
    let tanh = |t: Scalars, x| copysign(-t / (t + all(2.0)), x);
    let tanh = Vectors { x: tanh(t.x, x.x), y: tanh(t.y, x.y), z: tanh(t.z, x.z) };
    let logarithms = t.map(|t| ln_1p(all(0.5) * t));
    (tanh, magnitude.element_sum() + logarithms.element_sum())
}

/// `h(x, delta)` (17).
pub(super) fn smooth_sign(x: Vectors, delta: Scalars) -> Vectors {
    x.map(|x| x / (x * x + delta * delta).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tanh_and_ln_cosh_match_the_definitions() {
        for x in [-30.0, -2.5, -1e-9, 0.0, 1e-4, 0.7, 300.0] {
            let (tanh, ln_cosh) = tanh_and_ln_cosh(Vectors::all(DVec3::new(x, 0.0, 0.0)));
            let (tanh, ln_cosh) = (tanh.lane(3), ln_cosh.to_array()[3]);
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
            .map(|x| x - x * smooth_sign(Vectors::all(DVec3::X * x), all(1.0)).lane(0).x)
            .fold(0.0, f64::max);
        let constant = super::super::balance::SMOOTHING;
        assert!(worst <= constant && worst > constant - 1e-6, "{worst} {constant}");
    }
}
