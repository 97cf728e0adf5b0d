//! A push that lasts, at its bounds and at once: the predicted time until integral action has it.

use super::hover::{Corner, Hover, Loop};
use super::linear::{Matrix, Vector};
use super::returning::push_held;
use super::steady::Steady;
use super::survey::{Which, corners, nominal};
use ctrl_core::controller::ControllerConfig;
use ctrl_core::vehicle::GRAVITY;

const G: f64 = GRAVITY as f64;

/// Distance from the reference (m) below which a push counts as held.
pub const POSITION_LEFT: f64 = 0.01;

/// Attitude error (rad) below which it does: a tenth of a degree.
pub const ATTITUDE_LEFT: f64 = 0.1 * core::f64::consts::PI / 180.0;

/// Samples of a response per time constant of the fastest pole looked at, and time constants of the slowest that it is
/// followed for.
const RESOLUTION: f64 = 10.0;
const TAIL: f64 = 12.0;
const SAMPLES_MAX: f64 = 20_000.0;

/// Time (s) after which `steady`, which begins at once on both horizontal axes and about all three, leaves less than
/// [`POSITION_LEFT`] and [`ATTITUDE_LEFT`]: the longest of the linear loops over the corners, and of (13), (16)
/// with the estimate along an axis.
#[must_use]
pub fn settling_time(law: &ControllerConfig, steady: &Steady) -> f64 {
    let hover = Hover::new(law);
    let all = [Which::LateralIntegral, Which::HeadingIntegral].map(|which| {
        corners(which, &hover, &nominal(law, which.axes()[0]))
            .into_iter()
            .map(|corner| (which.at(&hover, &corner), corner))
            .collect::<Vec<_>>()
    });
    let poles: Vec<_> = all.iter().flatten().flat_map(|(of, _)| of.continuous_poles()).collect();
    // An estimate that is off has its pole at zero, which is no mode of the push.
    let slowest = poles.iter().map(|pole| -pole.re).filter(|it| *it > 1e-9);
    let slowest = slowest.fold(f64::INFINITY, f64::min);
    let bandwidth = f64::from(law.cascade().k3.max_element());
    let ticks = (1.0 / (RESOLUTION * bandwidth * hover.dt)).round().max(1.0);
    let step = ticks * hover.dt;
    let samples = (TAIL / (slowest * step)).clamp(1.0, SAMPLES_MAX) as usize;
    let [lateral, heading] = all.map(|of_corners| {
        let each = of_corners
            .iter()
            .map(|(of, corner)| errors(of, corner, &hover, steady, ticks as u32, samples));
        each.collect::<Vec<_>>()
    });
    let turned = |k: usize| heading.iter().map(|it| it[k][1]).fold(0.0, f64::max);
    let turned: Vec<_> = (0..samples).map(turned).collect();
    let outside = |of: &Vec<[f64; 2]>| {
        let over = |&k: &usize| {
            let [position, attitude] = of[k];
            let attitude = (2.0 * attitude * attitude + turned[k] * turned[k]).sqrt();
            2f64.sqrt() * position > POSITION_LEFT || attitude > ATTITUDE_LEFT
        };
        (0..samples).rev().find(over).map_or(0, |last| last + 1)
    };
    let linear = step * lateral.iter().map(outside).max().unwrap_or(0) as f64;
    linear.max(push_held(law, steady.acceleration, POSITION_LEFT / 2f64.sqrt()))
}

/// Errors of position and attitude after a push in the worst direction, every `ticks` of the step period.
fn errors(
    of: &Loop,
    corner: &Corner,
    hover: &Hover,
    steady: &Steady,
    ticks: u32,
    samples: usize,
) -> Vec<[f64; 2]> {
    let mut advance = Matrix::identity();
    let tick = Matrix::identity() + of.dt * of.sampled;
    for _ in 0..ticks {
        advance = tick * advance;
    }
    let [force, torque] = hover.lasting.map(|gain| gain > 0.0);
    let lateral = of.chain[2].1 > 0;
    let chained = if lateral { 4 } else { 2 };
    // From the equilibrium under the push: tilt and estimates are what is missing.
    let pushed = if lateral && force {
        let estimate = steady.acceleration * Vector::unit(chained);
        steady.acceleration / G * Vector::unit(2) - estimate
    } else {
        Vector::ZERO
    };
    let twisted = if torque {
        let unit = if hover.saturated { corner.inertia_estimate } else { 1.0 };
        -(steady.torque / unit) * Vector::unit(chained + usize::from(lateral && force))
    } else {
        Vector::ZERO
    };
    let mut states = [pushed, twisted];
    let mut seen = Vec::with_capacity(samples);
    for _ in 0..samples {
        let sum = |row: Vector| states.iter().map(|x| row.dot(*x).abs()).sum::<f64>();
        seen.push([sum(of.outputs.position), sum(of.outputs.attitude)]);
        states = states.map(|x| advance * x);
    }
    seen
}
