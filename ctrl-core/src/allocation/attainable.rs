//! The wrenches that rotors within their limits can make.
//!
//! With thrusts `f_i` in their intervals, `sum b_i f_i` fills a zonotope. Each of its facets is parallel to
//! as many columns `b_i` as its dimension less one: normals are the generalised cross products of all
//! such choices, and the zonotope is the intersection of the slabs
//!
//! ```text
//! lower(n) <= n . w <= upper(n),   upper(n) = sum_i max(n . b_i f_i,lower, n . b_i f_i,upper)
//! ```
//!
//! Projected on fewer axes it is again one, of the projected columns. So each question (how much of a
//! torque beside any thrust, which thrusts beside a torque) is one pass over at most 56 slabs.

use glam::{Mat3, Vec3, Vec4};

use super::Channel;
use crate::list::List;
use crate::sqrt::sqrt;
use crate::vehicle::Interval;

/// Most slabs of a vehicle with `rotors` rotors, of all axes and of both projections: choices of three, of two
/// and of one of the columns.
#[must_use]
pub const fn slabs(rotors: usize) -> usize {
    let pairs = rotors * (rotors - 1) / 2;
    rotors + pairs + pairs * (rotors - 2) / 3
}

/// Length of a cross product of columns of size one below which they do not span a facet.
const DEGENERATE: f32 = 1e-4;

/// A column's part along a normal that counts as zero, and the difference of normals that count as one.
const PARALLEL: f32 = 1e-5;

/// Part of a slab's width within which a wrench is at its border, and part of a column along the normal from
/// which on that fixes the rotor.
const BORDER: f32 = 3e-6;
const INFLUENCE: f32 = 2e-3;

/// Two parallel facets with everything between them. Wrenches are scaled (thrust, roll, pitch, yaw).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Slab {
    normal: Vec4,
    range: Interval,
}

/// The zonotope of all four axes and its two projections that the priorities ask for.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Attainable<const SLABS: usize> {
    slabs: List<Slab, SLABS>,
    /// Numbers of slabs before those of roll, pitch and yaw, and before those of all axes.
    torque: u8,
    wrench: u8,
}

impl<const SLABS: usize> Attainable<SLABS> {
    /// No slab.
    pub fn new() -> Self {
        Self { slabs: List::new(), torque: 0, wrench: 0 }
    }

    /// Adds the slabs of rotors with scaled columns to none; the number that found no room.
    pub fn fill(&mut self, channels: &[Channel]) -> u16 {
        let (slabs, mut left) = (&mut self.slabs, 0);
        for a in channels {
            let across = Vec4::new(0.0, -a.column.z, a.column.y, 0.0);
            left += add(slabs, 0, across, channels);
        }
        self.torque = slabs.len() as u8;
        for (i, a) in channels.iter().enumerate() {
            for b in channels.iter().skip(i + 1) {
                let cross = torque(a).cross(torque(b));
                let normal = Vec4::new(0.0, cross.x, cross.y, cross.z);
                left += add(slabs, self.torque.into(), normal, channels);
            }
        }
        self.wrench = slabs.len() as u8;
        for (i, a) in channels.iter().enumerate() {
            for (j, b) in channels.iter().enumerate().skip(i + 1) {
                for c in channels.iter().skip(j + 1) {
                    let normal = cross4(a.column, b.column, c.column);
                    left += add(slabs, self.wrench.into(), normal, channels);
                }
            }
        }
        left
    }

    /// Ranges of the same slabs for other channels, whose columns are among those of before. A zonotope without
    /// some of its columns is within fewer slabs of them; the others only touch it.
    pub fn follow(&mut self, channels: &[Channel]) {
        // wcet: at most SLABS iterations
        for slab in &mut self.slabs {
            slab.range = range(slab.normal, channels);
        }
    }

    /// Roll and pitch beside any thrust and any yaw torque.
    pub fn tilt(&self) -> &[Slab] {
        self.slabs.get(..usize::from(self.torque)).unwrap_or(&[])
    }

    /// Roll, pitch and yaw beside any thrust.
    pub fn torque(&self) -> &[Slab] {
        self.slabs.get(usize::from(self.torque)..usize::from(self.wrench)).unwrap_or(&[])
    }

    /// All axes.
    pub fn wrench(&self) -> &[Slab] {
        self.slabs.get(usize::from(self.wrench)..).unwrap_or(&[])
    }
}

/// The interval of `t` for which `from + t direction` lies in all `slabs`; its ends are in the wrong order,
/// by rounding or by more, if there is none.
#[inline(never)]
pub(super) fn reach(slabs: &[Slab], from: Vec4, direction: Vec4) -> Interval {
    let mut reach = Interval { lower: f32::MIN, upper: f32::MAX };
    // wcet: at most SLABS iterations
    for Slab { normal, range } in slabs {
        let (slope, at) = (normal.dot(direction), normal.dot(from));
        // Parallel to the slab; `0/0` would be NaN.
        if slope.abs() > f32::MIN_POSITIVE {
            let (a, b) = ((range.lower - at) / slope, (range.upper - at) / slope);
            let (a, b) = if slope > 0.0 { (a, b) } else { (b, a) };
            reach.lower = if a > reach.lower { a } else { reach.lower };
            reach.upper = if b < reach.upper { b } else { reach.upper };
        }
    }
    reach
}

