//! Against SciPy's coefficients in 64 bits, against the closed form of the frequency response, and at the borders.

use core::f64::consts::{PI, TAU};
use std::string::ToString;
use std::vec::Vec;

use glam::{DVec3, Vec3};

use super::*;

/// A filter with SciPy 1.17.1's coefficients `b`, `a`: `signal.butter(2, f, fs=rate)`, `signal.iirnotch(f, q, fs=rate)`.
struct Golden {
    frequency: f32,
    /// `Q` of a notch; none for a low-pass.
    notch: Option<f32>,
    rate: f32,
    b: [f64; 3],
    a: [f64; 2],
}

const GOLDEN: [Golden; 6] = [
    Golden {
        frequency: 80.0,
        notch: None,
        rate: 1000.0,
        b: [0.04613180209331293, 0.09226360418662587, 0.04613180209331293],
        a: [-1.3072850288493236, 0.4918122372225753],
    },
    Golden {
        frequency: 1.0,
        notch: None,
        rate: 1000.0,
        b: [9.825916820482034e-06, 1.965183364096407e-05, 9.825916820482034e-06],
        a: [-1.9911142922016536, 0.9911535958689355],
    },
    Golden {
        frequency: 225.0,
        notch: None,
        rate: 500.0,
        b: [0.8005924034645703, 1.6011848069291406, 0.8005924034645703],
        a: [1.561018075800718, 0.641351538057563],
    },
    Golden {
        frequency: 120.0,
        notch: Some(5.0),
        rate: 1000.0,
        b: [0.9297642801937871, -1.3555379823166434, 0.9297642801937871],
        a: [-1.3555379823166434, 0.8595285603875742],
    },
    Golden {
        frequency: 35.0,
        notch: Some(1.0),
        rate: 500.0,
        b: [0.8173096487720741, -1.479047760900947, 0.8173096487720741],
        a: [-1.479047760900947, 0.6346192975441483],
    },
    Golden {
        frequency: 450.0,
        notch: Some(30.0),
        rate: 1000.0,
        b: [0.9549649940888687, 1.8164513609239628, 0.9549649940888687],
        a: [1.8164513609239628, 0.9099299881777374],
    },
];

const BUTTERWORTH: f32 = core::f32::consts::FRAC_1_SQRT_2;

fn config(frequency: f32, notch: Option<f32>) -> RateFilterConfig {
    let low_pass = LowPassConfig { frequency, quality: BUTTERWORTH };
    RateFilterConfig {
        low_pass: notch.is_none().then_some(low_pass),
        notches: List::taking(notch.map(|quality| NotchConfig { frequency, quality }).into_iter()),
    }
}

fn filter(frequency: f32, notch: Option<f32>, rate: f32) -> RateFilter {
    RateFilter::new(&config(frequency, notch), 1.0 / rate).expect("valid")
}

/// Uniform noise in `[-1, 1)`.
fn noise(n: usize) -> impl Iterator<Item = f32> {
    let mut bits = 0x9E37_79B9_7F4A_7C15u64;
    (0..n).map(move |_| {
        bits ^= bits << 13;
        bits ^= bits >> 7;
        bits ^= bits << 17;
        (bits >> 40) as f32 * (1.0 / 8_388_608.0) - 1.0
    })
}

/// Direct form in `f64`, at rest at zero.
fn direct_form(golden: &Golden, x: impl Iterator<Item = f64>) -> Vec<f64> {
    let ([b0, b1, b2], [a1, a2]) = (golden.b, golden.a);
    let (mut s1, mut s2) = (0.0, 0.0);
    x.map(|x| {
        let y = b0 * x + s1;
        s1 = b1 * x - a1 * y + s2;
        s2 = b2 * x - a2 * y;
        y
    })
    .collect()
}

#[test]
fn outputs_are_those_of_scipys_filters_in_64_bits() {
    for golden in &GOLDEN {
        let expected = direct_form(golden, noise(20_000).map(f64::from));
        let filter = filter(golden.frequency, golden.notch, golden.rate);
        let mut state = filter.initial_state();
        filter.step(&mut state, Vec3::ZERO); // both start from rest at zero
        for (k, (x, expected)) in noise(20_000).zip(expected).enumerate() {
            let found = filter.step(&mut state, Vec3::new(x, -x, 0.0));
            let error = (f64::from(found.x) - expected).abs();
            // The documented number (docs/accuracy.md): of inputs within one.
            assert!(
                error < 4e-6,
                "{} Hz, sample {k}: {found} against {expected}",
                golden.frequency
            );
            assert!(found.y == -found.x && found.z == 0.0);
        }
    }
}

/// Complex gain of the prototype at the warped frequency.
fn response(frequency: f64, notch: Option<f64>, rate: f64, at: f64) -> [f64; 2] {
    let g = libm::tan(PI * frequency / rate);
    let omega = libm::tan(PI * at / rate) / g;
    let k = match notch {
        None => 2f64.sqrt(),
        Some(q) => libm::tan(PI * frequency / rate / q) * (1.0 + g * g) / g,
    };
    let (re, im) = (1.0 - omega * omega, k * omega);
    let square = re * re + im * im;
    match notch {
        None => [re / square, -im / square],
        Some(_) => [re * re / square, -re * im / square],
    }
}

