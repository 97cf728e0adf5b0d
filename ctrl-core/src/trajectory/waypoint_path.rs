//! Legs through waypoints, each a polynomial of degree 9 that joins the next up to the snap.
//!
//! A waypoint states position, velocity and acceleration; jerk and snap are zero there. The ten
//! conditions at the two ends of a leg are ten Bernstein coefficients, so continuity holds by
//! construction. With `u = t/T` in [0, 1] and `B(u)` the Bernstein polynomials of degree 9:
//!
//! ```text
//! p_d(u) = sum b_i B_i(u)
//! b_i     = p0 + i T v0/9 + i (i - 1)/2 T^2 a0/72,   i = 0..4
//! b_(9-i) = p1 - i T v1/9 + i (i - 1)/2 T^2 a1/72,   i = 0..4
//! p_d''(u) = sum 72 (b_(i+2) - 2 b_(i+1) + b_i)/T^2 B_i(u),  degree 7
//! ```
//!
//! Position and acceleration are evaluated from coefficients of their own, so that jerk and snap
//! lose no digits to differences of large positions.

use core::cell::Cell;

use glam::{DVec3, Vec3};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use super::{
    Trajectory, horizontal, require_flyable, require_position, require_step_period, require_yaw,
};
use crate::error::{Bound, ConfigError, require};
use crate::jet::Jet;
use crate::list::List;
use crate::reference::Reference;

/// Most legs of a path.
pub const MAX_LEGS: usize = 16;

/// Samples a leg over which the acceleration bound is taken.
const BOUND_SAMPLES: u16 = 128;

/// One leg: duration and state at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Leg {
    /// `T`: time from the last waypoint (s); rounded to whole steps, at least 10 and at most 2^24.
    pub duration: f32,
    /// Position of the waypoint (m), each coordinate within [`REACH`](super::REACH).
    pub position_world: Vec3,
    /// Velocity at the waypoint (m/s); zero unless given.
    #[cfg_attr(feature = "serde", serde(default))]
    pub velocity_world: Vec3,
    /// Acceleration at the waypoint (m/s^2); zero unless given.
    #[cfg_attr(feature = "serde", serde(default))]
    pub acceleration_world: Vec3,
}

impl Leg {
    /// A leg of `duration` (s) that ends at rest in `position_world` (m).
    #[must_use]
    pub const fn to(position_world: Vec3, duration: f32) -> Self {
        Self {
            duration,
            position_world,
            velocity_world: Vec3::ZERO,
            acceleration_world: Vec3::ZERO,
        }
    }
}

/// A path from rest to rest.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct WaypointPathConfig {
    /// Position at tick zero, at rest (m).
    pub start_world: Vec3,
    /// Angle of body x from world x about world z (rad), within a turn.
    pub yaw: f32,
    /// The legs in order, one to [`MAX_LEGS`]; the last one ends at rest.
    pub legs: List<Leg, MAX_LEGS>,
}

/// The path, validated; after the last leg it holds the last point.
#[derive(Clone, Debug, PartialEq)]
pub struct WaypointPath {
    segments: List<Segment, MAX_LEGS>,
    forward_world: Vec3,
    end: Reference,
    acceleration_bound: f32,
    step_period: f32,
}

/// The polynomial of one leg.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Segment {
    ticks: u32,
    /// `T` (s).
    duration: f32,
    /// `p0` (m).
    origin_world: Vec3,
    /// `b_i - p0` (m).
    offset: [Vec3; 10],
    /// Bernstein coefficients of the acceleration (m/s^2).
    acceleration: [Vec3; 8],
}

/// A path configuration that has passed every check, with what the checks found.
///
/// Nothing is built yet, so that a path can be judged, and then written into the memory that it is
/// flown from, without a copy on the stack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheckedPath<'a> {
    config: &'a WaypointPathConfig,
    acceleration_bound: f32,
    step_period: f32,
}

