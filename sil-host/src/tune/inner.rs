//! The loop that a law closes inside itself over its model of the rotors, linearised at hover: the demand moves the auxiliary
//! system, which moves the demand. `docs/tune.md` derives it.
//!
//! ```text
//! P(s) = s T_f/(1 + s T_f)                                  share of the demand that does not act yet by the model
//! w_a  = -P y/(s + k4),  x_a = w_a/(s + k5/2)               y: the demand as an angular acceleration
//! y    = row . x + rate w_a + turn x_a' + angle x_a         so  y (1 + P H) = row . x
//! H(s) = (rate + (turn s + angle)/(s + k5/2))/(s + k4)
//! ```

use num_complex::Complex64;

/// Model of the rotors inside a law, and what its auxiliary system adds to the demand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InnerLoop {
    /// `T` of the model (s).
    pub lag: f64,
    /// `T_f` (s).
    pub residual_lag: f64,
    /// `k4` of the auxiliary system (1/s).
    pub rate_decay: f64,
    /// `k5/2` of it (1/s); infinite without an auxiliary attitude.
    pub attitude_decay: f64,
    /// Demand per `w_a` (1/s), per rate of the auxiliary angle (1/s) and per that angle (1/s^2).
    pub gains: [f64; 3],
    /// `q_e` per auxiliary angle, and `w_e` per that angle (1/s); per `w_a` it is -1.
    pub errors: [f64; 2],
}

impl InnerLoop {
    /// `P(s)`.
    #[must_use]
    pub fn missing(&self, s: Complex64) -> Complex64 {
        s * self.residual_lag / (1.0 + s * self.residual_lag)
    }

    /// `H(s)`.
    #[must_use]
    pub fn auxiliary(&self, s: Complex64) -> Complex64 {
        let [rate, turn, angle] = self.gains;
        (rate + (s * turn + angle) * self.turned(s)) / (s + self.rate_decay)
    }

    /// Auxiliary angle per `w_a`.
    fn turned(&self, s: Complex64) -> Complex64 {
        if self.attitude_decay.is_finite() {
            (s + self.attitude_decay).inv()
        } else {
            Complex64::default()
        }
    }

    /// `w_e` per demand through the auxiliary system.
    #[must_use]
    pub fn rate_error(&self, s: Complex64) -> Complex64 {
        let rate = -self.missing(s) / (s + self.rate_decay);
        rate * (self.errors[1] * self.turned(s) - 1.0)
    }
}

/// The model's torque and the auxiliary system in time, per demand as an angular acceleration.
#[derive(Clone, Copy, Debug, Default)]
pub struct InnerState {
    acting: f64,
    rate: f64,
    angle: f64,
}

impl InnerState {
    /// Demand for what the law's row asks of the states.
    #[must_use]
    pub fn demand(&self, of: &InnerLoop, row: f64) -> f64 {
        let [rate, turn, angle] = of.gains;
        row + rate * self.rate + turn * self.turning(of) + angle * self.angle
    }

    /// Advances by `h` (s) with `demand` held; what acts by the model in the mean.
    pub fn advance(&mut self, of: &InnerLoop, demand: f64, h: f64) -> f64 {
        let next = demand + (self.acting - demand) * (-h / of.residual_lag).exp();
        let mean = 0.5 * (self.acting + next);
        let turning = self.turning(of);
        self.rate += h * (mean - demand - of.rate_decay * self.rate);
        self.angle += h * turning;
        self.acting = next;
        mean
    }

    /// What the auxiliary system adds to the angle of `q_e` (rad) and to `w_e` (rad/s).
    #[must_use]
    pub fn errors(&self, of: &InnerLoop) -> [f64; 2] {
        [of.errors[0] * self.angle, of.errors[1] * self.angle - self.rate]
    }

    fn turning(&self, of: &InnerLoop) -> f64 {
        if of.attitude_decay.is_finite() { self.rate - of.attitude_decay * self.angle } else { 0.0 }
    }
}
