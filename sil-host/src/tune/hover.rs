//! The closed loop of either law, linearised at hover. `docs/tune.md` derives every line.
//!
//! At hover the tilt axes, the vertical axis and the heading do not see each other to first order,
//! and the two tilt axes obey the same equations, each with the gains and bounds of its own axis. Three small
//! loops remain:
//!
//! ```text
//! lateral   e' = v, v' = g x + d1, x' = w, w' = (tau + d2)/J      x: tilt towards the axis
//!           d' = gamma_d (Gp e + Gv v), t' = gamma_t w_e           integral action, where it is on
//! vertical  e' = v, v' = -Kp e - Kv v - g b + d1, b' = gamma1 m^2 g (Gp e + Gv v)    b = m beta - 1
//! heading   x' = w, w' = (tau + d2)/J, t' = gamma_t w_e
//! ```
//! with `Gp = k1 k2 M1`, `Gv = k2^2 (M1 + M2) + k1`, `Kp = k1 M1 + s Gp`, `Kv = k2 (M1 + M2) + s Gv`
//! and `s` the slope of `D1 h(G, delta)`.

use ctrl_core::config::CascadeGains;
use ctrl_core::rotors::RotorModel;
use ctrl_core::vehicle::{GRAVITY, Uncertainty};
use glam::DVec3;
use num_complex::Complex64;

use super::inner::InnerLoop;
use super::linear::{Matrix, STATES, Vector};
use super::pole::{Pole, eigenvalues};
use ctrl_core::controller::ControllerConfig;

const G: f64 = GRAVITY as f64;

/// Values of a law and of its vehicle that the linearisation depends on.
#[derive(Clone, Copy, Debug)]
pub struct Hover {
    /// Gains of the shared cascade.
    pub cascade: CascadeGains,
    /// Known intervals of vehicle and disturbance.
    pub known: Uncertainty,
    /// Step period (s).
    pub dt: f64,
    /// Rate gain `k4` about each axis, in the unit of its law.
    pub k4: DVec3,
    /// `gamma_d` (m/s^2) and `gamma_t` (N m, or 1/s^2) of the integral action; zero where it is off.
    pub lasting: [f64; 2],
    /// Model of the rotors inside the law.
    pub rotors: RotorModel,
    /// `k5` of controller 2 (1/s).
    pub k5: f64,
    /// Controller 2.
    pub(super) saturated: bool,
}

/// A point of the uncertainty at which the loop is linearised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Body axis of the tilt or turn: 0 to 2.
    pub axis: usize,
    /// True mass (kg).
    pub mass: f64,
    /// True moment of inertia of the axis (kg m^2).
    pub inertia: f64,
    /// The law's estimate of it: `a_hat`, or `1/theta_hat` (kg m^2).
    pub inertia_estimate: f64,
    /// Slope of `h(G, delta)` as a share of its slope `1/delta` at zero: 0 (large signals) to 1.
    pub translation_slope: f64,
    /// The same for `h(w_e, delta)`.
    pub rotation_slope: f64,
}

/// Outputs of a loop, as rows that the state multiplies.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outputs {
    /// Position error (m).
    pub position: Vector,
    /// Angle of `q_e` about the axis (rad).
    pub attitude: Vector,
    /// Angle of the body from hover about the axis (rad).
    pub tilt: Vector,
    /// `w_e` (rad/s).
    pub rate_error: Vector,
    /// `G` (1/s).
    pub g: Vector,
}

/// One linear loop: `x' = A x + B1 d1 + B2 d2`, and the same sampled.
#[derive(Clone, Copy, Debug)]
pub struct Loop {
    /// Number of states; all rows and columns beyond are zero.
    pub order: usize,
    /// `A`.
    pub continuous: Matrix,
    /// `(A_d - I)/dt` of the sampled loop, whose wrench is held over the step.
    pub sampled: Matrix,
    /// `B1` [per m/s^2] and `B2` [per N m].
    pub pushes: [Vector; 2],
    /// Outputs.
    pub outputs: Outputs,
    /// Row of the acceleration that the wrench gives: the law, closed over the states.
    pub command: Vector,
    /// The state whose rate that acceleration is.
    pub driven: Vector,
    /// Chain from that acceleration to the first states: coefficient and number of integrators.
    pub chain: [(f64, i32); 4],
    /// Rates of the estimates of integral action, the states that follow the chain.
    pub estimates: [Vector; 2],
    /// The loop over the model of the rotors inside the law, if it has one.
    pub inner: Option<InnerLoop>,
    /// The state that is the body rate, if there is one.
    pub rate: Option<usize>,
    /// Step period (s).
    pub dt: f64,
}

