//! Stability margins of the loops at hover, opened at the wrench: rotors that lag, a delay, and the hold of
//! one step. `docs/tune.md` derives them.
//!
//! ```text
//! L(s) = -row . [coefficient_i/s^power_i]        the law's row over the chain of integrators and the estimates
//! D(s) = exp(-s (dt/2 + delay))/(1 + s lag)
//! ```
//! Filters of the rate multiply what goes through the rate by `F(e^(s dt))`.
//! The loop without rotors is stable at every corner (its poles are surveyed). With them it stays stable
//! as long as `1 + L D` does not meet zero on the imaginary axis while filters, delay and lag grow from nothing.

use core::f64::consts::{PI, TAU};

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::filter;
use super::hover::{Corner, Hover, Loop};
use super::inner::InnerLoop;
use super::survey::{Which, corners, nominal};
use ctrl_core::controller::ControllerConfig;
use ctrl_core::filter::RateFilterConfig;

/// Rotors between command and wrench.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Rotors {
    /// Time constant of thrust and torque (s).
    pub lag: f64,
    /// Delay of the command (s).
    pub delay: f64,
}

impl Rotors {
    /// `true` if a command acts at once.
    #[must_use]
    pub fn is_prompt(&self) -> bool {
        self.lag == 0.0 && self.delay == 0.0
    }
}

/// Margins of one loop, the least over the corners of the uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Margins {
    /// Loop.
    pub which: Which,
    /// Factor by which the loop's gain may grow.
    pub gain: f64,
    /// Phase that may be lost (rad); zero or less when the loop with the rotors is unstable.
    pub phase: f64,
    /// Delay that may come on top (s).
    pub delay: f64,
    /// Largest time constant of the rotors with this delay (s).
    pub lag: f64,
}

/// Frequencies per decade of the scan, and its ends relative to the smallest and the largest of the
/// bandwidths; crossings between two of them are found by bisection.
const PER_DECADE: f64 = 60.0;
const DECADES_BELOW: f64 = 2.0;

/// Margins of every loop of `law` behind `rotors`, with its rate behind `filter`.
#[must_use]
pub fn margins(law: &ControllerConfig, rotors: &Rotors, filter: &RateFilterConfig) -> Vec<Margins> {
    // The adaptation of the mass is not behind the rotors.
    let loops = Which::of(law).into_iter().filter(|&it| it != Which::VerticalAdaptive);
    loops.map(|which| of_loop(which, law, rotors, filter)).collect()
}

/// Margins of one loop of `law` at `corner` behind `rotors`.
#[must_use]
pub fn margins_at(
    which: Which,
    hover: &Hover,
    corner: &Corner,
    rotors: &Rotors,
    filter: &RateFilterConfig,
) -> Margins {
    let (of, filter) = (which.at(hover, corner), *filter);
    OpenLoop { of, hold: 0.5 * hover.dt, filter }.margins(which, rotors)
}

/// Margins of one loop of `law` over its corners.
pub(super) fn of_loop(
    which: Which,
    law: &ControllerConfig,
    rotors: &Rotors,
    filter: &RateFilterConfig,
) -> Margins {
    let hover = Hover::new(law);
    let worst =
        Margins { which, gain: f64::INFINITY, phase: PI, delay: f64::INFINITY, lag: f64::INFINITY };
    corners(which, &hover, &nominal(law, which.axes()[0])).iter().fold(
        worst,
        |worst, corner: &Corner| {
            let found = margins_at(which, &hover, corner, rotors, filter);
            Margins {
                which,
                gain: worst.gain.min(found.gain),
                phase: worst.phase.min(found.phase),
                delay: worst.delay.min(found.delay),
                lag: worst.lag.min(found.lag),
            }
        },
    )
}

/// A loop opened at its wrench.
struct OpenLoop {
    of: Loop,
    /// Half a step: the delay of a wrench that is held (s).
    hold: f64,
    /// Filters of the rate.
    filter: RateFilterConfig,
}

impl OpenLoop {
    /// `L(i omega)`.
    fn response(&self, omega: f64) -> Complex64 {
        let [others, rate] = self.parts(omega);
        if self.filter.is_empty() {
            return others + rate;
        }
        others + rate * filter::response(&self.filter, omega, 2.0 * self.hold)
    }

    /// `L(i omega)` without filters: what goes through the rate about the axis comes last, its part of the estimates
    /// included.
    fn parts(&self, omega: f64) -> [Complex64; 2] {
        let s = Complex64::new(0.0, omega);
        [false, true].map(|of_rate| {
            let chain = core::array::from_fn(|i| {
                let (coefficient, power) = self.of.chain[i];
                let taken = power > 0 && of_rate == (self.of.rate == Some(i));
                if taken { coefficient / s.powi(power) } else { Complex64::default() }
            });
            -self.of.command.through(&self.of.responses(chain, s.inv()))
        })
    }

    /// `L (i omega)` behind the hold and a delay (s).
    fn delayed(&self, delay: f64, omega: f64) -> Complex64 {
        self.response(omega) * Complex64::from_polar(1.0, -omega * (self.hold + delay))
    }

