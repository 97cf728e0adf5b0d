//! Speed at which a vehicle comes back from far away: what nested saturation leaves of it.

use ctrl_core::controller::ControllerConfig;

/// Horizontal and vertical speed (m/s), `D1` against the vehicle.
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

/// Speeds beyond this are none that a vehicle reaches (m/s).
const SPEED_MAX: f64 = 1e3;

/// Zero of a function that falls, in `[0, SPEED_MAX]`.
fn largest(falling: impl Fn(f64) -> f64) -> f64 {
    let (mut lower, mut upper) = (0.0, SPEED_MAX);
    for _ in 0..60 {
        let middle = 0.5 * (lower + upper);
        if falling(middle) > 0.0 { lower = middle } else { upper = middle }
    }
    lower
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