impl WaypointPathConfig {
    /// Checks the path for flight, sampled every `step_period` (s).
    ///
    /// # Errors
    /// Names the field that is out of its range, a missing leg, a last leg that does not end at
    /// rest, or the acceleration bound that exceeds `g`.
    pub fn check(&self, step_period: f32) -> Result<CheckedPath<'_>, ConfigError> {
        require_step_period(step_period)?;
        require_position("waypoint_path.start_world", self.start_world)?;
        require_yaw("waypoint_path.yaw", self.yaw)?;
        let count = Bound::Inside(1.0, MAX_LEGS as f32);
        require("waypoint_path.legs (count)", self.legs.len() as f32, count, "number of legs")?;
        let mut from = Leg::to(self.start_world, 0.0);
        let mut acceleration_bound = 0.0f32;
        for leg in &self.legs {
            require_leg(leg, step_period)?;
            let segment = Segment::new(&from, leg, step_period);
            acceleration_bound = acceleration_bound.max(segment.acceleration_bound());
            from = *leg;
        }
        require_rest("waypoint_path.legs.last.velocity_world", from.velocity_world)?;
        require_rest("waypoint_path.legs.last.acceleration_world", from.acceleration_world)?;
        require_flyable("waypoint_path.acceleration_bound", acceleration_bound)?;
        Ok(CheckedPath { config: self, acceleration_bound, step_period })
    }
}

impl CheckedPath<'_> {
    /// Largest acceleration of any component along the path (m/s^2).
    #[must_use]
    pub const fn acceleration_bound(&self) -> f32 {
        self.acceleration_bound
    }

    /// Time between two ticks (s).
    #[must_use]
    pub const fn step_period(&self) -> f32 {
        self.step_period
    }

    /// The path by value.
    #[must_use]
    pub fn build(&self) -> WaypointPath {
        let mut path = WaypointPath::unbuilt();
        self.build_into(&mut path);
        path
    }

    /// Writes the path into `path`, in place of what was there.
    pub fn build_into(&self, path: &mut WaypointPath) {
        let mut from = Leg::to(self.config.start_world, 0.0);
        path.segments.truncate(0);
        for leg in &self.config.legs {
            // The capacity is that of the configuration: the push does not fail.
            let _ = path.segments.push(Segment::new(&from, leg, self.step_period));
            from = *leg;
        }
        path.forward_world = horizontal(self.config.yaw);
        path.end = Reference::hover(from.position_world).facing(Jet::constant(path.forward_world));
        (path.acceleration_bound, path.step_period) = (self.acceleration_bound, self.step_period);
    }
}

impl WaypointPath {
    /// The path of `config`, sampled every `step_period` (s).
    ///
    /// # Errors
    /// Those of [`WaypointPathConfig::check`].
    pub fn new(config: &WaypointPathConfig, step_period: f32) -> Result<Self, ConfigError> {
        Ok(config.check(step_period)?.build())
    }

    /// A path without legs, to be [built](CheckedPath::build_into). Every byte of it is zero, so that a
    /// static of it needs no initial values; its references are invalid (no left axis).
    #[must_use]
    pub const fn unbuilt() -> Self {
        Self {
            segments: List::empty(Segment::ZERO),
            forward_world: Vec3::ZERO,
            end: Reference { left_world: Vec3::ZERO, ..Reference::hover(Vec3::ZERO) },
            acceleration_bound: 0.0,
            step_period: 0.0,
        }
    }
}

impl Trajectory for WaypointPath {
    fn reference(&self, tick: u64) -> Reference {
        let mut elapsed = tick;
        // wcet: at most MAX_LEGS iterations
        for segment in &self.segments {
            let ticks = u64::from(segment.ticks);
            if elapsed < ticks {
                let u = elapsed as u32 as f32 / segment.ticks as f32;
                return segment.reference(u).facing(Jet::constant(self.forward_world));
            }
            elapsed -= ticks;
        }
        self.end
    }

    fn acceleration_bound(&self) -> f32 {
        self.acceleration_bound
    }

    fn step_period(&self) -> f32 {
        self.step_period
    }
}

impl Segment {
    /// No motion.
    const ZERO: Self = Self {
        ticks: 0,
        duration: 0.0,
        origin_world: Vec3::ZERO,
        offset: [Vec3::ZERO; 10],
        acceleration: [Vec3::ZERO; 8],
    };

