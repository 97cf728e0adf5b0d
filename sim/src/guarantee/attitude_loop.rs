//! Bound of the force error `E_f` from the errors of the received state: the ultimate bound of the attitude loop.
//!
//! `docs/guarantees.md#the-attitude-loop` states the theorem and its assumptions. In short: a law that receives `x^` instead of the true state
//! `x` acts as the law that receives `x` under a torque `tau(x^) - tau(x)` more. [`Change`] bounds that torque over the region in which the
//! errors stay, the Lyapunov function `2 (1 - eta_e) + 1/2 w_e . J w_e` of the true errors bounds the region of attitude and rate, and
//! [`Axis`] that of position and velocity. The region is the least one that maps into itself.

use ctrl_core::controller::ControllerConfig;
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::GRAVITY;
use glam::Vec3;

use super::difference::{Change, ROOT_OF_THREE, saturation, smooth_sign};
use super::ultimate::{Axis, StateErrorBounds};
use crate::norm::Norm;

/// `max_x (x - x h(x, 1))`.
const SMOOTHING: f64 = 0.300_3;
/// Iterations towards the region.
const ITERATIONS: usize = 200;
/// Growth of the region that is tried as one that maps into itself.
const GROWTH: f64 = 1e-3;
/// Points of the ellipse outside which V falls.
const POINTS: usize = 500;

/// Errors of what the law receives and has estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ReceivedErrors {
    /// Of the position and the velocity, each axis (m, m/s).
    pub position: f64,
    pub velocity: f64,
    /// Angle of the attitude's error (rad).
    pub attitude: f64,
    /// Of the rate, each axis (rad/s).
    pub rate: f64,
    /// `|1/(m beta) - 1|`.
    pub mass: f64,
}

/// Largest lengths of the reference's derivatives, and of `B = b2d × (p_d'' + g e3)` with its own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ReferenceExtent {
    pub acceleration: f64,
    pub jerk: f64,
    pub snap: f64,
    pub normal_rate: f64,
    pub normal_acceleration: f64,
}

impl ReferenceExtent {
    /// Covers another instant of the reference.
    pub fn include(&mut self, reference: &Reference) {
        let normal = reference.left().cross(reference.specific_force());
        let more = |most: &mut f64, v: Vec3| *most = most.max(v.as_dvec3().norm());
        more(&mut self.acceleration, reference.acceleration_world);
        more(&mut self.jerk, reference.jerk_world);
        more(&mut self.snap, reference.snap_world);
        more(&mut self.normal_rate, normal.first);
        more(&mut self.normal_acceleration, normal.second);
    }
}

/// Region that the errors do not leave.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Region {
    /// Position and velocity errors, each axis (m, m/s).
    pub position: f64,
    pub velocity: f64,
    /// `|eps_e|` and `|w_e|` (rad/s).
    pub eps: f64,
    pub rate: f64,
    /// `E_f` (m/s^2).
    pub force: f64,
}

/// The numbers of a law that the bound needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Law {
    k1: f64,
    k2: f64,
    m1: f64,
    m2: f64,
    d1: f64,
    delta: f64,
    delta_rotation: f64,
    c: f64,
    /// Least and largest over the axes.
    k3: [f64; 2],
    k4: [f64; 2],
    /// `D2` or `D2/J_lo`: largest over the axes, and sum.
    d2: [f64; 2],
    inertia: [f64; 2],
    /// Largest width of the set of the inertia, or of the inverse inertia.
    width: f64,
    /// Least limit of the torque; none for controller 1.
    torque_max: Option<f64>,
    axis: Axis,
}

/// Quantities of the law over a region that the Lyapunov function needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evaluated {
    /// `|u|`: least and largest.
    n: [f64; 2],
    u_change: f64,
    /// Sine of the largest angle of `u` from the vertical, and cosine of that between `u` and the plane across `B`.
    lean: f64,
    cos_heading: f64,
    coupling: f64,
    pub mu: Change,
    pub mu_dot: Change,
    /// `|w|`.
    rate: f64,
    /// Change of `q_e`.
    attitude_change: f64,
}

fn ends(v: Vec3) -> [f64; 2] {
    [v.min_element().into(), v.max_element().into()]
}