impl Loop {
    /// Poles of the loop in continuous time, slowest first.
    #[must_use]
    pub fn continuous_poles(&self) -> Vec<Pole> {
        eigenvalues(&self.continuous, self.order)
    }

    /// Poles of the sampled loop as `ln(z)/dt`, slowest first.
    #[must_use]
    pub fn sampled_poles(&self) -> Vec<Pole> {
        let roots = eigenvalues(&self.sampled, self.order);
        roots.into_iter().map(|root| Pole::from_difference(root, self.dt)).collect()
    }

    /// Responses of all states from those of the chain, where `integrator` is that of an integrator.
    #[must_use]
    pub fn responses(&self, chain: [Complex64; 4], integrator: Complex64) -> [Complex64; STATES] {
        let mut all = [Complex64::default(); STATES];
        all[..4].copy_from_slice(&chain);
        let chained = self.chain.iter().filter(|(_, power)| *power > 0).count();
        for (i, rate) in self.estimates.iter().enumerate() {
            all[chained + i] += integrator * rate.through(&all);
        }
        all
    }
}

/// Gains of the position loop in the linear range.
#[derive(Clone, Copy, Debug)]
pub struct Stiffness {
    /// `Kp` (1/s^2).
    pub kp: f64,
    /// `Kv` (1/s).
    pub kv: f64,
    /// `Gp` (1/(m s)): slope of `G` with position.
    pub gp: f64,
    /// `Gv` (1/m): slope of `G` with velocity.
    pub gv: f64,
}

impl Hover {
    /// Of `law`, with its bounds of vehicle and disturbance.
    #[must_use]
    pub fn new(law: &ControllerConfig) -> Self {
        let (k4, k5, saturated) = match law {
            ControllerConfig::RobustAdaptive(config) => (config.k4, 0.0, false),
            ControllerConfig::Saturated(config) => (config.k4, config.k5, true),
        };
        Self {
            cascade: *law.cascade(),
            known: *law.uncertainty(),
            dt: law.step_period().into(),
            k4: k4.as_dvec3(),
            lasting: [law.integral().gamma_d, law.integral().gamma_t].map(f64::from),
            rotors: *law.rotors(),
            k5: k5.into(),
            saturated,
        }
    }

    /// Slope of the translational smooth sign term of (13) at zero [m/s^2 per unit of `G`].
    #[must_use]
    pub fn translation_slope(&self) -> f64 {
        f64::from(self.known.disturbance_acceleration)
            / f64::from(self.cascade.delta_min_translation)
    }

    /// Slope of the rotational smooth sign term of (34), (50) at zero about each axis, in the unit of `k4`.
    #[must_use]
    pub fn rotation_slope(&self) -> DVec3 {
        let slope =
            self.known.disturbance_torque.as_dvec3() / f64::from(self.cascade.delta_min_rotation);
        if self.saturated { slope / self.known.inertia.lower.as_dvec3() } else { slope }
    }

    /// Axes among `axes` that differ from those before them in gains or bounds.
    #[must_use]
    pub fn distinct(&self, axes: &[usize]) -> Vec<usize> {
        let of = |axis: usize| {
            let Uncertainty { inertia, disturbance_torque, .. } = &self.known;
            let cascade = &self.cascade;
            let interval = (inertia.lower[axis], inertia.upper[axis]);
            // The auxiliary attitude turns the heading, and leaves the direction of the thrust.
            let turned = axis == 2 && self.rotors.lag > 0.0 && self.saturated;
            (interval, disturbance_torque[axis], cascade.k3[axis], self.k4[axis], turned)
        };
        let mut found: Vec<usize> = Vec::new();
        for &axis in axes {
            if found.iter().all(|&other| of(other) != of(axis)) {
                found.push(axis);
            }
        }
        found
    }

    /// Slope of the rotational smooth sign at zero over `k4`, the largest of the axes.
    #[must_use]
    pub fn slope_over_gain(&self) -> f64 {
        (self.rotation_slope() / self.k4).max_element()
    }

    /// Gains of the position loop at `corner`.
    #[must_use]
    pub fn stiffness(&self, corner: &Corner) -> Stiffness {
        let CascadeGains { k1, k2, m1, m2, .. } = self.cascade;
        let [k1, k2, m1, m2] = [k1, k2, m1, m2].map(f64::from);
        let slope = corner.translation_slope * self.translation_slope();
        let (gp, gv) = (k1 * k2 * m1, k2 * k2 * (m1 + m2) + k1); // (16)
        Stiffness { kp: k1 * m1 + slope * gp, kv: k2 * (m1 + m2) + slope * gv, gp, gv } // (13)
    }