    /// The polynomial from one waypoint to the next; the leg is within its ranges.
    fn new(from: &Leg, to: &Leg, step_period: f32) -> Self {
        let ticks = (to.duration / step_period + 0.5) as u32;
        Self::through(from, to, ticks, f64::from(ticks) * f64::from(step_period))
    }

    fn through(from: &Leg, to: &Leg, ticks: u32, duration: f64) -> Self {
        let points = control_points(from, to, duration);
        let scale = 72.0 / (duration * duration);
        Self {
            ticks,
            duration: duration as f32,
            origin_world: from.position_world,
            offset: points.map(|point| point.as_vec3()),
            acceleration: core::array::from_fn(|i| bend(&points, i) * scale).map(|a| a.as_vec3()),
        }
    }

    /// Everything but the heading, at `u` in [0, 1].
    fn reference(&self, u: f32) -> Reference {
        let offset = bernstein(self.offset, u);
        let acceleration = bernstein(self.acceleration, u);
        let rate = 1.0 / self.duration;
        Reference {
            velocity_world: rate * offset.first,
            acceleration_world: acceleration.value,
            jerk_world: rate * acceleration.first,
            snap_world: rate * rate * acceleration.second,
            ..Reference::hover(self.origin_world + offset.value)
        }
    }

    /// Largest component of the acceleration (m/s^2).
    ///
    /// Between samples `h` apart a function leaves its chord by at most `h^2/8 max|f''|`, and the
    /// Bernstein coefficients of `f''` bound it. The last factor covers the rounding.
    fn acceleration_bound(&self) -> f32 {
        let h = 1.0 / f32::from(BOUND_SAMPLES);
        let sampled = (0..=BOUND_SAMPLES)
            .map(|i| bernstein_value(self.acceleration, f32::from(i) * h).abs())
            .fold(Vec3::ZERO, Vec3::max);
        let [a0, a1, a2, a3, a4, a5, a6, a7] = self.acceleration;
        let windows =
            [(a0, a1, a2), (a1, a2, a3), (a2, a3, a4), (a3, a4, a5), (a4, a5, a6), (a5, a6, a7)];
        let curvature = windows
            .map(|(a, b, c)| 42.0 * (c - b - b + a).abs())
            .into_iter()
            .fold(Vec3::ZERO, Vec3::max);
        largest(sampled + curvature * (h * h / 8.0)) * 1.000_001
    }
}

/// Refuses a leg that is out of its ranges.
fn require_leg(leg: &Leg, step_period: f32) -> Result<(), ConfigError> {
    let steps = Bound::Inside(10.0 * step_period, 16_777_216.0 * step_period);
    require("waypoint_path.legs.duration", leg.duration, steps, "10 to 2^24 steps")?;
    require_position("waypoint_path.legs.position_world", leg.position_world)?;
    let (speed, pull) = (leg.velocity_world.abs(), leg.acceleration_world.abs());
    let fastest = Bound::Inside(0.0, 1000.0);
    require(
        "waypoint_path.legs.velocity_world",
        largest(speed),
        fastest,
        "fastest velocity at a waypoint, m/s",
    )?;
    require_flyable("waypoint_path.legs.acceleration_world", largest(pull))
}

/// `b_i - p0` of the leg `from` one waypoint `to` the next in `t` (s).
fn control_points(from: &Leg, to: &Leg, t: f64) -> [DVec3; 10] {
    let length = to.position_world.as_dvec3() - from.position_world.as_dvec3();
    let near = |leg: &Leg, t: f64, i: usize| {
        let (i, pairs) = (i as f64, (i * i.saturating_sub(1) / 2) as f64);
        let (slope, bend) = (leg.velocity_world.as_dvec3() * (t / 9.0), t * t / 72.0);
        slope * i + leg.acceleration_world.as_dvec3() * (bend * pairs)
    };
    core::array::from_fn(|i| match i {
        0..=4 => near(from, t, i),
        _ => length + near(to, -t, 9 - i),
    })
}

