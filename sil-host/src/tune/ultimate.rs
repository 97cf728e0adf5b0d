//! Predicted ultimate bounds: what is left of the errors once the start has died away, with both
//! disturbances at their full bounds. `docs/tune.md` says what they contain and what they do not.
//!
//! Two answers to two questions. *In the mean* (root of the mean square over a long time), from the
//! ultimate set `W <= rho` of `docs/guarantees.md`: V is bounded, so the mean of `W` cannot exceed that of
//! `rho`, whatever the estimates do. *At any instant*, from the peaks of the loops at hover.

use ctrl_core::vehicle::GRAVITY;
use glam::DVec3;
use serde::Serialize;

use super::hover::{Corner, Hover};
use super::margin::Rotors;
use super::peak::{Disturbances, Peaks, peaks};
use super::steady::Steady;
use super::survey::{Which, nominal};
use ctrl_core::controller::ControllerConfig;
use sim::guarantee::lyapunov::SMOOTHING;

/// Bounds of the errors of the whole vehicle; none where the method gives none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bounds {
    /// Distance from the reference (m).
    pub position: Option<f64>,
    /// Angle of `q_e` (rad).
    pub attitude: Option<f64>,
    /// Angle between body z and `b3d` (rad).
    pub tilt: Option<f64>,
    /// Angle between body y and `b2d` (rad).
    pub heading: Option<f64>,
    /// `|w_e|` (rad/s).
    pub rate_error: Option<f64>,
}

impl Bounds {
    fn zip(self, other: Self, f: impl Fn(Option<f64>, Option<f64>) -> Option<f64>) -> Self {
        Self {
            position: f(self.position, other.position),
            attitude: f(self.attitude, other.attitude),
            tilt: f(self.tilt, other.tilt),
            heading: f(self.heading, other.heading),
            rate_error: f(self.rate_error, other.rate_error),
        }
    }
}

/// Both answers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ultimate {
    /// Root of the mean square over a long time, from `W <= rho`; the peak where that is smaller.
    pub mean: Bounds,
    /// At any instant, from the peaks of the loops at hover.
    pub peak: Bounds,
    /// Largest acceleration that the linear position loop asks of `M1` in these peaks (m/s^2); above `M1`
    /// there is no peak of the position.
    pub position_demand: f64,
}

impl Ultimate {
    /// Of `law` behind `rotors`, when `lasting_torque` (N m) of `D2` may last about each axis and the rest is
    /// noise, and the vehicle leans against a push of `steady` on top.
    #[must_use]
    pub fn new(
        law: &ControllerConfig,
        lasting_torque: DVec3,
        steady: &Steady,
        rotors: &Rotors,
    ) -> Self {
        let (mut peak, position_demand) = peak(law, lasting_torque, rotors);
        let lean = (2f64.sqrt() * steady.acceleration / f64::from(GRAVITY)).atan();
        for angle in [&mut peak.tilt, &mut peak.heading] {
            *angle = angle.map(|it| it + lean);
        }
        // No mean is above its peak, which in turn may be none.
        let mean = mean(law).zip(peak, |mean, peak| match (mean, peak) {
            (Some(mean), Some(peak)) => Some(mean.min(peak)),
            (mean, peak) => mean.or(peak),
        });
        Self { mean, peak, position_demand }
    }
}

/// Peaks of each loop over the ends of inertia, estimate and mass.
fn peak(law: &ControllerConfig, lasting_torque: DVec3, rotors: &Rotors) -> (Bounds, f64) {
    let hover = Hover::new(law);
    let tilting = hover.distinct(Which::Lateral.axes());
    let d1 = f64::from(hover.known.disturbance_acceleration);
    let d2 = hover.known.disturbance_torque.as_dvec3();
    let peaks = |which, corner: &Corner| {
        let lasting = lasting_torque[corner.axis];
        let noise = [0.0, d2[corner.axis] - lasting];
        let disturbances = Disturbances { lasting: [d1, lasting], noise };
        peaks(which, &hover, corner, &disturbances, rotors)
    };
    let ends = |interval: ctrl_core::vehicle::Interval| {
        [f64::from(interval.lower), f64::from(interval.upper)]
    };
    // At any heading: either tilt axis may be that of either horizontal axis.
    let of_axes = |which: Which, axes: &[usize]| {
        let mut worst = Peaks::default();
        for axis in axes.iter().copied() {
            let set = ends(hover.known.inertia.axes()[axis]);
            for (inertia, inertia_estimate) in set.into_iter().flat_map(|it| set.map(|by| (it, by)))
            {
                let corner = Corner { inertia, inertia_estimate, ..nominal(law, axis) };
                worst = worst.max(peaks(which, &corner));
            }
        }
        worst
    };
    // What may last is not among what makes axes distinct.
    let tilting = if alike(lasting_torque) { &tilting[..] } else { &[0, 1] };
    // With the estimates of integral action, and where their projection holds them.
    let learning = hover.lasting.iter().any(|gain| *gain > 0.0);
    let of_both = |frozen, learns, axes| {
        let worst = of_axes(frozen, axes);
        if learning { worst.max(of_axes(learns, axes)) } else { worst }
    };
    let lateral = of_both(Which::Lateral, Which::LateralIntegral, tilting);
    let heading = of_both(Which::Heading, Which::HeadingIntegral, &[2]);
    let adapting = hover.cascade.gamma1 > 0.0;
    let which = if adapting { Which::VerticalAdaptive } else { Which::Vertical };
    let mut vertical = Peaks::default();
    for mass in ends(hover.known.mass) {
        vertical = vertical.max(peaks(which, &Corner { mass, ..nominal(law, 0) }));
    }
    let norm = |x: f64, y: f64, z: f64| Some(x.hypot(y).hypot(z)).filter(|x| x.is_finite());
    let [along, up] = [lateral.position, vertical.position].map(|x| outside_linear(&hover, x));
    let stiffness = f64::from(hover.cascade.k1) * f64::from(hover.cascade.m1);
    let demand = stiffness * lateral.position.max(vertical.position);
    let bounds = Bounds {
        position: norm(along, along, up),
        attitude: norm(lateral.attitude, lateral.attitude, heading.attitude),
        tilt: norm(lateral.tilt, lateral.tilt, 0.0),
        heading: norm(lateral.tilt, heading.tilt, 0.0),
        rate_error: norm(lateral.rate_error, lateral.rate_error, heading.rate_error),
    };
    (bounds, demand)
}

