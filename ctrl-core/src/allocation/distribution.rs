//! Rotor thrusts of least squares within the limits, for a wrench that the rotors can make.
//!
//! ```text
//! minimise |f|^2   subject to   B f = w,  lower <= f <= upper
//! f(l) = clamp(B^T l),   r(l) = w - B f(l) = 0
//! ```
//!
//! `r` is piecewise linear and monotone in the four multipliers `l`: Newton's method on it, with the Gram
//! matrix of the rotors that are not at a limit, each step as far as the next change of that set, ends after
//! a few steps. The thrusts are continuous in the wrench, unlike the vertices of a linear program.

use glam::{Vec2, Vec3, Vec4};

use super::{Channel, MAX_ROTORS, RotorThrusts};
use crate::list::List;

/// Most Newton steps.
const STEPS: usize = 16;
/// Part of the scaled residual that is left for rounding.
const TOLERANCE: f32 = 2e-6;
/// Weight that keeps the Gram matrix invertible when fewer than four rotors are free.
const REGULARISATION: f32 = 1e-3;
/// How far a step goes beyond the place where a rotor comes to its limit or leaves it, so that the next one
/// finds it there: part of the way, and part of the step.
const BEYOND: (f32, f32) = (1e-3, 1e-4);

/// Thrusts within the limits, and what they leave of a wrench.
pub(super) struct Clamped {
    pub thrusts: RotorThrusts,
    pub residual: Vec4,
}

/// `f(l)` and `r(l)`.
pub(super) fn clamped(channels: &[Channel], w: Vec4, l: Vec4) -> Clamped {
    let thrust = |channel: &Channel| channel.limits.clamp(channel.column.dot(l));
    // wcet: at most MAX_ROTORS iterations
    let thrusts = List::taking(channels.iter().map(thrust));
    let made = |sum: Vec4, (channel, thrust): (&Channel, &f32)| sum + channel.column * *thrust;
    // wcet: at most MAX_ROTORS iterations
    let residual = w - channels.iter().zip(&thrusts).fold(Vec4::ZERO, made);
    Clamped { thrusts, residual }
}

/// The thrusts for the scaled wrench `w`, from the multipliers of the unlimited solution on; always within
/// the limits.
pub(super) fn distribute(
    channels: &List<Channel, MAX_ROTORS>,
    w: Vec4,
    multipliers: Vec4,
) -> RotorThrusts {
    let mut l = multipliers;
    // wcet: at most STEPS iterations
    for _ in 0..STEPS {
        let (residual, gram) = linearised(channels, w, l);
        if residual.abs().max_element() <= TOLERANCE * (1.0 + w.x.abs()) {
            break;
        }
        let step = gram.solve(residual);
        l += step * length(channels, l, step);
    }
    clamped(channels, w, l).thrusts
}

/// `r(l)` and the Gram matrix of the free rotors.
fn linearised(channels: &[Channel], w: Vec4, l: Vec4) -> (Vec4, Gram) {
    let (mut residual, mut gram) = (w, Gram::REGULARISED);
    // wcet: at most MAX_ROTORS iterations
    for Channel { column, limits, .. } in channels {
        let wanted = column.dot(l);
        let thrust = limits.clamp(wanted);
        residual -= *column * thrust;
        if thrust == wanted {
            gram.add(*column);
        }
    }
    (residual, gram)
}

/// A symmetric, positive definite matrix by the columns of its lower triangle.
struct Gram {
    x: Vec4,
    y: Vec3,
    z: Vec2,
    w: f32,
}

impl Gram {
    const REGULARISED: Self = Self {
        x: Vec4::new(REGULARISATION, 0.0, 0.0, 0.0),
        y: Vec3::new(REGULARISATION, 0.0, 0.0),
        z: Vec2::new(REGULARISATION, 0.0),
        w: REGULARISATION,
    };

    /// Adds `v v^T`.
    fn add(&mut self, v: Vec4) {
        self.x += v * v.x;
        self.y += Vec3::new(v.y, v.z, v.w) * v.y;
        self.z += Vec2::new(v.z, v.w) * v.z;
        self.w += v.w * v.w;
    }

    /// Solves by `L D L^T`; every pivot is at least the regularisation.
    fn solve(&self, b: Vec4) -> Vec4 {
        let Self { x, y, z, w } = self;
        let dx = 1.0 / x.x;
        let lx = Vec3::new(x.y, x.z, x.w) * dx;
        let y = *y - lx * x.y;
        let dy = 1.0 / y.x;
        let ly = Vec2::new(y.y, y.z) * dy;
        let z = *z - Vec2::new(lx.y, lx.z) * x.z - ly * y.y;
        let dz = 1.0 / z.x;
        let lz = z.y * dz;
        let w = w - lx.z * x.w - ly.y * y.z - lz * z.y;
        let c1 = b.y - lx.x * b.x;
        let c2 = b.z - lx.y * b.x - ly.x * c1;
        let c3 = b.w - lx.z * b.x - ly.y * c1 - lz * c2;
        let s3 = c3 / w;
        let s2 = c2 * dz - lz * s3;
        let s1 = c1 * dy - ly.x * s2 - ly.y * s3;
        Vec4::new(b.x * dx - lx.x * s1 - lx.y * s2 - lx.z * s3, s1, s2, s3)
    }
}

/// Part of `step`, up to 1, after which the next rotor comes to a limit or leaves it.
fn length(channels: &[Channel], l: Vec4, step: Vec4) -> f32 {
    let mut way = f32::MAX;
    // wcet: at most MAX_ROTORS iterations
    for Channel { column, limits, .. } in channels {
        let (wanted, inverse) = (column.dot(l), 1.0 / column.dot(step));
        // wcet: at most 2 iterations
        for limit in [limits.lower, limits.upper] {
            // NaN and infinity, of a rotor that the step does not move, are in neither order.
            let t = (limit - wanted) * inverse;
            if t > 0.0 && t < way {
                way = t;
            }
        }
    }
    (way + way * BEYOND.0 + BEYOND.1).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Mat4;

    #[test]
    fn the_solution_is_that_of_the_inverse() {
        let columns = [
            Vec4::new(1.0, 0.7, -0.7, 1.0),
            Vec4::new(1.0, -0.9, -0.3, -1.0),
            Vec4::new(1.0, -0.5, 0.8, 0.9),
            Vec4::new(1.0, 0.6, 0.7, -1.0),
        ];
        let (mut gram, mut full) =
            (Gram::REGULARISED, Mat4::from_diagonal(Vec4::splat(REGULARISATION)));
        for (count, v) in columns.into_iter().enumerate() {
            gram.add(v);
            full += Mat4::from_cols(v * v.x, v * v.y, v * v.z, v * v.w);
            let expected = Vec4::new(0.3, -1.2, 0.7, 2.0);
            let error = (gram.solve(full * expected) - expected).abs().max_element();
            // One column leaves three directions to the regularisation.
            assert!(error < if count < 3 { 2e-3 } else { 1e-5 }, "{count}: {error}");
        }
    }
}