/// Second difference of three neighbouring points, from the `first` on.
#[inline(never)] // once in the flash, not eight times: the chip adds f64 by calls
fn bend(points: &[DVec3; 10], first: usize) -> DVec3 {
    match points.get(first..) {
        Some(&[a, b, c, ..]) => c - b - b + a,
        _ => DVec3::ZERO, // never: the last window begins at the eighth point
    }
}

/// A polynomial in Bernstein form at `u`, with its derivatives with respect to `u`, by de
/// Casteljau's algorithm stopped at three points.
fn bernstein<const N: usize>(mut points: [Vec3; N], u: f32) -> Jet<Vec3> {
    // wcet: at most 7 iterations
    for live in (4..=N).rev() {
        if let Some(points) = points.get_mut(..live) {
            interpolate(points, u);
        }
    }
    let Some(&[p0, p1, p2]) = points.first_chunk::<3>() else {
        return Jet::default(); // never: N is 8 or 10
    };
    let (left, right) = (p0.lerp(p1, u), p1.lerp(p2, u));
    let degree = (N - 1) as f32;
    Jet::new(
        left.lerp(right, u),
        degree * (right - left),
        degree * (degree - 1.0) * (p2 - p1 - p1 + p0),
    )
}

/// The value of [`bernstein`] for degree 7 alone, bit for bit: a bound takes many samples, and without
/// a loop the points stay in registers.
fn bernstein_value(points: [Vec3; 8], u: f32) -> Vec3 {
    let [a, b, c, d, e, f, g, h] = points;
    let to = |near: Vec3, far: Vec3| near.lerp(far, u);
    let [a, b, c, d, e, f, g] =
        [to(a, b), to(b, c), to(c, d), to(d, e), to(e, f), to(f, g), to(g, h)];
    let [a, b, c, d, e, f] = [to(a, b), to(b, c), to(c, d), to(d, e), to(e, f), to(f, g)];
    let [a, b, c, d, e] = [to(a, b), to(b, c), to(c, d), to(d, e), to(e, f)];
    let [a, b, c, d] = [to(a, b), to(b, c), to(c, d), to(d, e)];
    let [a, b, c] = [to(a, b), to(b, c), to(c, d)];
    let [a, b] = [to(a, b), to(b, c)];
    to(a, b)
}

/// One round of de Casteljau's algorithm in place; the last point is spent.
fn interpolate(points: &mut [Vec3], u: f32) {
    let points = Cell::from_mut(points).as_slice_of_cells();
    // wcet: at most 9 iterations
    for (near, far) in points.iter().zip(points.iter().skip(1)) {
        near.set(near.get().lerp(far.get(), u));
    }
}

/// Largest component; NaN if one is.
fn largest(v: Vec3) -> f32 {
    if v.is_nan() { f32::NAN } else { v.max_element() }
}

/// Refuses a vector other than zero.
fn require_rest(parameter: &'static str, v: Vec3) -> Result<(), ConfigError> {
    require(parameter, largest(v.abs()), Bound::Inside(0.0, 0.0), "the last point is held")
}

#[cfg(test)]
mod tests {
    use super::super::closed_form::{assert_bound, assert_follows, derivative, facing};
    use super::*;

    const PERIOD: f32 = 1e-3;

    fn path(legs: &[Leg]) -> WaypointPathConfig {
        let legs = List::from_slice(legs).unwrap();
        WaypointPathConfig { start_world: Vec3::new(1.0, 2.0, 3.0), yaw: 0.3, legs }
    }

    /// Three legs, the first two flown through without a stop.
    fn through() -> WaypointPathConfig {
        let first = Leg {
            velocity_world: Vec3::new(1.0, 0.5, 0.0),
            acceleration_world: Vec3::new(0.0, -0.4, 0.1),
            ..Leg::to(Vec3::new(4.0, 2.0, 4.0), 4.0)
        };
        let second = Leg {
            velocity_world: Vec3::new(0.0, -1.0, 0.2),
            ..Leg::to(Vec3::new(6.0, -1.0, 5.0), 3.5)
        };
        path(&[first, second, Leg::to(Vec3::new(6.0, -4.0, 5.0), 5.0)])
    }