fn alike(x: DVec3) -> bool {
    x == DVec3::splat(x.x)
}

/// A position error (m) of the linear loop as that of `M1 tanh(k1 e)`, which gives way: infinite where
/// the linear loop asks for more than `M1`.
fn outside_linear(hover: &Hover, position: f64) -> f64 {
    let k1 = f64::from(hover.cascade.k1);
    if k1 * position < 1.0 { (k1 * position).atanh() / k1 } else { f64::INFINITY }
}

/// From `mean(W) <= mean(rho)`.
fn mean(law: &ControllerConfig) -> Bounds {
    let Rho { smoothing, attitude: p, rate: q } = Rho::new(law);
    let cascade = law.cascade();
    let (k3, k4) = (f64::from(cascade.k3.min_element()), Hover::new(law).k4.min_element());
    // With the least of the axes, k3 a^2 + k4 b^2 + T <= smoothing + p a + q b, solved for the largest a, b, T alone.
    let largest = |k: f64, p: f64, rest: f64| (p + (p * p + 4.0 * k * rest).sqrt()) / (2.0 * k);
    let (of_p, of_q) = (p * p / (4.0 * k3), q * q / (4.0 * k4));
    let eps = largest(k3, p, smoothing + of_q);
    let rate_error = largest(k4, q, smoothing + of_p);
    let [c, k1, k2, m1] = [cascade.c, cascade.k1, cascade.k2, cascade.m1].map(f64::from);
    // At rest, c k2 |sig_1(k1 e)|^2 is all that W has of the position.
    let commanded = ((smoothing + of_p + of_q) / (c * k2)).sqrt() / m1;
    Bounds {
        position: (commanded < 1.0).then(|| commanded.atanh() / k1),
        attitude: (eps < 1.0).then(|| 2.0 * eps.asin()),
        tilt: None,
        heading: None,
        rate_error: Some(rate_error),
    }
}

/// Bounds of the terms of `rho`: `rho <= smoothing + attitude |eps_e| + rate |w_e|`.
struct Rho {
    /// `rho_d` and what noise adds to `w_e` within a tick (1/s).
    smoothing: f64,
    /// Of `rho_v`: `|w_d,used - w_d,true|` (1/s).
    attitude: f64,
    /// Of `rho_v`: `|J'' (mu'_true - mu'_used)|`.
    rate: f64,
}

impl Rho {
    fn new(law: &ControllerConfig) -> Self {
        let hover = Hover::new(law);
        let known = hover.known;
        let d1 = f64::from(known.disturbance_acceleration);
        let d2 = known.disturbance_torque.as_dvec3();
        let cascade = hover.cascade;
        let [c, k3] = [cascade.c, cascade.k3.max_element()].map(f64::from);
        let [delta_t, delta_r] =
            [cascade.delta_min_translation, cascade.delta_min_rotation].map(f64::from);
        let lower = known.inertia.lower.as_dvec3();
        let (weight, heaviest) = if hover.saturated {
            (lower.recip(), 1.0)
        } else {
            (DVec3::ONE, known.inertia.upper.max_element().into())
        };
        let tick = d2 * d2 / if hover.saturated { lower * lower } else { lower };
        // v' of the model lacks d1, which the two horizontal components bring into mu' and w_d.
        let stiffness = hover.stiffness(&nominal(law, 0));
        let g = f64::from(GRAVITY);
        let along = 2f64.sqrt() * d1;
        let through_mu = (stiffness.kp + 0.5 * k3 * stiffness.kv) / g + 2.0 * c * g * stiffness.gv;
        Self {
            smoothing: SMOOTHING * (3.0 * c * d1 * delta_t + (weight * d2).element_sum() * delta_r)
                + 0.5 * hover.dt * tick.element_sum(),
            attitude: along * stiffness.kv / g,
            rate: along * heaviest * through_mu,
        }
    }
}
