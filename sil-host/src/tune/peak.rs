//! Peaks of a linear loop under disturbances that keep their bounds. What may last: the integral of the
//! magnitude of the impulse response times the bound, which no disturbance within the bound exceeds and
//! one that switches sign with the response reaches. What has no mean: five standard deviations under
//! white noise of the step rate.

use std::collections::VecDeque;

use super::hover::{Corner, Hover, Loop, Outputs};
use super::inner::InnerState;
use super::linear::{Matrix, STATES, Vector};
use super::margin::Rotors;
use super::survey::Which;

/// Largest magnitude of each output.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peaks {
    /// Position error along the axis (m).
    pub position: f64,
    /// Angle of `q_e` about the axis (rad).
    pub attitude: f64,
    /// Tilt or turn about the axis (rad).
    pub tilt: f64,
    /// `w_e` about the axis (rad/s).
    pub rate_error: f64,
    /// `G` along the axis (1/s).
    pub g: f64,
}

impl Peaks {
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            position: f(self.position, other.position),
            attitude: f(self.attitude, other.attitude),
            tilt: f(self.tilt, other.tilt),
            rate_error: f(self.rate_error, other.rate_error),
            g: f(self.g, other.g),
        }
    }

    /// The larger of each.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if b.is_nan() || b > a { b } else { a })
    }
}

/// Steps per inverse of the fastest pole.
const RESOLUTION: f64 = 8.0;

/// Time constants of the slowest pole that an impulse response is followed for.
const TAIL: f64 = 10.0;

/// Longest response (steps); a loop with a wider spread of poles is cut off.
const STEPS_MAX: f64 = 2e5;

/// Iterations that bring the slopes of the smooth signs in line with the peaks.
const ITERATIONS: u32 = 40;

/// Standard deviations that noise is taken to reach: beyond, once in two million independent values.
const DEVIATIONS: f64 = 5.0;

/// Steps per time constant of the rotors.
const ROTOR_RESOLUTION: f64 = 8.0;

/// Bounds of the disturbances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disturbances {
    /// Of what may last: acceleration (m/s^2) and torque (N m).
    pub lasting: [f64; 2],
    /// Of uniform noise, drawn anew at every tick: the same.
    pub noise: [f64; 2],
}

/// Peaks of the loop `which` behind `rotors` at the inertias and mass of `corner`.
///
/// The smooth sign of a signal up to `x` acts at least with the slope of its secant there,
/// `1/sqrt(x^2 + delta^2)`. The slopes start at zero signal and fall until they fit the peaks that they
/// lead to.
#[must_use]
pub fn peaks(
    which: Which,
    hover: &Hover,
    corner: &Corner,
    disturbances: &Disturbances,
    rotors: &Rotors,
) -> Peaks {
    let mut corner = Corner { translation_slope: 1.0, rotation_slope: 1.0, ..*corner };
    let mut found = Peaks::default();
    for _ in 0..ITERATIONS {
        found = linear_peaks(&which.at(hover, &corner), hover.dt, disturbances, rotors);
        let secant = |peak: f64, delta: f32| 1.0 / (peak / f64::from(delta)).hypot(1.0);
        let translation = secant(found.g, hover.cascade.delta_min_translation);
        let rotation = secant(found.rate_error, hover.cascade.delta_min_rotation);
        let moved = (corner.translation_slope - translation).abs()
            + (corner.rotation_slope - rotation).abs();
        corner = Corner { translation_slope: translation, rotation_slope: rotation, ..corner };
        if moved < 1e-3 {
            break;
        }
    }
    found
}

