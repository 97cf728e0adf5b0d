//! Torque activity under noise of the measured body rate: root mean square of the torque that acts and of its change per tick, from
//! the sampled loops at hover. `docs/tune.md` derives it.
//!
//! ```text
//! P_i(z) = coefficient_i Z[1/(s^power_i (1 + s lag))] e^(-i omega delay)    state i per held acceleration
//! L(z)   = -sum row_i F_i P_i,   F_i: the filters for the rate, else one; estimates of integral action: dt/(z - 1) of their rates
//! T(z)   = J row_w F/(1 + L)                                                torque per noise of the rate
//! rms^2  = sigma^2/pi int_0^pi |T H|^2,   H = (1 - p)/(z - p),  p = e^(-dt/lag)
//! ```
//!
//! The smooth sign of `w_e` acts on a normal signal of deviation `s` as the gain `E[h'(w_e)]` and an independent rest of the variance
//! `E[h^2] - (E[h'] s)^2` (statistical linearisation, Booton 1954); `s` follows from the loop that the gain closes.

use core::f64::consts::PI;

use ctrl_core::controller::ControllerConfig;
use ctrl_core::filter::RateFilterConfig;
use glam::DVec3;
use num_complex::Complex64;
use serde::Serialize;

use super::filter::response;
use super::hover::{Corner, Hover, Loop};
use super::margin::Rotors;
use super::survey::nominal;

/// Root mean squares over all three axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Activity {
    /// Of the torque that acts (N m).
    pub torque: f64,
    /// Of its change from one tick to the next (N m).
    pub change: f64,
    /// Of the torque about each axis (N m).
    pub axes: DVec3,
}

/// Points per factor e of frequency, and how far below the slowest pole they begin.
const POINTS_PER_FACTOR: f64 = 150.0;
const FACTORS_BELOW: f64 = 7.0;

/// Rounds that bring the gain of the smooth sign in line with the signal in it.
const ROUNDS: u32 = 8;

/// Predicted activity of `law` on its nominal vehicle, when white noise of the deviation `rate_noise` (rad/s) is added to each component
/// of the rate at every tick.
#[must_use]
pub fn activity(
    law: &ControllerConfig,
    rate_noise: f64,
    rotors: &Rotors,
    filter: &RateFilterConfig,
) -> Activity {
    let hover = Hover::new(law);
    let squares = [0, 1, 2].map(|axis| about(axis, law, &hover, rate_noise, (rotors, filter)));
    let [torque, change] = [0, 1].map(|k| DVec3::from(squares.map(|of_axis| of_axis[k])));
    Activity {
        torque: torque.element_sum().sqrt(),
        change: change.element_sum().sqrt(),
        axes: torque.map(f64::sqrt),
    }
}

/// Mean squares of torque and change about one axis.
fn about(
    axis: usize,
    law: &ControllerConfig,
    hover: &Hover,
    rate_noise: f64,
    path: (&Rotors, &RateFilterConfig),
) -> [f64; 2] {
    let mut corner = nominal(law, axis);
    let width = f64::from(hover.cascade.delta_min_rotation);
    let scale = if hover.saturated { corner.inertia_estimate } else { 1.0 };
    let sign = scale * hover.rotation_slope()[axis] * width; // torque of the saturated smooth sign
    let mut squares = [0.0; 2];
    for _ in 0..ROUNDS {
        let closed = Closed::new(&looped(axis, hover, &corner), &corner, path);
        let ratio = rate_noise * closed.rate_error.sqrt() / width;
        let (gain, rest) = smooth_sign(ratio);
        let (noise, rest) = (rate_noise * rate_noise, sign * sign * rest);
        squares = [0, 1].map(|k| noise * closed.of_noise[k] + rest * closed.of_rest[k]);
        corner.rotation_slope = gain;
    }
    squares
}

/// The loop that moves about `axis`.
fn looped(axis: usize, hover: &Hover, corner: &Corner) -> Loop {
    if axis < 2 { hover.lateral(corner, true) } else { hover.attitude(corner, true) }
}