    #[test]
    fn a_leg_from_rest_to_rest_is_the_smooth_step() {
        // 126 u^5 - 420 u^6 + 540 u^7 - 315 u^8 + 70 u^9: zero derivatives to the fourth at 0 and 1.
        let trajectory =
            WaypointPath::new(&path(&[Leg::to(Vec3::new(3.0, 1.0, 4.0), 5.0)]), PERIOD).unwrap();
        let t_end = 5000.0 * f64::from(PERIOD);
        let step = |t: f64| {
            let u = t / t_end;
            u.powi(5) * (126.0 + u * (-420.0 + u * (540.0 + u * (-315.0 + u * 70.0))))
        };
        let curve = |t: f64| {
            let u = t / t_end;
            2520.0 * (u * (1.0 - u)).powi(3) * (1.0 - 2.0 * u) / (t_end * t_end)
        };
        let yaw = f64::from(0.3f32);
        assert_follows(
            &trajectory,
            4.999,
            0.5,
            |t| [1.0 + 2.0 * step(t), 2.0 - step(t), 3.0 + step(t)],
            |t| facing([2.0, -1.0, 1.0].map(|d| d * curve(t)), [yaw.cos(), yaw.sin(), 0.0]),
        );
        assert_bound(&trajectory, 6000, 0.99);
    }

    /// The Bernstein sum of a leg in f64, by binomials instead of de Casteljau's algorithm.
    fn bernstein_sum(points: &[DVec3], u: f64) -> DVec3 {
        let degree = points.len() as i32 - 1;
        let mut binomial = 1.0;
        let mut sum = DVec3::ZERO;
        for (i, point) in (0..).zip(points) {
            sum += *point * binomial * u.powi(i) * (1.0 - u).powi(degree - i);
            binomial *= f64::from(degree - i) / f64::from(i + 1);
        }
        sum
    }

    #[test]
    fn a_leg_flown_through_is_its_own_derivative() {
        let config = through();
        let trajectory = WaypointPath::new(&config, PERIOD).unwrap();
        let mut from = Leg::to(config.start_world, 0.0);
        for (segment, leg) in trajectory.segments.iter().zip(&config.legs) {
            let t_leg = f64::from(segment.ticks) * f64::from(PERIOD);
            let points = control_points(&from, leg, t_leg);
            let position = |u: f64| bernstein_sum(&points, u).to_array();
            for u in [0.0, 0.1, 0.25, 0.5, 0.75, 0.9f32, 1.0] {
                let got = segment.reference(u);
                let derivatives =
                    [got.velocity_world, got.acceleration_world, got.jerk_world, got.snap_world];
                for (order, got) in (1..).zip(derivatives) {
                    let exact = DVec3::from(derivative(&position, u.into(), 0.005, order));
                    let exact = exact / t_leg.powi(order as i32);
                    let error = (got.as_dvec3() - exact).length();
                    assert!(error < 5e-6 * (1.0 + exact.length()), "order {order} at {u}: {error}");
                }
            }
            from = *leg;
        }
    }

    #[test]
    fn joints_are_continuous_to_the_snap_and_pass_the_waypoints() {
        let config = through();
        let trajectory = WaypointPath::new(&config, PERIOD).unwrap();
        let mut from = Leg::to(config.start_world, 0.0);
        for (segment, leg) in trajectory.segments.iter().zip(&config.legs) {
            for (waypoint, at) in [(&from, segment.reference(0.0)), (leg, segment.reference(1.0))] {
                let close = |a: Vec3, b: Vec3| assert!((a - b).length() < 2e-5, "{a} {b}");
                close(at.position_world, waypoint.position_world);
                close(at.velocity_world, waypoint.velocity_world);
                close(at.acceleration_world, waypoint.acceleration_world);
                close(at.jerk_world, Vec3::ZERO);
                close(at.snap_world, Vec3::ZERO);
            }
            from = *leg;
        }
    }

