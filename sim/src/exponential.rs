//! `exp(x) - 1` and `ln(1 + x)` of four numbers side by side, for the arguments that `tanh` and `ln cosh` have.
//!
//! Both are fdlibm's algorithms (Sun, 1993), operation by operation as glibc 2.36 evaluates them on a processor with fused
//! multiply-add, so that each lane has the bits of that library, whatever the C library and the processor are.

#[cfg(not(target_feature = "fma"))]
use crate::lanes::lanes;
use crate::lanes::{Scalars, all};

/// `ln 2` in two parts, of which the first has zeros at its end.
const LN_2: [f64; 2] =
    [f64::from_bits(0x3fe6_2e42_fee0_0000), f64::from_bits(0x3dea_39ef_3579_3c76)];
/// Coefficients of the rational approximation of `exp` (fdlibm's `Q`).
const Q: [f64; 5] = [
    f64::from_bits(0xbfa1_1111_1111_10f4),
    f64::from_bits(0x3f5a_01a0_19fe_5585),
    f64::from_bits(0xbf14_ce19_9eaa_dbb7),
    f64::from_bits(0x3ed0_cfca_86e6_5239),
    f64::from_bits(0xbe8a_fdb7_6e09_c32d),
];
/// Coefficients of the polynomial of `ln` (fdlibm's `Lp`).
const LP: [f64; 7] = [
    f64::from_bits(0x3fe5_5555_5555_5593),
    f64::from_bits(0x3fd9_9999_9997_fa04),
    f64::from_bits(0x3fd2_4924_9422_9359),
    f64::from_bits(0x3fcc_71c5_1d8e_78af),
    f64::from_bits(0x3fc7_4664_96cb_03de),
    f64::from_bits(0x3fc3_9a09_d078_c69f),
    f64::from_bits(0x3fc2_f112_df3e_5244),
];

/// The number whose high word is `word`, the least of them; fdlibm compares high words.
const fn high(word: u64) -> f64 {
    f64::from_bits(word << 32)
}

/// `a b + c`, rounded once.
#[inline(always)]
fn fma(a: Scalars, b: Scalars, c: Scalars) -> Scalars {
    #[cfg(target_feature = "fma")]
    return a.mul_add(b, c);
    #[cfg(not(target_feature = "fma"))]
    {
        // A build for any processor: the C library has the instruction where the processor has.
        let (a, b, c) = (a.to_array(), b.to_array(), c.to_array());
        lanes(|lane| a[lane].mul_add(b[lane], c[lane]))
    }
}

/// `a b - c`, rounded once.
#[inline(always)]
fn fms(a: Scalars, b: Scalars, c: Scalars) -> Scalars {
    fma(a, b, -c)
}

/// `c - a b`, rounded once.
#[inline(always)]
fn fnma(a: Scalars, b: Scalars, c: Scalars) -> Scalars {
    fma(-a, b, c)
}

/// `exp(y) - 1` for `y` up to zero.
#[inline]
pub fn exp_m1(y: Scalars) -> Scalars {
    let size = y.abs();
    let small = size.simd_lt(all(high(0x3fd6_2e43))); // 1/2 ln 2
    let middle = size.simd_lt(all(high(0x3ff0_a2b2))); // 3/2 ln 2
    // y = k ln 2 + x + c
    let multiple = (y * all(core::f64::consts::LOG2_E) + all(-0.5)).ceil();
    let k = small.select(all(0.0), middle.select(all(-1.0), multiple));
    let (upper, lower) = (fnma(k, all(LN_2[0]), y), k * all(LN_2[1]));
    let x = upper - lower;
    let c = (upper - x) - lower;
    let half = x * all(0.5);
    let square = x * half;
    let square_2 = square * square;
    let square_4 = square_2 * square_2;
    let [q1, q2, q3, q4, q5] = Q.map(all);
    let (r1, r2, r3) = (fma(square, q1, all(1.0)), fma(q3, square, q2), fma(q5, square, q4));
    let r = fma(square_4, r3, fma(square_2, r2, r1));
    let t = fnma(half, r, all(3.0));
    let e = (r - t) / fnma(t, x, all(6.0)) * square;
    let alone = x - fms(e, x, square);
    let e = fms(e - c, x, c) - square;
    let below = fma(x - e, all(0.5), all(-0.5));
    let scaled = (all(1.0) - (e - x)) * power_of_two(k) - all(1.0);
    let value = small.select(alone, k.simd_eq(all(-1.0)).select(below, scaled));
    let value = size.simd_lt(all(high(0x4043_687a))).select(value, all(-1.0)); // 56 ln 2
    size.simd_lt(all(high(0x3c90_0000))).select(y, value) // 2^-54
}

/// `2^k` for `k` from -1022 to 1023.
#[inline(always)]
fn power_of_two(k: Scalars) -> Scalars {
    // The sum's last bits are the exponent.
    let shifted = (k + all(6_755_399_441_055_744.0 + 1023.0)).to_array();
    Scalars::new(shifted.map(|it| f64::from_bits(it.to_bits() << 52)))
}