#[test]
fn gain_and_phase_are_those_of_the_closed_form() {
    for (frequency, notch) in [(80.0, None), (250.0, None), (180.0, Some(6.0)), (60.0, Some(2.0))] {
        let filter = filter(frequency, notch, 1000.0);
        for at in [5.0, 40.0, 60.0, 80.0, 165.0, 180.0, 195.0, 400.0] {
            let mut state = filter.initial_state();
            let mut sum = [0.0; 2];
            for k in 0..4_000 {
                let angle = TAU * at / 1000.0 * f64::from(k);
                let y = filter.step(&mut state, Vec3::splat(libm::cos(angle) as f32)).x;
                if k >= 2_000 {
                    // 2 s are whole periods of each frequency.
                    sum[0] += f64::from(y) * libm::cos(angle) / 1000.0;
                    sum[1] -= f64::from(y) * libm::sin(angle) / 1000.0;
                }
            }
            let expected = response(frequency.into(), notch.map(f64::from), 1000.0, at);
            let error = libm::hypot(sum[0] - expected[0], sum[1] - expected[1]);
            assert!(error < 1e-6, "{frequency} Hz at {at} Hz: {sum:?}, {expected:?}");
        }
    }
}

#[test]
fn a_notch_is_as_wide_as_its_quality_says() {
    for (frequency, quality) in [(120.0, 5.0), (450.0, 30.0), (100.0, 1.0)] {
        let gain = |at| libm::hypot(response(frequency, Some(quality), 1000.0, at)[0], 0.0);
        // Half of the power is where the real part of the gain is a half: two points, `f/Q` apart.
        let half = |mut inside: f64, mut outside: f64| {
            for _ in 0..60 {
                let middle = 0.5 * (inside + outside);
                *(if gain(middle) < 0.5 { &mut inside } else { &mut outside }) = middle;
            }
            inside
        };
        let width = half(frequency, 499.9) - half(frequency, 0.1);
        assert!((width / (frequency / quality) - 1.0).abs() < 1e-9, "{width}");
    }
}

#[test]
fn at_rest_the_rate_passes_to_the_bit_from_the_first_sample_on() {
    let rate = Vec3::new(0.123_456_7, -7.891, 3e-5);
    let mut config = config(40.0, None);
    config.notches =
        List::from_slice(&[NotchConfig { frequency: 150.0, quality: 3.0 }; 3]).unwrap();
    for config in [config, RateFilterConfig::default()] {
        let filter = RateFilter::new(&config, 1e-3).unwrap();
        let mut state = filter.initial_state();
        assert!((0..5_000).all(|_| filter.step(&mut state, rate) == rate));
    }
}

#[test]
fn without_sections_every_sample_passes() {
    let filter = RateFilter::new(&RateFilterConfig::default(), 1e-3).unwrap();
    let mut state = filter.initial_state();
    assert!(noise(100).all(|x| filter.step(&mut state, Vec3::splat(x)) == Vec3::splat(x)));
}

#[test]
fn what_is_no_rate_is_passed_on_and_forgotten() {
    let filter = filter(80.0, None, 1000.0);
    let (mut state, mut untouched) = (filter.initial_state(), filter.initial_state());
    for (k, x) in noise(500).enumerate() {
        let expected = filter.step(&mut untouched, Vec3::splat(x));
        let bad = [f32::NAN, f32::INFINITY, f32::MAX, -2e6][k % 4];
        let seen = filter.step(&mut state, Vec3::new(0.0, bad, 0.0));
        assert!(seen.y.to_bits() == bad.to_bits());
        assert_eq!(filter.step(&mut state, Vec3::splat(x)), expected);
    }
}

#[test]
fn extreme_rates_leave_finite_states() {
    for golden in &GOLDEN {
        let filter = filter(golden.frequency, golden.notch, golden.rate);
        let mut state = filter.initial_state();
        for x in noise(20_000) {
            let seen = filter.step(&mut state, Vec3::splat(1e6 * x.signum()));
            assert!(seen.is_finite());
        }
        let rest = DVec3::splat(0.25);
        let settled = (0..20_000).map(|_| filter.step(&mut state, rest.as_vec3())).last().unwrap();
        assert!((settled.as_dvec3() - rest).length() < 1e-5, "{settled}");
    }
}

#[test]
fn frequencies_and_qualities_out_of_range_are_refused_by_name() {
    let fault = |config: RateFilterConfig| RateFilter::new(&config, 1e-3).unwrap_err().to_string();
    for (frequency, notch, expected) in [
        (451.0, None, "rate_filter.low_pass.frequency = 451 must be in [1, 450]"),
        (f32::NAN, None, "rate_filter.low_pass.frequency = NaN must be in [1, 450]"),
        (0.5, Some(3.0), "rate_filter.notches.frequency = 0.5 must be in [1, 450]"),
        (50.0, Some(0.9), "rate_filter.notches.quality = 0.9 must be in [1, 100]"),
    ] {
        let message = fault(config(frequency, notch));
        assert!(message.starts_with(expected), "{message}");
    }
    let low_pass = Some(LowPassConfig { frequency: 50.0, quality: 0.1 });
    let message = fault(RateFilterConfig { low_pass, ..RateFilterConfig::default() });
    assert!(message.starts_with("rate_filter.low_pass.quality = 0.1 must be in"), "{message}");
}