    #[test]
    fn the_value_alone_has_the_bits_of_the_value_with_derivatives() {
        let trajectory = WaypointPath::new(&through(), PERIOD).unwrap();
        for segment in &trajectory.segments {
            for i in 0..=BOUND_SAMPLES {
                let u = f32::from(i) / f32::from(BOUND_SAMPLES);
                let value = bernstein(segment.acceleration, u).value;
                assert_eq!(bernstein_value(segment.acceleration, u), value, "{u}");
            }
        }
    }

    #[test]
    fn bound_is_kept_and_nearly_attained() {
        assert_bound(&WaypointPath::new(&through(), PERIOD).unwrap(), 13_000, 0.98);
        let still = path(&[Leg::to(Vec3::new(1.0, 2.0, 3.0), 1.0)]);
        assert_eq!(WaypointPath::new(&still, PERIOD).unwrap().acceleration_bound(), 0.0);
    }

    #[test]
    fn holds_the_last_point_for_ever() {
        let trajectory = WaypointPath::new(&through(), PERIOD).unwrap();
        for tick in [12_500, 1_000_000_000, u64::MAX] {
            let reference = trajectory.reference(tick);
            assert_eq!(reference.position_world, Vec3::new(6.0, -4.0, 5.0));
            assert_eq!(reference.velocity_world, Vec3::ZERO);
        }
        let last = trajectory.reference(12_499).position_world;
        assert!((last - Vec3::new(6.0, -4.0, 5.0)).length() < 1e-5);
    }

    #[test]
    fn a_path_built_in_place_of_another_is_the_path_built_anew() {
        let (long, short) = (through(), path(&[Leg::to(Vec3::new(2.0, 1.0, 3.0), 4.0)]));
        let mut slot = WaypointPath::new(&long, PERIOD).unwrap();
        let checked = short.check(2e-3).unwrap();
        checked.build_into(&mut slot);
        assert_eq!(slot, WaypointPath::new(&short, 2e-3).unwrap());
        assert_eq!(checked.acceleration_bound(), slot.acceleration_bound());
        assert_eq!((slot.segments.len(), checked.step_period()), (1, 2e-3));
    }

    #[test]
    fn refuses_each_field_out_of_range() {
        let refused = |config| WaypointPath::new(&config, PERIOD).unwrap_err().parameter;
        let leg = Leg::to(Vec3::X, 4.0);
        let with = |leg| refused(path(&[leg, Leg::to(Vec3::ZERO, 4.0)]));
        assert_eq!(refused(path(&[])), "waypoint_path.legs (count)");
        assert_eq!(with(Leg { duration: 0.009, ..leg }), "waypoint_path.legs.duration");
        assert_eq!(with(Leg { duration: f32::NAN, ..leg }), "waypoint_path.legs.duration");
        let bad = Leg { position_world: Vec3::INFINITY, ..leg };
        assert_eq!(with(bad), "waypoint_path.legs.position_world");
        let bad = Leg { velocity_world: Vec3::new(0.0, f32::NAN, 0.0), ..leg };
        assert_eq!(with(bad), "waypoint_path.legs.velocity_world");
        let bad = Leg { acceleration_world: Vec3::new(0.0, -10.0, 0.0), ..leg };
        assert_eq!(with(bad), "waypoint_path.legs.acceleration_world");
        let bad = Leg { velocity_world: Vec3::X, ..leg };
        assert_eq!(refused(path(&[bad])), "waypoint_path.legs.last.velocity_world");
        let bad = Leg { acceleration_world: Vec3::X, ..leg };
        assert_eq!(refused(path(&[bad])), "waypoint_path.legs.last.acceleration_world");
        let bad = path(&[Leg::to(Vec3::new(50.0, 0.0, 0.0), 4.0)]);
        assert_eq!(refused(bad), "waypoint_path.acceleration_bound");
        let bad = WaypointPathConfig { start_world: Vec3::NAN, ..path(&[leg]) };
        assert_eq!(refused(bad), "waypoint_path.start_world");
        let bad = WaypointPathConfig { yaw: 9.0, ..path(&[leg]) };
        assert_eq!(refused(bad), "waypoint_path.yaw");
        assert_eq!(WaypointPath::new(&path(&[leg]), 0.2).unwrap_err().parameter, "step_period");
    }
}
