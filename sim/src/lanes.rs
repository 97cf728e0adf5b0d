//! Numbers, vectors and quaternions of four ticks, or of four stages of a tick, side by side, one per SIMD lane.
//!
//! Every operation is glam's, component by component and in its order, and every one of IEEE 754 is correctly
//! rounded in each lane: a lane has the bits that `f64`, [`DVec3`] and [`DQuat`] have.

use core::array::from_fn;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use glam::{DQuat, DVec3};
use wide::f64x4;

/// Ticks side by side.
pub const LANES: usize = 4;

/// A number per lane.
pub type Scalars = f64x4;

/// The same number in every lane.
#[inline(always)]
pub fn all(x: f64) -> Scalars {
    Scalars::splat(x)
}

/// `magnitude` with the sign of `x`.
#[inline(always)]
pub fn copysign(magnitude: Scalars, x: Scalars) -> Scalars {
    all(-0.0).bitselect(x, magnitude)
}

/// The lanes of `now` one tick later: its last three, then the first of the `next` block.
#[inline(always)]
pub fn later(now: Scalars, next: Scalars) -> Scalars {
    let ([_, b, c, d], [e, ..]) = (now.to_array(), next.to_array());
    Scalars::new([b, c, d, e])
}

/// A vector and a number in one.
#[inline(always)]
pub fn four(v: DVec3, w: f64) -> Scalars {
    Scalars::new([v.x, v.y, v.z, w])
}

/// `x` with `last` in its last lane.
#[inline(always)]
pub fn with_last(x: Scalars, last: f64) -> Scalars {
    let [a, b, c, _] = x.to_array();
    Scalars::new([a, b, c, last])
}

/// A vector per lane.
#[derive(Clone, Copy, Debug, Default)]
pub struct Vectors {
    pub x: Scalars,
    pub y: Scalars,
    pub z: Scalars,
}

/// A quaternion per lane.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quaternions {
    pub x: Scalars,
    pub y: Scalars,
    pub z: Scalars,
    pub w: Scalars,
}

impl Vectors {
    /// The same vector in every lane.
    #[inline(always)]
    pub fn all(v: DVec3) -> Self {
        Self { x: all(v.x), y: all(v.y), z: all(v.z) }
    }

    /// A vector for each lane.
    #[inline(always)]
    pub fn of(v: [DVec3; LANES]) -> Self {
        Self {
            x: Scalars::new(v.map(|v| v.x)),
            y: Scalars::new(v.map(|v| v.y)),
            z: Scalars::new(v.map(|v| v.z)),
        }
    }

    /// `f` of every component.
    #[inline(always)]
    pub fn map(self, f: impl Fn(Scalars) -> Scalars) -> Self {
        Self { x: f(self.x), y: f(self.y), z: f(self.z) }
    }

    /// Its components.
    #[inline(always)]
    pub fn to_array(self) -> [Scalars; 3] {
        [self.x, self.y, self.z]
    }

    /// The vector in a lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> DVec3 {
        let Self { x, y, z } = self;
        DVec3::new(x.as_array()[lane], y.as_array()[lane], z.as_array()[lane])
    }

    /// The vector of each lane with the number of the same lane in `w`.
    #[inline(always)]
    pub fn fours(self, w: Scalars) -> [Scalars; LANES] {
        Scalars::transpose([self.x, self.y, self.z, w])
    }

    /// The vector of each lane, and a number of no meaning.
    #[inline(always)]
    pub fn padded(self) -> [Scalars; LANES] {
        self.fours(self.z)
    }

    /// The vectors and the numbers of [`fours`](Self::fours).
    #[inline(always)]
    pub fn of_fours(fours: [Scalars; LANES]) -> (Self, Scalars) {
        let [x, y, z, w] = Scalars::transpose(fours);
        (Self { x, y, z }, w)
    }

    /// As [`later`].
    #[inline(always)]
    pub fn later(self, next: Self) -> Self {
        let Self { x, y, z } = self;
        Self { x: later(x, next.x), y: later(y, next.y), z: later(z, next.z) }
    }

    #[inline(always)]
    pub fn dot(self, other: Self) -> Scalars {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - other.y * self.z,
            y: self.z * other.x - other.z * self.x,
            z: self.x * other.y - other.x * self.y,
        }
    }

    #[inline(always)]
    pub fn length_squared(self) -> Scalars {
        self.dot(self)
    }

    /// Length.
    #[inline(always)]
    pub fn norm(self) -> Scalars {
        self.length_squared().sqrt()
    }

    /// Unit vector.
    #[inline(always)]
    pub fn unit(self) -> Self {
        self * self.norm().recip()
    }

    #[inline(always)]
    pub fn element_sum(self) -> Scalars {
        self.x + self.y + self.z
    }
}