fn linear_peaks(of: &Loop, dt: f64, disturbances: &Disturbances, rotors: &Rotors) -> Peaks {
    let poles = of.continuous_poles();
    let slowest = poles.iter().map(|pole| -pole.re).fold(f64::INFINITY, f64::min);
    let fastest = poles.iter().map(|pole| pole.modulus()).fold(0.0, f64::max);
    if slowest.is_nan() || slowest <= 0.0 {
        return Peaks::default().zip(Peaks::default(), |_, _| f64::INFINITY);
    }
    let mut h = 1.0 / (RESOLUTION * fastest);
    let residual = of.inner.map_or(rotors.lag, |inner| inner.residual_lag);
    for time in [rotors.lag, rotors.delay, residual].into_iter().filter(|&time| time > 0.0) {
        h = h.min(time / ROTOR_RESOLUTION);
    }
    let steps = (TAIL / (slowest * h)).min(STEPS_MAX) as u32;
    let Disturbances { lasting, noise } = *disturbances;
    let mut sum = Peaks::default();
    for ((push, lasting), noise) in of.pushes.into_iter().zip(lasting).zip(noise) {
        if push != Vector::ZERO && lasting + noise > 0.0 {
            let area = if rotors.is_prompt() && of.inner.is_none() {
                impulse_area(&of.continuous, push, &of.outputs, h, steps)
            } else {
                impulse_area_behind(rotors, of, push, h, steps)
            };
            // A uniform value has a third of its bound's square as variance.
            let deviation = |square: f64| noise * (dt / 3.0 * square).sqrt();
            let peak = area.magnitude.zip(area.square, |magnitude, square| {
                lasting * magnitude + DEVIATIONS * deviation(square)
            });
            sum = sum.zip(peak, |sum, peak| sum + peak);
        }
    }
    sum
}

/// Integrals over an impulse response.
#[derive(Clone, Copy, Debug, Default)]
struct Area {
    magnitude: Peaks,
    square: Peaks,
}

/// Integrals of magnitude and square of each output after the impulse `push` (RK4, trapezoids).
fn impulse_area(a: &Matrix, push: Vector, outputs: &Outputs, h: f64, steps: u32) -> Area {
    let advance = rk4(a, h);
    area(outputs, push, h, steps, |x| (advance * x, [0.0; 2]))
}

/// The same with the wrench behind `rotors`: the acceleration of the law passes a delay line and a lag.
fn impulse_area_behind(rotors: &Rotors, of: &Loop, push: Vector, h: f64, steps: u32) -> Area {
    let command = of.command;
    // Without the law: chains of integrators, whose series ends.
    let a = h * (of.continuous - Matrix::outer(of.driven, command));
    let (mut term, mut free, mut mean) = (Matrix::identity(), Matrix::default(), Matrix::default());
    for k in 1..=STATES {
        free = free + term;
        mean = mean + (1.0 / k as f64) * term;
        term = (1.0 / k as f64) * (a * term);
    }
    let driven = h * (mean * of.driven);
    let kept = if rotors.lag > 0.0 { (-h / rotors.lag).exp() } else { 0.0 };
    let late = (rotors.delay / h).round() as usize;
    let mut line = VecDeque::from(vec![0.0; late + 1]);
    let mut acceleration = 0.0;
    let mut within = InnerState::default();
    area(&of.outputs, push, h, steps, |x| {
        let row = command.dot(x);
        let (asked, errors) = match &of.inner {
            None => (row, [0.0; 2]),
            // While the model is right, what acts by it acts.
            Some(inner) => {
                let demand = within.demand(inner, row);
                (within.advance(inner, demand, h), within.errors(inner))
            }
        };
        line.push_back(asked);
        let asked = line.pop_front().unwrap_or_default();
        let mean = if of.inner.is_some() {
            asked
        } else {
            let next = asked + (acceleration - asked) * kept;
            let mean = 0.5 * (acceleration + next);
            acceleration = next;
            mean
        };
        (free * x + mean * driven, errors)
    })
}