/// `E[h']` as a share of the slope at zero, and the rest's variance, of `h(x) = x/sqrt(x^2 + 1)` under a normal `x` of deviation `s`.
fn smooth_sign(s: f64) -> (f64, f64) {
    // Simpson's rule over eight deviations in the root of the signal: the integrands are narrow where s is large.
    let half = 400;
    let (mut gain, mut square, mut weight) = (0.0, 0.0, 0.0);
    for k in 0..=half {
        let root = f64::from(k) / f64::from(half);
        let xi = 8.0 * root * root;
        let simpson = if k == 0 || k == half { 1.0 } else { 2.0 + 2.0 * f64::from(k % 2) };
        let density = simpson * root * (-0.5 * xi * xi).exp();
        let x2 = s * s * xi * xi;
        gain += density * (1.0 + x2).powf(-1.5);
        square += density * x2 / (1.0 + x2);
        weight += density;
    }
    let (gain, square) = (gain / weight, square / weight);
    (gain, (square - (gain * s).powi(2)).max(0.0))
}

/// Mean squares of the closed loop per unit of white noise, drawn at every tick.
#[derive(Clone, Copy, Debug, Default)]
struct Closed {
    /// Torque that acts and its change, of noise of the rate.
    of_noise: [f64; 2],
    /// The same of a torque added to the command.
    of_rest: [f64; 2],
    /// `w_e` as the law computes it, of noise of the rate.
    rate_error: f64,
}

impl Closed {
    fn new(of: &Loop, corner: &Corner, (rotors, filter): (&Rotors, &RateFilterConfig)) -> Self {
        let poles = of.continuous_poles();
        let slowest = poles.iter().map(|pole| pole.modulus()).fold(f64::INFINITY, f64::min);
        let from = (slowest * of.dt).min(1.0) * (-FACTORS_BELOW).exp();
        let count = (POINTS_PER_FACTOR * (PI / from).ln()).ceil();
        let step = (PI / from).ln() / count;
        let mut sum = Self::default();
        for k in 0..=count as u32 {
            let theta = from * (step * f64::from(k)).exp();
            let end = if k == 0 || f64::from(k) == count { 0.5 } else { 1.0 };
            // (1/pi) times the measure in the logarithm of the frequency.
            let weight = end * step * theta / PI;
            sum.add(weight, &Spectrum::at(theta, of, corner, rotors, filter));
        }
        sum
    }

    fn add(&mut self, weight: f64, at: &Spectrum) {
        for (sum, gain) in [(&mut self.of_noise, at.noise), (&mut self.of_rest, at.rest)] {
            sum[0] += weight * gain.norm_sqr();
            sum[1] += weight * (gain * at.difference).norm_sqr();
        }
        self.rate_error += weight * at.rate_error.norm_sqr();
    }
}

/// Gains at one frequency.
struct Spectrum {
    noise: Complex64,
    rest: Complex64,
    rate_error: Complex64,
    /// `1 - 1/z`.
    difference: Complex64,
}

impl Spectrum {
    fn at(
        theta: f64,
        of: &Loop,
        corner: &Corner,
        rotors: &Rotors,
        filter: &RateFilterConfig,
    ) -> Self {
        let z = Complex64::from_polar(1.0, theta);
        let omega = theta / of.dt;
        let filtered = response(filter, omega, of.dt);
        let rate = of.rate.unwrap_or(0);
        let integrator = of.dt / (z - 1.0);
        let s = Complex64::new(0.0, omega);
        // While the model is right the lead leaves its residual lag of the rotors'.
        let lag = of.inner.map_or(rotors.lag, |inner| inner.residual_lag);
        let (within, of_auxiliary) = of.inner.map_or_else(Default::default, |inner| {
            (inner.missing(s) * inner.auxiliary(s), inner.rate_error(s))
        });
        let mut measured = states(z, of, lag, rotors.delay);
        measured[rate] *= filtered;
        let mut noise = [Complex64::default(); 4];
        noise[rate] = filtered;
        let [states, noise] = [measured, noise].map(|chain| of.responses(chain, integrator));
        let sensitivity = (1.0 + within - of.command.through(&states)).inv();
        let acceleration = of.command.through(&noise) * sensitivity;
        let acting = match lag {
            0.0 => Complex64::new(1.0, 0.0),
            lag => first_order(z, of.dt, lag),
        };
        Self {
            noise: corner.inertia * acceleration * acting,
            rest: sensitivity * acting,
            rate_error: of.outputs.rate_error.through(&noise)
                + (of.outputs.rate_error.through(&states) + of_auxiliary) * acceleration,
            difference: 1.0 - z.inv(),
        }
    }
}