    /// `w'` without disturbance, from the rows of `q_e`'s angle, `w_e`, `mu'` and the estimate of the lasting
    /// torque: (34) or (50).
    fn angular_acceleration(
        &self,
        corner: &Corner,
        [attitude, rate_error, mu_dot, lasting]: [Vector; 4],
    ) -> Vector {
        let slope = corner.rotation_slope * self.rotation_slope()[corner.axis];
        let feedback = -(self.k4[corner.axis] + slope) * rate_error - 0.5 * attitude - lasting;
        if self.saturated {
            (corner.inertia_estimate / corner.inertia) * (feedback + mu_dot)
        } else {
            corner.inertia.recip() * (feedback + corner.inertia_estimate * mu_dot)
        }
    }

    /// The loop over the model of the rotors about the axis of `corner`; none without a model.
    fn inner(&self, corner: &Corner) -> Option<InnerLoop> {
        let [lag, residual] = [self.rotors.lag, self.rotors.residual_lag].map(f64::from);
        let residual_lag = if residual > 0.0 { residual } else { lag };
        let slope = corner.rotation_slope * self.rotation_slope()[corner.axis];
        let (k3, k4) = (f64::from(self.cascade.k3[corner.axis]), self.k4[corner.axis]);
        let k5 = self.k5;
        let inner = if !self.saturated {
            let estimate = corner.inertia_estimate;
            InnerLoop {
                lag,
                residual_lag,
                rate_decay: k4 / estimate,
                attitude_decay: f64::INFINITY,
                gains: [slope / estimate, 0.0, 0.0],
                errors: [0.0; 2],
            }
        } else {
            let heading = corner.axis == 2;
            let turned = 0.5 * (k4 + slope) * (if heading { k3 } else { 0.0 } - k5);
            InnerLoop {
                lag,
                residual_lag,
                rate_decay: k4,
                attitude_decay: 0.5 * k5,
                gains: [slope, 0.5 * (k3 - k5), turned + if heading { 0.5 } else { 0.0 }],
                errors: if heading { [-1.0, 0.5 * (k5 - k3)] } else { [0.0, 0.5 * k5] },
            }
        };
        (lag > 0.0).then_some(inner)
    }

    /// The states of the estimates `d` and `t` that a loop of `order` states gets on top; zero where there is none.
    fn estimates(&self, integral: [bool; 2], mut order: usize) -> ([Vector; 2], usize) {
        let states = [0, 1].map(|i| {
            let on = integral[i] && self.lasting[i] > 0.0;
            order += usize::from(on);
            if on { Vector::unit(order - 1) } else { Vector::ZERO }
        });
        (states, order)
    }

    /// Position and tilt along one horizontal axis: states `e`, `v`, `x`, `w` and, with `integral`, the estimates that
    /// are on.
    #[must_use]
    pub fn lateral(&self, corner: &Corner, integral: bool) -> Loop {
        let [e, v, x, w] = [0, 1, 2, 3].map(Vector::unit);
        let ([d, t], order) = self.estimates([integral; 2], 4);
        let Stiffness { kp, kv, gp, gv } = self.stiffness(corner);
        let (c, k3) = (f64::from(self.cascade.c), f64::from(self.cascade.k3[corner.axis]));
        let [gamma_d, gamma_t] = self.lasting;
        let (on_d, on_t) = (f64::from(d != Vector::ZERO), f64::from(t != Vector::ZERO));
        let g = gp * e + gv * v;
        let learning = on_d * gamma_d * g;
        // The model's v' and v'', for w_d and w_d'.
        let (v_dot, v_dot_dot) = (G * x + d, G * w + learning);
        let g_dot = gp * v + gv * v_dot;
        let desired = -(1.0 / G) * (kp * e + kv * v + d); // (22)
        let desired_rate = -(1.0 / G) * (kp * v + kv * v_dot + learning);
        let learning_dot = on_d * gamma_d * g_dot;
        let desired_acceleration = -(1.0 / G) * (kp * v_dot + kv * v_dot_dot + learning_dot);
        let attitude = x - desired; // twice eps_e
        let mu = desired_rate - 0.5 * k3 * attitude - 2.0 * c * G * g; // (31), (49)
        let mu_dot = desired_acceleration - 0.5 * k3 * (w - desired_rate) - 2.0 * c * G * g_dot;
        let rate_error = w - mu;
        let spin = self.angular_acceleration(corner, [attitude, rate_error, mu_dot, t]);
        let turning = on_t * gamma_t * rate_error;
        let dt = self.dt;
        // Held over the step, the torque makes x a parabola, v a cubic, e a quartic in time.
        let sampled = [
            v + G * (dt / 2.0 * x + dt * dt / 6.0 * w + dt.powi(3) / 24.0 * spin),
            G * (x + dt / 2.0 * w + dt * dt / 6.0 * spin),
            w + dt / 2.0 * spin,
            spin,
        ];
        let estimates = packed([learning, turning], [d, t]);
        Loop {
            order,
            continuous: from_rows([v, G * x, w, spin], 4, estimates),
            sampled: from_rows(sampled, 4, estimates),
            pushes: [v, corner.inertia.recip() * w],
            outputs: Outputs { position: e, attitude, tilt: x, rate_error, g },
            command: spin,
            driven: w,
            chain: [(G, 4), (G, 3), (1.0, 2), (1.0, 1)],
            estimates,
            inner: self.inner(corner),
            rate: Some(3),
            dt,
        }
    }