    /// `L D (i omega)` behind `rotors`; with a model of them inside the law `L D/(1 + P H)`, `D` with the lead.
    fn behind(&self, rotors: &Rotors, omega: f64) -> Complex64 {
        let delayed = self.delayed(rotors.delay, omega);
        let lagging = delayed / Complex64::new(1.0, omega * rotors.lag);
        let Some(inner) = &self.of.inner else { return lagging };
        let s = Complex64::new(0.0, omega);
        let lead = (1.0 + s * inner.lag) / (1.0 + s * inner.residual_lag);
        lagging * lead / (1.0 + inner.missing(s) * inner.auxiliary(s))
    }

    fn margins(&self, which: Which, rotors: &Rotors) -> Margins {
        let grid = self.grid();
        let lag = self.largest_lag(&grid, rotors.delay);
        let stable = rotors.lag < lag;
        let (mut gain, mut phase, mut delay) = (f64::INFINITY, PI, f64::INFINITY);
        let at = |omega: f64| self.behind(rotors, omega);
        for omega in crossings(&grid, |omega| at(omega).norm().ln()) {
            let lead = (at(omega).arg() + PI).rem_euclid(TAU); // down to -180 degrees
            phase = phase.min(lead.min(TAU - lead));
            delay = delay.min(lead / omega);
        }
        for omega in crossings(&grid, |omega| (-at(omega)).arg()) {
            let response = at(omega);
            if response.norm() < 1.0 {
                gain = gain.min(1.0 / response.norm());
            }
        }
        if stable {
            Margins { which, gain, phase, delay, lag }
        } else {
            Margins { which, gain: 1.0, phase: -phase, delay: 0.0, lag }
        }
    }

    /// Largest time constant with which the loop is stable (s).
    fn largest_lag(&self, grid: &[f64], delay: f64) -> f64 {
        if !(self.survives_filter(grid) && self.survives_delay(grid, delay)) {
            return 0.0;
        }
        if let Some(inner) = &self.of.inner {
            return self.largest_lag_behind_model(grid, delay, inner);
        }
        // On the border |L| = |1 + i omega lag|, which gives the lag, and the phase is -180 degrees.
        let lag = |omega: f64| {
            let square = self.response(omega).norm_sqr() - 1.0;
            (square > 0.0).then(|| square.sqrt() / omega)
        };
        let turned = |omega: f64| {
            let lag = lag(omega)?;
            Some(-self.behind(&Rotors { lag, delay }, omega))
        };
        let phase = |omega: f64| turned(omega).map_or(f64::NAN, |it| it.arg());
        let found = crossings(grid, phase).into_iter().filter(|&omega| phase(omega).abs() < 0.5);
        found.filter_map(lag).fold(f64::INFINITY, f64::min)
    }

    /// The same with the model `inner` in the law. From no lag on the model grows with the rotors, in the share `T_f/T`; on the border
    /// `1 + P H + L D = 0` gives a real `T_f`. From there on the rotors' lag grows beyond the model's.
    fn largest_lag_behind_model(&self, grid: &[f64], delay: f64, inner: &InnerLoop) -> f64 {
        let residual = |omega: f64| {
            let s = Complex64::new(0.0, omega);
            -(1.0 + self.delayed(delay, omega)) / (s * (1.0 + inner.auxiliary(s)))
        };
        let lag = |omega: f64| {
            let s = Complex64::new(0.0, omega);
            let modelled = 1.0 + s * inner.residual_lag * (1.0 + inner.auxiliary(s));
            let led = self.delayed(delay, omega) * (1.0 + s * inner.lag);
            -(modelled + led) / (s * modelled)
        };
        let borders = |of: &dyn Fn(f64) -> Complex64, beyond: f64| {
            let found = real_values(grid, of);
            found.into_iter().filter(|it| *it > beyond).fold(f64::INFINITY, f64::min)
        };
        if borders(&residual, 0.0) <= inner.residual_lag {
            return 0.0;
        }
        borders(&lag, inner.lag)
    }

    /// `true` if the loop is stable with the filters, without hold and rotors: `1 + L` meets zero for no share
    /// of `F - 1` between none and all of it.
    fn survives_filter(&self, grid: &[f64]) -> bool {
        if self.filter.is_empty() {
            return true;
        }
        let share = |omega: f64| {
            let [others, rate] = self.parts(omega);
            let filtered = filter::response(&self.filter, omega, 2.0 * self.hold) - 1.0;
            -(1.0 + others + rate) / (rate * filtered)
        };
        let met = |omega: &f64| (0.0..=1.0).contains(&share(*omega).re);
        !crossings(grid, |omega| share(omega).im).iter().any(met)
    }

    /// `true` if the loop is stable with the hold and this delay, without lag.
    fn survives_delay(&self, grid: &[f64], delay: f64) -> bool {
        let at = |omega: f64| self.delayed(0.0, omega);
        let crossovers = crossings(grid, |omega| at(omega).norm().ln());
        crossovers.into_iter().all(|omega| {
            let lead = (at(omega).arg() + PI).rem_euclid(TAU);
            lead > omega * delay
        })
    }