impl Law {
    /// Of `law`, with the smoothing width `delta` of the translational part; none with integral action or a model of rotors that lag, which
    /// the theorem leaves out.
    pub fn new(law: &ControllerConfig, delta: f64) -> Option<Self> {
        if law.integral().acceleration_max > 0.0
            || law.integral().torque_max > 0.0
            || law.rotors().lag > 0.0
        {
            return None;
        }
        let (gains, known) = (law.cascade(), law.uncertainty());
        let (lower, upper) = (known.inertia.lower, known.inertia.upper);
        let disturbance = known.disturbance_torque;
        let (k4, d2, width, torque_max) = match law {
            ControllerConfig::RobustAdaptive(law) => (law.k4, disturbance, upper - lower, None),
            ControllerConfig::Saturated(law) => {
                let width = lower.recip() - upper.recip();
                let limit = law.torque_max.min_element();
                (law.k4, disturbance / lower, width, Some(limit.into()))
            }
        };
        let d1 = f64::from(known.disturbance_acceleration);
        Some(Self {
            k1: gains.k1.into(),
            k2: gains.k2.into(),
            m1: gains.m1.into(),
            m2: gains.m2.into(),
            d1,
            delta,
            delta_rotation: gains.delta_min_rotation.into(),
            c: gains.c.into(),
            k3: ends(gains.k3),
            k4: ends(k4),
            d2: [d2.max_element().into(), f64::from(d2.element_sum())],
            inertia: [lower.min_element().into(), upper.max_element().into()],
            width: width.max_element().into(),
            torque_max,
            axis: Axis::new(gains, d1, delta),
        })
    }