/// `Z[1/(1 + s lag)]` held over `dt`.
fn first_order(z: Complex64, dt: f64, lag: f64) -> Complex64 {
    let p = (-dt / lag).exp();
    (1.0 - p) / (z - p)
}

/// Each state of the chain per commanded acceleration that is held over a step, behind the rotors.
fn states(z: Complex64, of: &Loop, lag: f64, delay: f64) -> [Complex64; 4] {
    let (dt, w) = (of.dt, z - 1.0);
    // Sampled integrators of first to fourth order behind a hold.
    let integrators = [
        dt / w,
        dt.powi(2) * (z + 1.0) / (2.0 * w.powi(2)),
        dt.powi(3) * (z * z + 4.0 * z + 1.0) / (6.0 * w.powi(3)),
        dt.powi(4) * (z.powi(3) + 11.0 * z * z + 11.0 * z + 1.0) / (24.0 * w.powi(4)),
    ];
    let delay = Complex64::from_polar(1.0, -z.arg() / dt * delay);
    of.chain.map(|(coefficient, power)| {
        if power == 0 {
            return Complex64::default();
        }
        let chain = if lag == 0.0 {
            integrators[power as usize - 1]
        } else {
            // 1/(s^n (1 + s T)) = sum (-T)^(n - k)/s^k + (-T)^n/(1 + s T)
            let minus = -lag;
            let parts = (1..=power).map(|k| minus.powi(power - k) * integrators[k as usize - 1]);
            parts.sum::<Complex64>() + minus.powi(power) * first_order(z, dt, lag)
        };
        coefficient * chain * delay
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smooth_sign_has_the_gain_and_the_rest_of_its_limits() {
        let (gain, rest) = smooth_sign(1e-3);
        assert!((gain - 1.0).abs() < 1e-5 && rest < 1e-11, "{gain}, {rest}");
        // A sign: E[h'] = sqrt(2/pi)/s, and E[h^2] = 1 of which 2/pi is the linear part.
        let (gain, rest) = smooth_sign(60.0);
        assert!((gain * 60.0 / (2.0 / PI).sqrt() - 1.0).abs() < 0.02, "{gain}");
        assert!((rest - (1.0 - 2.0 / PI)).abs() < 0.04, "{rest}");
    }

    /// `w' = -k (w + n)`, sampled: a first-order loop whose variances have a closed form.
    #[test]
    fn a_first_order_loop_has_the_variances_of_the_closed_form() {
        use crate::tune::hover::Outputs;
        use crate::tune::linear::{Matrix, Vector};
        let (k, dt, inertia) = (30.0, 1e-3, 0.02);
        let row = -k * Vector::unit(0);
        let mut rows = Matrix::default();
        rows.0[0] = row;
        let of = Loop {
            order: 1,
            continuous: rows,
            sampled: rows,
            pushes: [Vector::ZERO; 2],
            outputs: Outputs { rate_error: Vector::unit(0), ..Outputs::default() },
            command: row,
            driven: Vector::unit(0),
            chain: [(1.0, 1), (0.0, 0), (0.0, 0), (0.0, 0)],
            estimates: [Vector::ZERO; 2],
            inner: None,
            rate: Some(0),
            dt,
        };
        let corner = Corner {
            axis: 0,
            mass: 1.0,
            inertia,
            inertia_estimate: inertia,
            translation_slope: 1.0,
            rotation_slope: 1.0,
        };
        let none = RateFilterConfig::default();
        let closed = Closed::new(&of, &corner, (&Rotors::default(), &none));
        // w_(k+1) = (1 - a) w_k - a n_k: variance a/(2 - a); what is seen adds one, and the torque is J k of it.
        let a = k * dt;
        let seen = 1.0 + a / (2.0 - a);
        let torque = (inertia * k).powi(2) * seen;
        assert!((closed.rate_error / seen - 1.0).abs() < 1e-3, "{closed:?}, {seen}");
        assert!((closed.of_noise[0] / torque - 1.0).abs() < 1e-3, "{closed:?}, {torque}");
        // y = w + n has the correlation -a/(2 - a) (1 - a) ... at one tick: E[(y' - y)^2] = 2 (R0 - R1).
        let next = (1.0 - a) * a / (2.0 - a) - a;
        let change = (inertia * k).powi(2) * 2.0 * (seen - next);
        assert!((closed.of_noise[1] / change - 1.0).abs() < 2e-3, "{closed:?}, {change}");
    }
}
