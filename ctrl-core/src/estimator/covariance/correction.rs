//! Correction of the factors by one measured number: Bierman's observational update.
//!
//! Written out column by column: the loops over the triangle of `U` have constant lengths, so that the target
//! executes neither counters nor checks of indices, and holds the gain in registers.

use super::{Covariance, FLOOR, Row, STATES, floored};

/// The innovation's variance and what the update needs beside it.
#[derive(Clone, Copy, Debug)]
pub struct Projection {
    /// `U^T h`.
    f: [f32; STATES],
    /// `h P h^T + r`.
    pub variance: f32,
    /// `r`: variance of the measurement.
    noise: f32,
}

/// Calls a macro for each column in turn.
macro_rules! columns {
    ($each:ident) => {
        $each!(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)
    };
}

impl Covariance {
    /// Innovation of a measurement `row` with variance `noise`.
    #[inline(never)]
    #[must_use]
    pub fn project(&self, row: &Row, noise: f32) -> Projection {
        let noise = floored(noise);
        // One instance for each kind of row: what is constant in it is constant in the code.
        match *row {
            Row::Barometer { .. } => self.projection(noise, row),
            Row::Position { .. } => self.projection(noise, row),
            Row::Velocity(_) => self.projection(noise, row),
            Row::PastVelocity { .. } => self.projection(noise, row),
            Row::Attitude(_) => self.projection(noise, row),
            Row::Range { .. } => self.projection(noise, row),
            Row::Flow { .. } => self.projection(noise, row),
        }
    }

    #[inline(always)]
    fn projection(&self, noise: f32, row: &Row) -> Projection {
        let mut f = [0.0; STATES];
        let mut variance = noise;
        macro_rules! each {
            ($($j:literal),*) => {$(
                f[$j] = row.of_column($j, &self.u[$j]);
                variance += f[$j] * f[$j] * self.d[$j];
            )*};
        }
        columns!(each);
        Projection { f, variance, noise }
    }

    /// Takes the measurement in; returns the gain `K`.
    #[inline(never)]
    pub fn correct(&mut self, projection: &Projection) -> [f32; STATES] {
        let noise = projection.noise;
        let mut update = Update { gain: [0.0; STATES], alpha: noise, inverse: 1.0 / noise };
        macro_rules! each {
            ($($j:literal),*) => {$(
                update.column::<$j>(&mut self.u[$j], &mut self.d[$j], projection.f[$j]);
            )*};
        }
        columns!(each);
        let inverse = update.inverse;
        update.gain.map(|k| k * inverse)
    }
}

/// The update in progress.
struct Update {
    /// `K alpha` of the columns so far.
    gain: [f32; STATES],
    alpha: f32,
    inverse: f32,
}

impl Update {
    #[inline(always)]
    fn column<const J: usize>(&mut self, column: &mut [f32; STATES], d: &mut f32, f: f32) {
        let g = *d * f;
        let lambda = -f * self.inverse;
        // wcet: at most 16 iterations
        for (u, k) in column.iter_mut().zip(&mut self.gain).take(J) {
            let old = *u;
            *u = old + lambda * *k;
            *k += g * old;
        }
        self.gain[J] = g;
        let next = self.alpha + f * g;
        self.inverse = 1.0 / next;
        let new = *d * self.alpha * self.inverse;
        *d = if new > FLOOR { new } else { FLOOR };
        self.alpha = next;
    }
}