/// Integrals over the states that `advance` leads through; with each it gives what comes on top of the attitude's angle and of `w_e`.
fn area(
    outputs: &Outputs,
    push: Vector,
    h: f64,
    steps: u32,
    mut advance: impl FnMut(Vector) -> (Vector, [f64; 2]),
) -> Area {
    let seen = |x: Vector, [turned, turning]: [f64; 2]| Peaks {
        position: outputs.position.dot(x).abs(),
        attitude: (outputs.attitude.dot(x) + turned).abs(),
        tilt: outputs.tilt.dot(x).abs(),
        rate_error: (outputs.rate_error.dot(x) + turning).abs(),
        g: outputs.g.dot(x).abs(),
    };
    let mut x = push;
    let mut area = Area::default();
    let mut before = seen(x, [0.0; 2]);
    for _ in 0..steps {
        let (next, errors) = advance(x);
        x = next;
        let now = seen(x, errors);
        let magnitude = before.zip(now, |a, b| 0.5 * h * (a + b));
        let square = before.zip(now, |a, b| 0.5 * h * (a * a + b * b));
        area.magnitude = area.magnitude.zip(magnitude, |sum, piece| sum + piece);
        area.square = area.square.zip(square, |sum, piece| sum + piece);
        before = now;
    }
    area
}

/// One RK4 step of `x' = A x` as a matrix.
fn rk4(a: &Matrix, h: f64) -> Matrix {
    let a = h * *a;
    let mut sum = Matrix::identity();
    let mut term = sum;
    for k in 1..=4 {
        term = (1.0 / f64::from(k)) * (a * term);
        sum = sum + term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rotors that are nearly prompt change nothing; slow ones raise the peaks.
    #[test]
    fn areas_behind_rotors_approach_those_without() {
        let command = -1.0 * Vector::unit(0) - 2.0 * Vector::unit(1);
        let mut continuous = Matrix::default();
        (continuous.0[0], continuous.0[1]) = (Vector::unit(1), command);
        let of = Loop {
            order: 2,
            continuous,
            sampled: continuous,
            pushes: [Vector::ZERO; 2],
            outputs: Outputs { position: Vector::unit(0), ..Outputs::default() },
            command,
            driven: Vector::unit(1),
            chain: [(1.0, 2), (1.0, 1), (0.0, 0), (0.0, 0)],
            estimates: [Vector::ZERO; 2],
            inner: None,
            rate: None,
            dt: 1e-3,
        };
        let behind = |lag: f64, delay: f64| {
            let rotors = Rotors { lag, delay };
            impulse_area_behind(&rotors, &of, Vector::unit(1), 0.002, 30_000).magnitude.position
        };
        assert!((behind(0.005, 0.002) - 1.0).abs() < 0.02, "{}", behind(0.005, 0.002));
        // lag s^3 + s^2 + 2 s + 1 with lag 1 rings: the area is larger.
        assert!(behind(1.0, 0.0) > 1.2 && behind(1.0, 0.3) > behind(1.0, 0.0));
    }

    /// `e'' = -2 e' - e + d` is critically damped: its impulse response `t exp(-t)` has area one, and
    /// that of the velocity, `(1 - t) exp(-t)`, has `2/e`.
    #[test]
    fn areas_of_a_known_response() {
        let mut a = Matrix::default();
        (a.0[0], a.0[1]) = (Vector::unit(1), -1.0 * Vector::unit(0) - 2.0 * Vector::unit(1));
        let outputs = Outputs {
            position: Vector::unit(0),
            rate_error: Vector::unit(1),
            ..Outputs::default()
        };
        let area = impulse_area(&a, Vector::unit(1), &outputs, 0.01, 3000);
        assert!((area.magnitude.position - 1.0).abs() < 1e-4, "{area:?}");
        assert!((area.magnitude.rate_error - 2.0 / 1f64.exp()).abs() < 1e-3, "{area:?}");
        // The squares have 1/4 and 1/4.
        assert!((area.square.position - 0.25).abs() < 1e-4, "{area:?}");
        assert!((area.square.rate_error - 0.25).abs() < 1e-2, "{area:?}");
    }
}
