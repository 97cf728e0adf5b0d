//! The guarantee on V: it obeys the balance at every tick, and decreases outside its ultimate set.

use super::balance::{Balance, balance};
use super::function::OUTSIDE_THE_PROOF;
use super::parameters::Parameters;
use crate::guarantee::verdict::{Extreme, Requirement, Verdict};
use crate::guarantee::{GuaranteeConfig, Monitor};
use crate::observer::Observer;
use crate::plant::PlantParameters;
use crate::plant::actuation::{ActuationConfig, Limits};
use crate::tick::Tick;
use ctrl_core::controller::ControllerConfig;

/// Monitor of V over a flight.
#[derive(Clone, Debug)]
pub struct LyapunovMonitor {
    parameters: Parameters,
    window_length: f64,
    /// `true` if the controller receives the truth and a command within the rotor limits acts at once and
    /// exactly; otherwise nothing is guaranteed of V.
    is_prompt: bool,
    limits: Option<Limits>,
    previous: Option<Tick>,
    window: Window,
    excess: Extreme,
    rise: Extreme,
    disturbance: Extreme,
    model: Extreme,
    start: Extreme,
    latest: Extreme,
    excluded: Extreme,
    /// Time in windows over which V had to fall (s).
    outside: f64,
}

/// Sums over one window.
#[derive(Clone, Copy, Debug, Default)]
struct Window {
    start: f64,
    value: f64,
    duration: f64,
    /// Sum of `dt (W - rho) - A`: positive when V must have fallen.
    surplus: f64,
}

impl LyapunovMonitor {
    /// For `law` on the vehicle with the true `parameters` and `actuation`.
    #[must_use]
    pub fn new(
        config: &GuaranteeConfig,
        law: &ControllerConfig,
        parameters: &PlantParameters,
        actuation: &ActuationConfig,
    ) -> Self {
        let none = Extreme::default();
        Self {
            parameters: Parameters::new(law, parameters),
            window_length: config.lyapunov_window,
            is_prompt: actuation.is_prompt(),
            limits: actuation.limits(),
            previous: None,
            window: Window::default(),
            excess: none,
            rise: none,
            disturbance: none,
            model: none,
            start: none,
            latest: none,
            excluded: Extreme::at(0.0, 0.0),
            outside: 0.0,
        }
    }

    /// Judges nothing of V: the controller receives an estimate.
    pub fn set_by_estimate(&mut self) {
        self.is_prompt = false;
    }

    /// `true` if the proof does not cover the tick after this one.
    #[inline]
    fn excludes(&self, tick: &Tick) -> bool {
        let cut = |limits: Limits| self.is_prompt && limits.cuts(&tick.output.wrench);
        tick.output.status.intersects(OUTSIDE_THE_PROOF) || self.limits.is_some_and(cut)
    }

    fn add(&mut self, balance: &Balance, tick: &Tick) {
        let evaluation = &tick.evaluation;
        let dt = self.parameters.dt;
        self.excess.highest(balance.excess(dt), tick.time);
        self.model.highest(balance.model, tick.time);
        self.disturbance.highest(balance.disturbance - balance.smoothing, tick.time);
        let window = &mut self.window;
        if window.duration == 0.0 {
            window.start = evaluation.value - balance.change;
        }
        window.duration += dt;
        window.surplus += dt * (balance.decrease - balance.perturbation()) - balance.allowance();
        window.value = evaluation.value;
        if window.duration >= self.window_length {
            if window.surplus > 0.0 {
                self.outside += window.duration;
                self.rise.highest(window.value - window.start, tick.time);
            }
            self.window = Window::default();
        }
    }
}

impl Observer for LyapunovMonitor {
    fn observe(&mut self, tick: &Tick) {
        let evaluation = &tick.evaluation;
        if let Some(before) = &self.previous {
            if self.excludes(before) {
                let count = self.excluded.value().unwrap_or(0.0) + 1.0;
                self.excluded = Extreme::at(count, tick.time);
                self.window = Window::default();
            } else {
                let balance = balance(&self.parameters, before, tick);
                self.add(&balance, tick);
            }
        } else {
            self.start = Extreme::at(evaluation.value, tick.time);
        }
        self.latest = Extreme::at(evaluation.value, tick.time);
        self.previous = Some(*tick);
    }
}

impl Monitor for LyapunovMonitor {
    fn verdicts(&self) -> Vec<Verdict> {
        let info = Requirement::Information;
        let zero = Requirement::AtMost(0.0);
        // Without a tick on which the command acted exactly there is nothing to judge.
        let is_judged = self.is_prompt && (self.limits.is_none() || self.excess.value().is_some());
        let balanced = if is_judged { zero } else { info };
        let weather = if self.disturbance.value().is_some() { zero } else { balanced };
        let equation = if self.parameters.saturated.is_some() { "(53)" } else { "(36)" };
        let row = |name, unit, requirement, extreme| {
            Verdict::new((name, equation, unit), requirement, extreme)
        };
        // A flight that starts inside the ultimate set may never leave it.
        let falls = if self.outside > 0.0 { balanced } else { info };
        let outside = Extreme::at(self.outside, self.latest.time().unwrap_or_default());
        vec![
            row("Lyapunov balance residual, largest", "1/s", balanced, self.excess),
            row("increase of V over a window outside its ultimate set", "-", falls, self.rise),
            row("disturbance term of V' less its bound", "1/s", weather, self.disturbance),
            row("time outside the ultimate set", "s", info, outside),
            row("V at the start", "-", info, self.start),
            row("V at the end", "-", info, self.latest),
            row("perturbation of V' by the model-based v', peak", "1/s", info, self.model),
            row("ticks excluded from the balance check", "ticks", info, self.excluded),
        ]
    }
}