    /// Steps 1 to 3 over `region`, at the true state and at one that is off by `errors`, both lengths of vectors.
    pub fn evaluate(
        &self,
        reference: &ReferenceExtent,
        [position, velocity, attitude, rate]: [f64; 4],
        region: &Region,
    ) -> Option<Evaluated> {
        let Self { k1, k2, d1, delta, c, .. } = *self;
        let k3 = self.k3[1];
        let (jerk, snap) = (Change::fixed(reference.jerk), Change::fixed(reference.snap));
        // Step 1. Each component of the errors is within the length of their change.
        let e_v = Change::new(ROOT_OF_THREE * region.velocity + velocity, velocity);
        let (l1, l2) = (
            k1 * (region.position + position) + k2 * (region.velocity + velocity),
            k2 * (region.velocity + velocity),
        );
        let s1 = saturation(self.m1, l1, k1 * position + k2 * velocity);
        let s2 = saturation(self.m2, l2, k2 * velocity);
        let g = k2 * s1[0] + k2 * s2[0] + k1 * e_v;
        let h = smooth_sign(g, delta);
        let feedback = s1[0] + s2[0] + d1 * h[0];
        let gravity = f64::from(GRAVITY);
        let n_least = gravity - reference.acceleration - feedback.size;
        let n_most = gravity + reference.acceleration + feedback.size;
        let lean = (reference.acceleration + feedback.size) / n_least;
        let across = feedback.size / n_least;
        if n_least <= 0.0 || across >= 0.9 {
            return None;
        }
        let u_change = feedback.change;
        let n = Change::new(n_most, u_change);
        let inverse_n = Change::new(1.0 / n_least, u_change / (n_least * n_least));
        let r3 = Change::new(1.0, u_change / n_least);
        let thrust_axis = Change::new(1.0, attitude);
        // v' of the model, less p_d'': -feedback + n (b3 - r3).
        let tilted = 2.0 * region.eps + attitude + r3.change;
        let e_v1 = Change::new(feedback.size + n_most * tilted, u_change + n_most * attitude);
        let (l1_1, l2_1) = (k1 * e_v + k2 * e_v1, k2 * e_v1);
        let (s1_1, s2_1) = (s1[1] * l1_1, s2[1] * l2_1);
        let g_1 = k2 * s1_1 + k2 * s2_1 + k1 * e_v1;
        let u_1 = s1_1 + s2_1 + d1 * (h[1] * g_1) + jerk;
        let n_1 = u_1 * r3;
        // Step 2.
        let cos_heading = (1.0 - across * across).sqrt();
        let r2 = Change::new(1.0, r3.change / cos_heading);
        let r1_change = r2.change + r3.change;
        let axes_change =
            (r1_change * r1_change + r2.change * r2.change + r3.change * r3.change).sqrt();
        let axes = Change::new(1.0, axes_change);
        let (b_least, b_most) =
            (gravity - reference.acceleration, gravity + reference.acceleration);
        let s = Change::new(b_most * across, b_most * r3.change);
        let rho = Change::new(b_most, b_most * r1_change);
        let rho_least = b_least * cos_heading;
        let inverse_rho = Change::new(1.0 / rho_least, rho.change / (rho_least * rho_least));
        let b_1 = Change::fixed(reference.normal_rate) * axes;
        let p_1 = u_1 * inverse_n * axes;
        let w_z = (b_1 + s * p_1) * inverse_rho;
        let w_d = p_1.beside(w_z);
        // Step 3. A quaternion changes by half the angle, 0.55 of its chord up to 1 rad.
        let attitude_change = 0.55 * (attitude + axes_change);
        let eps = Change::new(region.eps + attitude_change, attitude_change);
        let turned = Change::new(1.0, attitude + axes_change);
        let quaternion = Change::new(1.0, attitude_change);
        let forward = turned * w_d;
        let g_d = g * axes;
        let y = quaternion * g_d;
        let coupling = 2.0 * c * (n * y);
        let mu = forward + k3 * eps + coupling;
        let w = Change::new(mu.size + region.rate + rate, rate);
        let nu_size = region.rate + coupling.size + k3 * region.eps;
        let nu = Change::new(nu_size + rate + forward.change, rate + forward.change);
        // Second derivatives.
        let e_v2 = n_1 * thrust_axis + n * (w * thrust_axis) + jerk;
        let (l1_2, l2_2) = (k1 * e_v1 + k2 * e_v2, k2 * e_v2);
        let s1_2 = s1[2] * l1_1 * l1_1 + s1[1] * l1_2;
        let s2_2 = s2[2] * l2_1 * l2_1 + s2[1] * l2_2;
        let g_2 = k2 * s1_2 + k2 * s2_2 + k1 * e_v2;
        let u_2 = s1_2 + s2_2 + d1 * (h[2] * g_1 * g_1 + h[1] * g_2) + snap;
        let p_2 = u_2 * inverse_n * axes;
        let w_x1 = p_2 + 2.0 * (p_1 * p_1) + w_z * p_1;
        let (s_1, rho_1) = (rho * p_1 + b_1, b_1 + s * p_1);
        let b_2 = Change::fixed(reference.normal_acceleration) * r2;
        let w_z1 = (b_2 + w_z * b_1 + p_1 * b_1 + s_1 * p_1 + s * w_x1 + rho_1 * w_z) * inverse_rho;
        let forward_1 = turned * w_x1.beside(w_z1) + nu * forward;
        let quaternion_1 = 0.5 * (quaternion * nu);
        let g_d1 = g_1 * axes + w_d * g_d;
        let y_1 = quaternion_1 * g_d + quaternion * g_d1;
        let mu_dot = forward_1 + k3 * quaternion_1 + 2.0 * c * (n_1 * y + n * y_1);
        Some(Evaluated {
            n: [n_least, n_most],
            u_change,
            lean,
            cos_heading,
            coupling: coupling.size,
            mu,
            mu_dot: mu_dot.within_its_size(),
            rate: w.size,
            attitude_change,
        })
    }

    /// Bound of what the received state changes of the torque (N m), or of what it accelerates, controller 2 (rad/s^2).
    pub fn torque_change(&self, seen: &Evaluated, rate: f64) -> f64 {
        let rate_error = rate + seen.mu.change;
        let sign = (self.d2[0] * rate_error / self.delta_rotation).min(2.0 * self.d2[1]);
        let gyroscopic = 2.0 * seen.rate * rate;
        let scale = if self.torque_max.is_some() { 1.0 } else { self.inertia[1] };
        self.k4[1] * rate_error
            + seen.attitude_change
            + sign
            + scale * (gyroscopic + seen.mu_dot.change)
    }

