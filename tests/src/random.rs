//! Seeded random steps, in the ranges of the golden file and beyond, exact in `f32`.

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::paper_example::{Circle, ROBUST_ADAPTIVE_GAINS};
use crate::single_precision::{rounded, rounded_each};
use crate::transcription::{
    Gains, IntegralGains, Law, Memory, Quaternion, ReferencePoint, RotorGains, Truth,
};

/// Step period of the laws that take a random step (s).
pub const STEP_PERIOD: f64 = 1e-4;

/// The input of one evaluation of a law. Every number is an `f32`, but that quaternions are of
/// unit length in `f64`, as the core makes them in `f32`.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Gains.
    pub gains: Gains,
    /// Vehicle.
    pub truth: Truth,
    /// Reference.
    pub reference: ReferencePoint,
    /// Memory.
    pub memory: Memory,
    /// Time since the first step (s).
    pub elapsed: f64,
}

/// A seeded source of steps.
#[derive(Clone, Debug)]
pub struct Source(Xoshiro256PlusPlus);

impl Source {
    /// The same seed gives the same steps.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// Uniform between the ends, rounded.
    pub fn number(&mut self, lower: f64, upper: f64) -> f64 {
        rounded(self.0.random_range(lower..upper))
    }

    /// [`number`](Self::number) for each component.
    pub fn vector(&mut self, lower: f64, upper: f64) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| self.number(lower, upper)))
    }

    /// A unit quaternion, uniform over all rotations.
    pub fn attitude(&mut self) -> Quaternion {
        loop {
            let q: [f64; 4] = std::array::from_fn(|_| self.0.random_range(-1.0..1.0));
            let q = Quaternion::from(q);
            if (0.01..1.0).contains(&q.dot(q)) {
                return rounded_unit(q);
            }
        }
    }

    /// A step of `law`: gains and memory in the golden file's ranges, at most 5 m and 5 m/s beside
    /// one of the two circles, any attitude, at most 3 rad/s about each axis.
    pub fn step(&mut self, law: Law) -> Step {
        let gains = self.gains(law);
        let elapsed = self.number(0.0, 120.0);
        let circle = if self.0.random() { Circle::PAPER } else { Circle::SMALL };
        let reference = rounded_reference(&circle.at(elapsed));
        let truth = Truth {
            p: rounded_each(reference.p + self.vector(-5.0, 5.0)),
            v: rounded_each(reference.v + self.vector(-5.0, 5.0)),
            q: self.attitude(),
            w: self.vector(-3.0, 3.0),
        };
        let memory = self.memory(law, &gains, elapsed);
        Step { gains, truth, reference, memory, elapsed }
    }

    /// [`step`](Self::step) with integral action; some estimates are on the border of their sets.
    pub fn step_with_integral(&mut self, law: Law) -> Step {
        let mut step = self.step(law);
        let integral = IntegralGains {
            d_c: self.number(0.05, 0.5),
            gamma_d: self.number(0.02, 0.5),
            d_t: self.number(0.005, 0.04),
            gamma_t: self.number(0.005, 1.0),
        };
        let d_hat = self.inside(integral.d_c);
        step.gains.integral = integral;
        step.memory.d_hat = DVec3::new(d_hat.x, d_hat.y, 0.0);
        let bound = step.gains.lasting_torque_bound(law);
        step.memory.lasting_torque = self.inside_each(bound);
        step
    }

    /// [`step`](Self::step) with other gains, limits and bounds about each axis; every other one with integral
    /// action.
    pub fn step_with_unlike_axes(&mut self, law: Law) -> Step {
        let integral = self.0.random();
        let mut step = if integral { self.step_with_integral(law) } else { self.step(law) };
        let gains = &mut step.gains;
        for unlike in [&mut gains.k3, &mut gains.k4, &mut gains.gamma2] {
            *unlike = rounded_each(*unlike * self.vector(0.3, 1.0));
        }
        gains.d2 = rounded_each(gains.d2 * self.vector(0.1, 1.0));
        gains.m_tau = rounded_each(gains.m_tau * self.vector(0.2, 1.5));
        // The estimates of the step are brought inside; the core reports their rates before projection.
        gains.j = [self.vector(0.02, 0.05), self.vector(0.08, 0.15)];
        let (lower, upper) = (1.001 * gains.j[0], 0.999 * gains.j[1]);
        let memory = &mut step.memory;
        memory.a_hat = rounded_each(memory.a_hat.clamp(lower, upper));
        memory.theta_hat = rounded_each(memory.theta_hat.clamp(upper.recip(), lower.recip()));
        let bound = step.gains.lasting_torque_bound(law);
        if integral {
            step.memory.lasting_torque = self.inside_each(bound);
        }
        step
    }

    /// [`step_with_unlike_axes`](Self::step_with_unlike_axes) behind rotors that lag, every other one with a lead. They
    /// are at rest before it, as after `resume`.
    pub fn step_behind_rotors(&mut self, law: Law) -> Step {
        let mut step = self.step_with_unlike_axes(law);
        let lag = self.number(0.005, 0.3);
        let left = if self.0.random() { 1.0 } else { self.number(0.1, 1.0) };
        step.gains.rotors =
            RotorGains { lag, residual_lag: rounded(left * lag), dt: rounded(STEP_PERIOD) };
        step
    }

    /// Components within `bound`, one in four at either end.
    fn inside(&mut self, bound: f64) -> DVec3 {
        self.inside_each(DVec3::splat(bound))
    }

    /// Components within those of `bound`, one in four at either end.
    fn inside_each(&mut self, bound: DVec3) -> DVec3 {
        let stretched = self.vector(-4.0 / 3.0, 4.0 / 3.0) * bound;
        rounded_each(stretched).clamp(-bound, bound)
    }

    fn gains(&mut self, law: Law) -> Gains {
        let limit = if law == Law::RobustAdaptive { 4.0 } else { 0.45 };
        rounded_gains(&Gains {
            m1: self.number(0.1, limit),
            m2: self.number(0.1, limit),
            k1: self.number(0.1, 1.5),
            k2: self.number(0.2, 2.0),
            k3: DVec3::splat(self.number(0.5, 5.0)),
            k4: DVec3::splat(self.number(0.5, 5.0)),
            k5: self.number(0.2, 1.5),
            c: self.number(0.001, 0.1),
            ..ROBUST_ADAPTIVE_GAINS
        })
    }

    fn memory(&mut self, law: Law, gains: &Gains, elapsed: f64) -> Memory {
        let at_rest = law == Law::RobustAdaptive || self.0.random();
        let tilt = if at_rest { DVec3::ZERO } else { self.vector(-0.3, 0.3) };
        Memory {
            decay: (-2.0 * gains.delta_1 * elapsed).exp(),
            beta: self.number(1.01, 1.42),
            a_hat: self.vector(0.031, 0.119),
            theta_hat: self.vector(8.4, 33.2),
            pi_hat: self.vector(-1.0, 1.0),
            q_a: rounded_unit(Quaternion { eta: 1.0, eps: tilt }),
            w_a: if at_rest { DVec3::ZERO } else { self.vector(-1.0, 1.0) },
            acting: DVec3::ZERO,
            q_e: None,
            r2: DVec3::ZERO,
            d_hat: DVec3::ZERO,
            lasting_torque: DVec3::ZERO,
        }
    }
}