/// `ln(1 + x)` for `x` from -1/2 to zero.
#[inline]
pub fn ln_1p(x: Scalars) -> Scalars {
    let size = x.abs();
    // Near zero f = x; below 1 + x = 2^k (1 + f), with k = -1 or 0, and c for what 1 + x has lost.
    let near = x.simd_gt(all(-high(0x3fd2_bec4))); // 0.2929
    let u = all(1.0) + x;
    let halved = u.simd_lt(all(0.5 * high(0x3ff6_a09e))) & !near;
    let c = (x - (u - all(1.0))) / u;
    let f = near.select(x, halved.select(u + u, u) - all(1.0));
    let half_square = all(0.5) * f * f;
    let s = f / (all(2.0) + f);
    let z = s * s;
    let z2 = z * z;
    let z4 = z2 * z2;
    let z6 = z4 * z2;
    let [p1, p2, p3, p4, p5, p6, p7] = LP.map(all);
    let (r2, r3, r4) = (fma(p3, z, p2), fma(p5, z, p4), fma(p7, z, p6));
    let r = fma(z6, r4, fma(z4, r3, fma(z, p1, z2 * r2)));
    let rest = (r + half_square) * s;
    let alone = f - (half_square - rest);
    let k = all(-1.0);
    let lost = fma(k, all(LN_2[1]), c);
    let series = |rest: Scalars| fms(k, all(LN_2[0]), rest - f);
    let mut below = series(half_square - (lost + rest));
    let tiny = halved & f.simd_lt(all(1.0 / f64::from(1 << 20)));
    if tiny.any() {
        let short = half_square * fnma(all(2.0 / 3.0), f, all(1.0));
        let short = f.simd_eq(all(0.0)).select(below, series(short - lost));
        below = tiny.select(short, below);
    }
    let value = halved.select(below, alone);
    let square = size.simd_lt(all(high(0x3e20_0000))); // 2^-29
    let value = square.select(fnma(x * x, all(0.5), x), value);
    size.simd_lt(all(high(0x3c90_0000))).select(x, value) // 2^-54
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{LANES, lanes};

    /// Arguments of every size, dense where the algorithm changes; the same at every call.
    fn arguments(most: f64, count: u32) -> impl Iterator<Item = f64> {
        let mut state = 1_u64;
        (0..count).map(move |index| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let share = (state >> 11) as f64 / (1_u64 << 53) as f64;
            match index % 4 {
                0 => -most * share,
                1 => -most * share * share * share,
                2 => -(-60.0 * share).exp2() * most,
                _ => (-(f64::from(index % 1000) * 1e-3) * most) * (1.0 + 1e-9 * share),
            }
        })
    }

    fn edges() -> Vec<f64> {
        let words = [
            0x3fd6_2e42_u64,
            0x3fd6_2e43,
            0x3ff0_a2b1,
            0x3ff0_a2b2,
            0x4043_6879,
            0x4043_687a,
            0x3c90_0000,
            0x3c8f_ffff,
            0x3fd2_bec3,
            0x3fd2_bec4,
            0x3e20_0000,
            0x3e1f_ffff,
            0x3fd2_bec5,
        ];
        let near = |word: u64| [word << 32, word << 32 | 0xffff_ffff, (word << 32) - 1];
        words
            .into_iter()
            .flat_map(near)
            .map(|bits| -f64::from_bits(bits))
            .chain([0.0, -0.0])
            .collect()
    }

    /// Checksum of the results' bits, and the largest difference from the C library in units of the last place.
    fn compared(f: fn(Scalars) -> Scalars, library: fn(f64) -> f64, most: f64) -> (u64, u64) {
        let edges = edges().into_iter().filter(|x| x.abs() <= most);
        let extra = (0..4000).map(|i| -0.5 + f64::from(i) * 1e-10).filter(|_| most < 1.0);
        let all: Vec<f64> = arguments(most, 400_000).chain(edges).chain(extra).collect();
        let (mut sum, mut worst) = (0_u64, 0);
        for four in all.chunks(LANES) {
            let found = f(lanes(|lane| four[lane.min(four.len() - 1)])).to_array();
            for (x, found) in four.iter().zip(found) {
                sum = sum.rotate_left(5) ^ found.to_bits().wrapping_mul(0x9e37_79b9_7f4a_7c15);
                let expected = library(*x);
                assert!(found.signum() == expected.signum() || expected == 0.0, "{x:e}");
                worst = worst.max(found.to_bits().abs_diff(expected.to_bits()));
            }
        }
        (sum, worst)
    }

    #[test]
    fn every_lane_has_the_bits_of_one_library_and_is_near_to_any() {
        let exp = compared(exp_m1, f64::exp_m1, 50.0);
        let ln = compared(ln_1p, f64::ln_1p, 0.5);
        assert!(exp.1 <= 1 && ln.1 <= 1, "{exp:?} {ln:?}");
        // Of glibc 2.36, from which no bit differed.
        let sums = (12_261_437_997_479_147_945, 5_224_023_830_778_858_221);
        assert_eq!((exp.0, ln.0), sums, "{exp:?} {ln:?}");
    }
}