/// The largest `t` for which `from + t direction` lies in all `slabs`, and its derivative by a move of `from`
/// along `across`.
#[inline(never)]
pub(super) fn farthest(slabs: &[Slab], from: Vec4, direction: Vec4, across: Vec4) -> (f32, f32) {
    let (mut farthest, mut derivative) = (f32::MAX, 0.0);
    // wcet: at most WRENCH_SLABS iterations
    for Slab { normal, range } in slabs {
        let slope = normal.dot(direction);
        if slope.abs() > f32::MIN_POSITIVE {
            let end = if slope > 0.0 { range.upper } else { range.lower };
            let t = (end - normal.dot(from)) / slope;
            if t < farthest {
                (farthest, derivative) = (t, -normal.dot(across) / slope);
            }
        }
    }
    (farthest, derivative)
}

/// `true` if `w` lies in all `slabs`.
pub(super) fn contains(slabs: &[Slab], w: Vec4) -> bool {
    // wcet: at most WRENCH_SLABS iterations
    slabs.iter().all(|slab| slab.range.contains(slab.normal.dot(w)))
}

/// Closes the limits of the rotors that a wrench at the border leaves no choice: with the slack
/// `s = upper(n) - n . w`, a rotor with `n . b_i > 0` is at most `s/(n . b_i)` below its upper limit.
#[inline(never)]
pub(super) fn close(slabs: &[Slab], w: Vec4, channels: &mut [Channel]) {
    // wcet: at most WRENCH_SLABS iterations
    for Slab { normal, range } in slabs {
        let (at, width) = (normal.dot(w), range.upper - range.lower);
        let (slack, side) = if range.upper - at < at - range.lower {
            (range.upper - at, 1.0)
        } else {
            (at - range.lower, -1.0)
        };
        if slack > BORDER * width {
            continue;
        }
        // wcet: at most MAX_ROTORS iterations
        for Channel { column, limits, .. } in &mut *channels {
            let part = side * normal.dot(*column);
            if part > INFLUENCE {
                limits.lower = limits.upper;
            } else if part < -INFLUENCE {
                limits.upper = limits.lower;
            }
        }
    }
}

fn torque(channel: &Channel) -> Vec3 {
    let column = channel.column;
    Vec3::new(column.y, column.z, column.w)
}

/// A vector perpendicular to three.
fn cross4(a: Vec4, b: Vec4, c: Vec4) -> Vec4 {
    let minor = |pick: fn(Vec4) -> Vec3| Mat3::from_cols(pick(a), pick(b), pick(c)).determinant();
    Vec4::new(
        minor(|v| Vec3::new(v.y, v.z, v.w)),
        -minor(|v| Vec3::new(v.x, v.z, v.w)),
        minor(|v| Vec3::new(v.x, v.y, v.w)),
        -minor(|v| Vec3::new(v.x, v.y, v.z)),
    )
}

/// Adds the slab with this normal, unless it is none or there already from `start` on; one if there is no
/// room.
fn add<const N: usize>(
    slabs: &mut List<Slab, N>,
    start: usize,
    normal: Vec4,
    channels: &[Channel],
) -> u16 {
    if normal.length_squared() < DEGENERATE * DEGENERATE {
        return 0;
    }
    let part = |channel: &Channel| normal.dot(channel.column);
    let largest = channels.iter().map(|channel| part(channel).abs()).fold(0.0, f32::max);
    if largest < DEGENERATE * sqrt(normal.length_squared()) {
        return 0;
    }
    let normal = normal / largest;
    // What is zero but for rounding must not divide.
    let normal = Vec4::select(normal.abs().cmplt(Vec4::splat(PARALLEL)), Vec4::ZERO, normal);
    let known = |slab: &Slab| same(slab.normal, normal) || same(slab.normal, -normal);
    if slabs.iter().skip(start).any(known) {
        return 0;
    }
    slabs.push(Slab { normal, range: range(normal, channels) }).is_err().into()
}

/// What the rotors make along a normal.
fn range(normal: Vec4, channels: &[Channel]) -> Interval {
    let mut range = Interval::default();
    // wcet: at most MAX_ROTORS iterations
    for channel in channels {
        let part = normal.dot(channel.column);
        let (a, b) = (part * channel.limits.lower, part * channel.limits.upper);
        if part > PARALLEL {
            (range.lower, range.upper) = (range.lower + a, range.upper + b);
        } else if part < -PARALLEL {
            (range.lower, range.upper) = (range.lower + b, range.upper + a);
        }
    }
    range
}

fn same(a: Vec4, b: Vec4) -> bool {
    (a - b).abs().max_element() < PARALLEL
}