    /// Frequencies from far below the slowest pole up to the highest that a step can follow (rad/s).
    fn grid(&self) -> Vec<f64> {
        let poles = self.of.continuous_poles();
        let slowest = poles.iter().map(|pole| pole.modulus()).fold(f64::INFINITY, f64::min);
        let (from, to) = (slowest * 10f64.powf(-DECADES_BELOW), PI / (2.0 * self.hold));
        let count = (PER_DECADE * (to / from).log10()).ceil().max(1.0) as usize;
        (0..=count).map(|i| from * (to / from).powf(i as f64 / count as f64)).collect()
    }
}

/// Real values that `value` takes on the way.
fn real_values(grid: &[f64], value: &dyn Fn(f64) -> Complex64) -> Vec<f64> {
    // Against its own size: values grow without bound towards low frequencies.
    let turned = |omega: f64| {
        let it = value(omega);
        it.im / it.norm()
    };
    crossings(grid, turned).into_iter().map(|omega| value(omega).re).collect()
}

/// Places where `value` changes its sign without a jump, by bisection.
fn crossings(grid: &[f64], value: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut found = Vec::new();
    for pair in grid.windows(2) {
        let (mut left, mut right) = (pair[0], pair[1]);
        let (at_left, at_right) = (value(left), value(right));
        let changes = at_left * at_right < 0.0; // not where one is not a number
        let wraps = (at_left - at_right).abs() > PI;
        if !changes || wraps {
            continue;
        }
        for _ in 0..60 {
            let middle = 0.5 * (left + right);
            if value(middle) * at_left > 0.0 { left = middle } else { right = middle }
        }
        found.push(0.5 * (left + right));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tune::hover::Outputs;
    use crate::tune::linear::{Matrix, Vector};

    /// `L = k/s^2 + d/s`: a mass with a spring and a damper.
    fn oscillator(k: f64, d: f64, hold: f64) -> OpenLoop {
        let row = -k * Vector::unit(0) - d * Vector::unit(1);
        let mut continuous = Matrix::default();
        (continuous.0[0], continuous.0[1]) = (Vector::unit(1), row);
        let of = Loop {
            order: 2,
            continuous,
            sampled: continuous,
            pushes: [Vector::ZERO; 2],
            outputs: Outputs::default(),
            command: row,
            driven: Vector::unit(1),
            chain: [(1.0, 2), (1.0, 1), (0.0, 0), (0.0, 0)],
            estimates: [Vector::ZERO; 2],
            inner: None,
            dt: 2.0 * hold,
            rate: None,
        };
        OpenLoop { of, hold, filter: RateFilterConfig::default() }
    }

    #[test]
    fn the_largest_lag_of_an_oscillator_is_that_of_routh_and_hurwitz() {
        // lag s^3 + s^2 + d s + k is stable for d > k lag.
        let found = oscillator(4.0, 2.0, 1e-7).largest_lag(&oscillator(4.0, 2.0, 1e-7).grid(), 0.0);
        assert!((found - 0.5).abs() < 1e-4, "{found}");
    }

    #[test]
    fn phase_and_delay_margin_of_an_oscillator_are_those_of_the_textbook() {
        let (k, d) = (4.0f64, 2.0f64);
        // |L| = 1: w^4 = k^2 + d^2 w^2; the phase above -180 degrees is atan(d w/k).
        let crossover = (0.5 * (d * d + (d.powi(4) + 4.0 * k * k).sqrt())).sqrt();
        let phase = (d * crossover / k).atan();
        let found = oscillator(k, d, 1e-7).margins(Which::Attitude, &Rotors::default());
        assert!((found.phase - phase).abs() < 1e-5, "{found:?} {phase}");
        assert!((found.delay - phase / crossover).abs() < 1e-5, "{found:?}");
        assert!(found.gain > 1e3, "{found:?}");
        // The delay margin is where the phase margin ends.
        let late = Rotors { lag: 0.0, delay: 1.001 * found.delay };
        assert!(oscillator(k, d, 1e-7).margins(Which::Attitude, &late).phase < 0.0);
        let early = Rotors { lag: 0.0, delay: 0.999 * found.delay };
        assert!(oscillator(k, d, 1e-7).margins(Which::Attitude, &early).phase > 0.0);
    }

    #[test]
    fn a_gain_margin_is_where_the_loop_ends() {
        let rotors = Rotors { lag: 0.2, delay: 0.0 };
        let found = oscillator(4.0, 2.0, 1e-7).margins(Which::Attitude, &rotors);
        // (d > k lag holds for every gain): the delay alone ends it.
        assert!(found.gain > 1e3, "{found:?}");
        let rotors = Rotors { lag: 0.1, delay: 0.05 };
        let found = oscillator(4.0, 2.0, 1e-7).margins(Which::Attitude, &rotors);
        let grown = |factor: f64| {
            let factor = factor * found.gain;
            oscillator(4.0 * factor, 2.0 * factor, 1e-7).margins(Which::Attitude, &rotors).phase
        };
        assert!(grown(0.999) > 0.0 && grown(1.001) < 0.0, "{found:?}");
    }
}