    /// Region into which the errors of `region` are led; none if that has no bound, or if a torque might saturate.
    fn led(
        &self,
        errors: &ReceivedErrors,
        reference: &ReferenceExtent,
        region: &Region,
    ) -> Option<Region> {
        let lengths = [
            ROOT_OF_THREE * errors.position,
            ROOT_OF_THREE * errors.velocity,
            errors.attitude,
            ROOT_OF_THREE * errors.rate,
        ];
        let seen = self.evaluate(reference, lengths, region)?;
        let [n_least, n_most] = seen.n;
        // v' that the model misses: along the thrust by the mass and the change of u, in any direction by d1.
        let along = n_most * errors.mass + seen.u_change;
        let any = ROOT_OF_THREE * self.d1;
        let Self { k1, k2, m1, m2, .. } = *self;
        let slope = k2 * (m1 + m2) + self.d1 / self.delta * (k2 * k2 * (m1 + m2) + k1);
        let turning = slope * (any + along * (seen.lean + 2.0 * region.eps).min(1.0))
            / (n_least * seen.cos_heading);
        const SMALL: f64 = 1e-7;
        let moved = self.evaluate(reference, [0.0, SMALL, 0.0, 0.0], region)?;
        let feed_forward = moved.mu.change / SMALL * (any + along);
        let (w, mu_dot) = (seen.rate, seen.mu_dot.size);
        let a = turning + seen.coupling;
        let s = SMOOTHING * self.delta_rotation * self.d2[1];
        let changed = self.torque_change(&seen, lengths[3]);
        let (b, inertia) = match self.torque_max {
            None => {
                let estimate = self.width * (w * w + mu_dot);
                (changed + estimate + self.inertia[1] * feed_forward, self.inertia)
            }
            Some(limit) => {
                let asked = self.inertia[1]
                    * (self.k4[1] * (region.rate + ROOT_OF_THREE * errors.rate + seen.mu.change)
                        + region.eps
                        + seen.attitude_change
                        + w * w
                        + mu_dot
                        + self.d2[0]);
                if asked > limit {
                    return None;
                }
                let estimate = self.width * ROOT_OF_THREE * asked + 2.0 * w * w;
                (changed + estimate + feed_forward, [1.0, 1.0])
            }
        };
        let v = highest(a, b, s, self.k3[0], self.k4[0], inertia[1])?;
        let eta = 1.0 - 0.5 * v;
        let eps = (1.0 - eta * eta).sqrt();
        let force = n_most * (errors.mass + 2.0 * eps + seen.u_change / n_least);
        let ReceivedErrors { position, velocity, .. } = *errors;
        let n = self.axis.disturbance(&StateErrorBounds { position, velocity, force });
        let (position, velocity) = self.axis.region(n)?;
        Some(Region { position, velocity, eps, rate: (2.0 * v / inertia[0]).sqrt(), force })
    }

    /// The least region that maps into itself; none if it grows without a bound.
    pub fn region(&self, errors: &ReceivedErrors, reference: &ReferenceExtent) -> Option<Region> {
        let mut region = Region::default();
        for _ in 0..ITERATIONS {
            let grown = region.grown();
            let next = self.led(errors, reference, &grown)?;
            if next.is_within(&grown) {
                return Some(grown);
            }
            region = next;
        }
        None
    }
}

impl Region {
    fn grown(&self) -> Self {
        let more = |x: f64| x * (1.0 + GROWTH) + 1e-9;
        let Self { position, velocity, eps, rate, force } = *self;
        Self {
            position: more(position),
            velocity: more(velocity),
            eps: more(eps),
            rate: more(rate),
            force: more(force),
        }
    }

    fn is_within(&self, other: &Self) -> bool {
        self.position <= other.position
            && self.velocity <= other.velocity
            && self.eps <= other.eps
            && self.rate <= other.rate
            && self.force <= other.force
    }
}

/// Largest `2 (1 - eta) + J/2 w^2` where `-k3 e^2 - k4 w^2 + a e + b w + s >= 0` with `e = |eps|`, so that it falls outside; none if
/// `e` may reach one.
fn highest(a: f64, b: f64, s: f64, k3: f64, k4: f64, inertia: f64) -> Option<f64> {
    let radius = (a * a / (4.0 * k3) + b * b / (4.0 * k4) + s).sqrt();
    let mut most = 0.0f64;
    for i in 0..=POINTS {
        let angle = core::f64::consts::FRAC_PI_2 * i as f64 / POINTS as f64;
        // Outside the ellipse, by the arc between two points.
        let radius = radius * (1.0 + 1e-5);
        let e = a / (2.0 * k3) + radius * libm::cos(angle) / k3.sqrt();
        let w = b / (2.0 * k4) + radius * libm::sin(angle) / k4.sqrt();
        if e >= 1.0 {
            return None;
        }
        most = most.max(2.0 * (1.0 - (1.0 - e * e).sqrt()) + 0.5 * inertia * w * w);
    }
    // The sign of q_e is kept while eta stays above zero.
    (most < 1.9).then_some(most)
}

#[cfg(test)]
mod tests;