impl Quaternions {
    /// A quaternion for each lane.
    #[inline(always)]
    pub fn of(q: [DQuat; LANES]) -> Self {
        let [x, y, z, w] = Scalars::transpose(q.map(|q| Scalars::new(q.to_array())));
        Self { x, y, z, w }
    }

    /// The quaternion in a lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> DQuat {
        let [x, y, z, w] = [self.x, self.y, self.z, self.w].map(|it| it.as_array()[lane]);
        DQuat::from_xyzw(x, y, z, w)
    }

    /// As [`later`].
    #[inline(always)]
    pub fn later(self, next: Self) -> Self {
        let Self { x, y, z, w } = self;
        Self { x: later(x, next.x), y: later(y, next.y), z: later(z, next.z), w: later(w, next.w) }
    }

    #[inline(always)]
    pub fn xyz(self) -> Vectors {
        Vectors { x: self.x, y: self.y, z: self.z }
    }

    /// Of a unit quaternion: its conjugate.
    #[inline(always)]
    pub fn inverse(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z, w: self.w }
    }

    #[inline(always)]
    pub fn dot(self, other: Self) -> Scalars {
        self.x * other.x + self.y * other.y + self.z * other.z + self.w * other.w
    }

    /// In each lane: true where `self` and `other` are equal in every component.
    #[inline(always)]
    pub fn equal(self, other: Self) -> Scalars {
        self.x.simd_eq(other.x)
            & self.y.simd_eq(other.y)
            & self.z.simd_eq(other.z)
            & self.w.simd_eq(other.w)
    }

    /// `R e3` of quaternions that need not have unit length.
    #[inline(always)]
    pub fn thrust_axis(self) -> Vectors {
        let Self { x, y, z, w } = self;
        Vectors {
            x: all(2.0) * (x * z + w * y),
            y: all(2.0) * (y * z - w * x),
            z: w * w - x * x - y * y + z * z,
        }
    }

    /// Each lane of `yes` where `condition` is true, else of `no`.
    #[inline(always)]
    pub fn select(condition: Scalars, yes: Self, no: Self) -> Self {
        Self {
            x: condition.select(yes.x, no.x),
            y: condition.select(yes.y, no.y),
            z: condition.select(yes.z, no.z),
            w: condition.select(yes.w, no.w),
        }
    }
}

macro_rules! by_component {
    ($($trait:ident $method:ident),*) => { $(
        impl $trait for Vectors {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self {
                    x: self.x.$method(other.x),
                    y: self.y.$method(other.y),
                    z: self.z.$method(other.z),
                }
            }
        }
    )* };
}

by_component!(Add add, Sub sub, Mul mul, Div div);

impl AddAssign for Vectors {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Neg for Vectors {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|x| -x)
    }
}

impl Neg for Quaternions {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z, w: -self.w }
    }
}

impl Mul<Scalars> for Vectors {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: Scalars) -> Self {
        self.map(|x| x * factor)
    }
}

impl Div<Scalars> for Vectors {
    type Output = Self;
    #[inline(always)]
    fn div(self, divisor: Scalars) -> Self {
        self.map(|x| x / divisor)
    }
}

impl Mul<f64> for Vectors {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self * all(factor)
    }
}

impl Mul<Scalars> for Quaternions {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: Scalars) -> Self {
        let Self { x, y, z, w } = self;
        Self { x: x * factor, y: y * factor, z: z * factor, w: w * factor }
    }
}