/// Gains in `f32`, widened.
#[must_use]
pub fn rounded_gains(gains: &Gains) -> Gains {
    Gains {
        m1: rounded(gains.m1),
        m2: rounded(gains.m2),
        k1: rounded(gains.k1),
        k2: rounded(gains.k2),
        k3: rounded_each(gains.k3),
        k4: rounded_each(gains.k4),
        k5: rounded(gains.k5),
        c: rounded(gains.c),
        gamma1: rounded(gains.gamma1),
        gamma2: rounded_each(gains.gamma2),
        gamma3: rounded(gains.gamma3),
        d1: rounded(gains.d1),
        d2: rounded_each(gains.d2),
        delta_1: rounded(gains.delta_1),
        delta_min_translation: rounded(gains.delta_min_translation),
        delta_min_rotation: rounded(gains.delta_min_rotation),
        m: gains.m.map(rounded),
        j: gains.j.map(rounded_each),
        m_tau: rounded_each(gains.m_tau),
        g: rounded(gains.g),
        integral: IntegralGains {
            d_c: rounded(gains.integral.d_c),
            gamma_d: rounded(gains.integral.gamma_d),
            d_t: rounded(gains.integral.d_t),
            gamma_t: rounded(gains.integral.gamma_t),
        },
        rotors: RotorGains {
            lag: rounded(gains.rotors.lag),
            residual_lag: rounded(gains.rotors.residual_lag),
            dt: rounded(gains.rotors.dt),
        },
    }
}

/// Rounded, then of unit length in `f64`.
#[must_use]
pub fn rounded_unit(q: Quaternion) -> Quaternion {
    let q = q.normalised();
    Quaternion { eta: rounded(q.eta), eps: rounded_each(q.eps) }.normalised()
}

/// A reference in `f32`, widened.
#[must_use]
pub fn rounded_reference(r: &ReferencePoint) -> ReferencePoint {
    ReferencePoint {
        p: rounded_each(r.p),
        v: rounded_each(r.v),
        a: rounded_each(r.a),
        jerk: rounded_each(r.jerk),
        snap: rounded_each(r.snap),
        b2: rounded_each(r.b2),
        b2_dot: rounded_each(r.b2_dot),
        b2_ddot: rounded_each(r.b2_ddot),
    }
}
