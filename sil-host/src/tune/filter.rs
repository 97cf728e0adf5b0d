//! Frequency response of the filters of the body rate, from the prototypes that `ctrl_core::filter` documents.

use core::f64::consts::PI;

use ctrl_core::filter::RateFilterConfig;
use num_complex::Complex64;

/// `F(e^(i omega dt))` of all sections in series; `omega` in rad/s, at most half the sample rate.
#[must_use]
pub fn response(filter: &RateFilterConfig, omega: f64, dt: f64) -> Complex64 {
    let warped = (0.5 * omega * dt).tan();
    let prototype = |frequency: f32| {
        let g = (PI * f64::from(frequency) * dt).tan();
        (g, Complex64::new(0.0, warped / g))
    };
    let mut product = Complex64::new(1.0, 0.0);
    if let Some(low_pass) = &filter.low_pass {
        let (_, s) = prototype(low_pass.frequency);
        product /= s * s + s / f64::from(low_pass.quality) + 1.0;
    }
    for notch in &filter.notches {
        let (g, s) = prototype(notch.frequency);
        let half = PI * f64::from(notch.frequency) * dt / f64::from(notch.quality);
        let k = half.tan() * (1.0 + g * g) / g;
        product *= (s * s + 1.0) / (s * s + k * s + 1.0);
    }
    product
}

/// Delay of slow signals (s).
#[must_use]
pub fn slow_delay(filter: &RateFilterConfig, dt: f64) -> f64 {
    let omega = 1e-3 / dt;
    -response(filter, omega, dt).arg() / omega
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    use ctrl_core::filter::{LowPassConfig, NotchConfig, RateFilter};
    use ctrl_core::list::List;
    use glam::Vec3;

    #[test]
    fn it_is_the_response_of_the_core_s_filter() {
        let filter = RateFilterConfig {
            low_pass: Some(LowPassConfig { frequency: 90.0, quality: 0.6 }),
            notches: List::taking([NotchConfig { frequency: 150.0, quality: 3.0 }].into_iter()),
        };
        let built = RateFilter::new(&filter, 1e-3).expect("valid");
        for frequency in [5.0, 40.0, 90.0, 140.0, 150.0, 300.0] {
            let (mut state, mut sum) = (built.initial_state(), Complex64::default());
            for k in 0..4_000 {
                let angle = TAU * frequency * 1e-3 * f64::from(k);
                let y = built.step(&mut state, Vec3::splat(angle.cos() as f32)).x;
                if k >= 2_000 {
                    sum += f64::from(y) * Complex64::from_polar(1e-3, -angle);
                }
            }
            let expected = response(&filter, TAU * frequency, 1e-3);
            assert!((sum - expected).norm() < 1e-5, "{frequency} Hz: {sum}, {expected}");
        }
    }

    #[test]
    fn a_butterworth_low_pass_delays_slow_signals_by_its_damping() {
        let quality = core::f32::consts::FRAC_1_SQRT_2;
        let low_pass = Some(LowPassConfig { frequency: 50.0, quality });
        let filter = RateFilterConfig { low_pass, ..RateFilterConfig::default() };
        // 2 zeta/omega_0 of the prototype.
        assert!((slow_delay(&filter, 1e-3) / (2f64.sqrt() / (TAU * 50.0)) - 1.0).abs() < 0.02);
    }
}