impl Mul for Quaternions {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (Self { x: x0, y: y0, z: z0, w: w0 }, Self { x: x1, y: y1, z: z1, w: w1 }) =
            (self, other);
        Self {
            x: w0 * x1 + x0 * w1 + y0 * z1 - z0 * y1,
            y: w0 * y1 - x0 * z1 + y0 * w1 + z0 * x1,
            z: w0 * z1 + x0 * y1 - y0 * x1 + z0 * w1,
            w: w0 * w1 - x0 * x1 - y0 * y1 - z0 * z1,
        }
    }
}

/// Rotates a vector by a unit quaternion.
impl Mul<Vectors> for Quaternions {
    type Output = Vectors;
    #[inline(always)]
    fn mul(self, v: Vectors) -> Vectors {
        let (w, b) = (self.w, self.xyz());
        let b2 = b.dot(b);
        v * (w * w - b2) + b * (v.dot(b) * all(2.0)) + b.cross(v) * (w * all(2.0))
    }
}

/// Lanes from `f` of the lane's number.
#[inline(always)]
pub fn lanes(f: impl FnMut(usize) -> f64) -> Scalars {
    Scalars::new(from_fn(f))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of many sizes and both signs, the same at every call.
    fn numbers() -> impl FnMut() -> f64 {
        let mut state = 1u32;
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let size = 10f64.powi((state >> 8) as i32 % 9 - 4);
            size * (f64::from(state >> 4) / f64::from(1u32 << 27) - 1.0)
        }
    }

    fn bits(v: DVec3) -> [u64; 3] {
        v.to_array().map(f64::to_bits)
    }

    #[test]
    fn each_lane_has_the_bits_of_glam() {
        let mut number = numbers();
        for _ in 0..200 {
            let mut vector = || DVec3::new(number(), number(), number());
            let u: [DVec3; LANES] = from_fn(|_| vector());
            let v: [DVec3; LANES] = from_fn(|_| vector());
            let q: [DQuat; LANES] = from_fn(|lane| DQuat::from_scaled_axis(u[lane].normalize()));
            let p: [DQuat; LANES] = from_fn(|lane| DQuat::from_scaled_axis(v[lane] * 1e-4));
            let (a, b) = (Vectors::of(u), Vectors::of(v));
            let (c, d) = (Quaternions::of(q), Quaternions::of(p));
            for lane in 0..LANES {
                let same = |found: Vectors, expected: DVec3| {
                    assert_eq!(bits(found.lane(lane)), bits(expected), "lane {lane}");
                };
                let (u, v, q, p) = (u[lane], v[lane], q[lane], p[lane]);
                same(a + b, u + v);
                same(a - b, u - v);
                same(a * b, u * v);
                same(a / b, u / v);
                same(-a, -u);
                same(a.cross(b), u.cross(v));
                same(a.unit(), u * u.length_squared().sqrt().recip());
                same(c * b, q * v);
                let product = ((c * d).lane(lane), (c.inverse() * d).lane(lane));
                assert_eq!(product, (q * p, q.inverse() * p));
                let dots = [a.dot(b), c.dot(d), a.norm()].map(|it| it.to_array()[lane].to_bits());
                assert_eq!(dots, [u.dot(v), q.dot(p), u.length()].map(f64::to_bits));
            }
        }
    }

    #[test]
    fn vectors_and_numbers_become_fours_and_come_back() {
        let mut number = numbers();
        let w = lanes(|_| number());
        let vectors = Vectors::of(from_fn(|_| DVec3::new(number(), number(), number())));
        let fours = vectors.fours(w);
        for (lane, found) in fours.iter().enumerate() {
            assert_eq!(*found, four(vectors.lane(lane), w.to_array()[lane]));
        }
        let (back, numbers) = Vectors::of_fours(fours);
        assert!(numbers == w && back.to_array() == vectors.to_array());
    }

    #[test]
    fn a_block_moves_on_by_a_tick() {
        let (now, next) = (Scalars::new([1.0, 2.0, 3.0, 4.0]), Scalars::new([5.0, 6.0, 7.0, 8.0]));
        assert_eq!(later(now, next).to_array(), [2.0, 3.0, 4.0, 5.0]);
        let signs = Scalars::new([-0.0, 0.0, -3.0, 7.0]);
        assert_eq!(copysign(all(2.0), signs).to_array(), [-2.0, 2.0, -2.0, 2.0]);
    }
}