    /// Height: states `e`, `v` and, while the mass adapts, `b = m beta - 1`.
    #[must_use]
    pub fn vertical(&self, corner: &Corner, adaptive: bool) -> Loop {
        let [e, v, b] = [0, 1, 2].map(Vector::unit);
        let Stiffness { kp, kv, gp, gv } = self.stiffness(corner);
        let dt = self.dt;
        let b = if adaptive { b } else { Vector::ZERO };
        let g = gp * e + gv * v;
        let acceleration = -kp * e - kv * v - G * b;
        let gain = f64::from(self.cascade.gamma1) * corner.mass * corner.mass * G;
        let learning = if adaptive { gain * g } else { Vector::ZERO }; // (14), f = m g
        let rows = |first: Vector| [first, acceleration, learning, Vector::ZERO];
        Loop {
            order: if adaptive { 3 } else { 2 },
            continuous: from_rows(rows(v), 4, [Vector::ZERO; 2]),
            sampled: from_rows(rows(v + dt / 2.0 * acceleration), 4, [Vector::ZERO; 2]),
            pushes: [v, Vector::ZERO],
            outputs: Outputs { position: e, g, ..Outputs::default() },
            command: -kp * e - kv * v,
            driven: v,
            chain: [(1.0, 2), (1.0, 1), (0.0, 0), (0.0, 0)],
            estimates: [Vector::ZERO; 2],
            inner: None, // of the thrust there is no model
            rate: None,
            dt,
        }
    }

    /// Attitude about one axis, the heading among them: states `x`, `w` and, with `integral`, the estimate of the
    /// lasting torque if it is on. Each behaves so by itself.
    #[must_use]
    pub fn attitude(&self, corner: &Corner, integral: bool) -> Loop {
        let [x, w] = [0, 1].map(Vector::unit);
        let ([_, t], order) = self.estimates([false, integral], 2);
        let k3 = f64::from(self.cascade.k3[corner.axis]);
        let rate_error = w + 0.5 * k3 * x;
        let spin = self.angular_acceleration(corner, [x, rate_error, -0.5 * k3 * w, t]);
        let turning = if t == Vector::ZERO { t } else { self.lasting[1] * rate_error };
        let estimates = packed([turning, Vector::ZERO], [t, Vector::ZERO]);
        let rows = |first: Vector| [first, spin, Vector::ZERO, Vector::ZERO];
        Loop {
            order,
            continuous: from_rows(rows(w), 2, estimates),
            sampled: from_rows(rows(w + self.dt / 2.0 * spin), 2, estimates),
            pushes: [Vector::ZERO, corner.inertia.recip() * w],
            outputs: Outputs { attitude: x, tilt: x, rate_error, ..Outputs::default() },
            command: spin,
            driven: w,
            chain: [(1.0, 2), (1.0, 1), (0.0, 0), (0.0, 0)],
            estimates,
            inner: self.inner(corner),
            rate: Some(1),
            dt: self.dt,
        }
    }
}

/// The rates of the estimates that there are, first.
fn packed([first, second]: [Vector; 2], states: [Vector; 2]) -> [Vector; 2] {
    if states[0] == Vector::ZERO { [second, Vector::ZERO] } else { [first, second] }
}

/// The rows of the chain, `chained` of them, and behind them those of the estimates.
fn from_rows(rows: [Vector; 4], chained: usize, estimates: [Vector; 2]) -> Matrix {
    let mut matrix = Matrix::default();
    matrix.0[..4].copy_from_slice(&rows);
    if estimates != [Vector::ZERO; 2] {
        matrix.0[chained..chained + 2].copy_from_slice(&estimates);
    }
    matrix
}
