//! Speed at which a vehicle comes back from far away: what nested saturation leaves of it.

use ctrl_core::controller::ControllerConfig;
use ctrl_core::vehicle::GRAVITY;

const G: f64 = GRAVITY as f64;

/// Horizontal and vertical speed (m/s), `D1` against the vehicle; infinite where nothing limits it.
///
/// Far away `sig_1` is saturated. On a horizontal axis `M1 = M2 tanh(k2 v) + D1`. On the vertical one the mass
/// adaptation, an integrator, drives `G` to zero: `k2 (M1 - M2 tanh(k2 v)) = k1 v`; without adaptation it is
/// as on the others.
#[must_use]
pub fn return_speeds(law: &ControllerConfig) -> [f64; 2] {
    let cascade = law.cascade();
    let [k1, k2, m1, m2] = [cascade.k1, cascade.k2, cascade.m1, cascade.m2].map(f64::from);
    let d1 = f64::from(law.uncertainty().disturbance_acceleration);
    let damped = |v: f64| m2 * (k2 * v).tanh();
    let along = largest(|v| m1 - d1 - damped(v));
    let up = if cascade.gamma1 > 0.0 { largest(|v| k2 * (m1 - damped(v)) - k1 * v) } else { along };
    [along, up]
}

/// Time (s) after which a vehicle that starts at rest `distance` (m) away stays within a twentieth of that, on a
/// horizontal axis and on the vertical one, in calm air and with attitude and mass as the law has them at the start; infinite beyond
/// five minutes.
#[must_use]
pub fn settling_times(law: &ControllerConfig, distance: f64) -> [f64; 2] {
    [false, true].map(|vertical| {
        let mut motion = Motion::new(law, vertical, distance);
        let mut outside = 0u32;
        for step in 1..=(TIME_MAX / TIME_STEP) as u32 {
            motion.advance();
            if motion.error.abs() > 0.05 * distance {
                outside = step;
            }
        }
        let time = f64::from(outside) * TIME_STEP;
        if time < TIME_MAX { time } else { f64::INFINITY }
    })
}

/// Time (s) after which a lasting `push` (m/s^2) along a horizontal axis, which begins at once, leaves less than `left` (m),
/// with a tilt that follows at once; zero without an estimate of it, infinite beyond five minutes.
#[must_use]
pub fn push_held(law: &ControllerConfig, push: f64, left: f64) -> f64 {
    let integral = law.integral();
    if integral.gamma_d == 0.0 {
        return 0.0;
    }
    let mut motion = Motion::new(law, false, 0.0);
    motion.push = push;
    motion.learning = [integral.gamma_d, integral.acceleration_max].map(f64::from);
    let mut outside = 0u32;
    for step in 1..=(TIME_MAX / TIME_STEP) as u32 {
        motion.advance();
        if motion.error.abs() > left {
            outside = step;
        }
    }
    let time = f64::from(outside) * TIME_STEP;
    if time < TIME_MAX - 1.0 { time } else { f64::INFINITY }
}

/// Longest return (s), and the step of its integration (s).
const TIME_MAX: f64 = 300.0;
const TIME_STEP: f64 = 2e-3;

/// Motion along one axis under (13), (14), (16).
struct Motion {
    gains: [f64; 4],
    d1: f64,
    delta: f64,
    /// `gamma1 m^2` on the vertical axis (s/m^2), else zero.
    adaptation: f64,
    /// Set of `m beta - 1`.
    set: [f64; 2],
    error: f64,
    velocity: f64,
    /// `m beta - 1`.
    excess: f64,
    /// Lasting push (m/s^2), `gamma_d` and `D_c`, and the estimate `d_hat` of it.
    push: f64,
    learning: [f64; 2],
    estimate: f64,
}

impl Motion {
    fn new(law: &ControllerConfig, vertical: bool, distance: f64) -> Self {
        let cascade = law.cascade();
        let mass = f64::from(law.initial().mass);
        let known = law.uncertainty().mass;
        let adaptation = f64::from(cascade.gamma1) * mass * mass;
        Self {
            gains: [cascade.k1, cascade.k2, cascade.m1, cascade.m2].map(f64::from),
            d1: law.uncertainty().disturbance_acceleration.into(),
            delta: cascade.delta_min_translation.into(),
            adaptation: if vertical { adaptation } else { 0.0 },
            set: [known.upper, known.lower].map(|end| mass / f64::from(end) - 1.0),
            error: distance,
            velocity: 0.0,
            excess: 0.0,
            push: 0.0,
            learning: [0.0; 2],
            estimate: 0.0,
        }
    }

    fn advance(&mut self) {
        let [k1, k2, m1, m2] = self.gains;
        let (e, v) = (self.error, self.velocity);
        let [s1, s2] = [m1 * (k1 * e + k2 * v).tanh(), m2 * (k2 * v).tanh()];
        let g = k2 * (s1 + s2) + k1 * v; // (16)
        let smooth_sign = g / (g * g + self.delta * self.delta).sqrt(); // (17)
        let asked = G - s1 - s2 - self.d1 * smooth_sign - self.estimate; // (13)
        let [gain, bound] = self.learning;
        self.estimate = (self.estimate + TIME_STEP * gain * g).clamp(-bound, bound);
        let acting = asked / (1.0 + self.excess);
        let excess = self.excess + TIME_STEP * self.adaptation * g * acting; // (14)
        self.excess = excess.clamp(self.set[0], self.set[1]);
        self.velocity += TIME_STEP * (acting - G + self.push);
        self.error += TIME_STEP * self.velocity;
    }
}

/// Speeds beyond this are none that a vehicle reaches (m/s): there is no limit.
const SPEED_MAX: f64 = 1e3;

/// Zero of a function that falls, in `[0, SPEED_MAX]`; infinite if there is none.
fn largest(falling: impl Fn(f64) -> f64) -> f64 {
    let (mut lower, mut upper) = (0.0, SPEED_MAX);
    for _ in 0..60 {
        let middle = 0.5 * (lower + upper);
        if falling(middle) > 0.0 { lower = middle } else { upper = middle }
    }
    if upper < SPEED_MAX { lower } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::scenario::LoadedScenario;

    /// The speeds that `docs/verification.md` measured.
    #[test]
    fn shipped_gains_return_as_they_were_seen_to() {
        for (name, along, up) in [("paper-saturated", 1.4, 0.49), ("tilt-recovery", 2.4, 0.59)] {
            let loaded = LoadedScenario::open(name, &[]).expect("built in");
            let found = return_speeds(&loaded.scenario().controller);
            assert!((found[0] - along).abs() < 0.1 && (found[1] - up).abs() < 0.01, "{found:?}");
        }
    }
}
