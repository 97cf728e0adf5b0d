//! The guarantee on V: it obeys the balance at every tick, and decreases outside its ultimate set.

use super::balance::Balance;
use super::function::{EvaluatedBlock, Evaluator, OUTSIDE_THE_PROOF};
use crate::guarantee::GuaranteeConfig;
use crate::guarantee::block::Block;
use crate::guarantee::verdict::{Extreme, Requirement, Verdict};
use crate::lanes::{LANES, Scalars, all, later};
use crate::plant::PlantParameters;
use crate::plant::actuation::{ActuationConfig, Limits};
use ctrl_core::controller::ControllerConfig;

/// Monitor of V over a flight.
#[derive(Clone, Debug)]
pub(crate) struct LyapunovMonitor {
    evaluator: Evaluator,
    window_length: f64,
    /// `true` if the controller receives the truth, and a command within the rotor limits acts at once and
    /// exactly or lags behind a law with a model of that; otherwise nothing is guaranteed of V.
    is_prompt: bool,
    limits: Option<Limits>,
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

/// `true` if `law` takes the torque of rotors that lag as it acts: its balance holds behind them.
fn models_rotors(law: &ControllerConfig, actuation: &ActuationConfig) -> bool {
    law.rotors().lag > 0.0 && actuation.delay.is_none_or(|delay| delay == 0.0)
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

/// Terms of the balance over each tick of a block, for the monitor's sums.
struct Terms {
    /// Time (s) and V at the end of each tick.
    time: [f64; LANES],
    value: [f64; LANES],
    change: [f64; LANES],
    excess: [f64; LANES],
    model: [f64; LANES],
    disturbance: [f64; LANES],
    surplus: [f64; LANES],
}

impl LyapunovMonitor {
    /// For `law` on the vehicle with the true `parameters` and `actuation`.
    pub fn new(
        config: &GuaranteeConfig,
        law: &ControllerConfig,
        parameters: &PlantParameters,
        actuation: &ActuationConfig,
    ) -> Self {
        let none = Extreme::default();
        let modelled = models_rotors(law, actuation);
        let lag = actuation.rotor_lag.filter(|_| modelled).unwrap_or_default();
        Self {
            evaluator: Evaluator::new(law, parameters).behind_rotors(lag),
            window_length: config.lyapunov_window,
            is_prompt: actuation.is_prompt() || modelled,
            limits: actuation.limits(),
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

    /// Evaluates V at the ticks of the block that follows the latest one.
    pub fn evaluate(&mut self, block: &mut EvaluatedBlock) {
        self.evaluator.evaluate_block(&block.ticks, &mut block.v);
        let (values, times) = (block.v.value.to_array(), &block.ticks.time);
        let last = block.ticks.count() - 1;
        if self.latest.value().is_none() {
            self.start = Extreme::at(values[0], times[0]);
        }
        self.latest = Extreme::at(values[last], times[last]);
    }

    /// Judges the balance over the first `count` ticks of `from`, which `next` follows.
    pub fn judge(&mut self, from: &EvaluatedBlock, next: &EvaluatedBlock, count: usize) {
        let terms = self.terms(from, next);
        for lane in 0..count {
            if self.excludes(&from.ticks, lane) {
                let count = self.excluded.value().unwrap_or(0.0) + 1.0;
                self.excluded = Extreme::at(count, terms.time[lane]);
                self.window = Window::default();
            } else {
                self.add(&terms, lane);
            }
        }
    }

    /// `true` if the proof does not cover the tick that begins at that of `lane`.
    #[inline]
    fn excludes(&self, ticks: &Block, lane: usize) -> bool {
        let cut = |limits: Limits| self.is_prompt && limits.cuts(&ticks.command[lane]);
        ticks.status[lane].intersects(OUTSIDE_THE_PROOF) || self.limits.is_some_and(cut)
    }

    fn terms(&self, from: &EvaluatedBlock, next: &EvaluatedBlock) -> Terms {
        let p = &self.evaluator.parameters;
        let balance = Balance::new(p, from, next);
        let surplus = all(p.dt) * (balance.decrease - balance.perturbation()) - balance.allowance();
        Terms {
            time: later(Scalars::new(from.ticks.time), Scalars::new(next.ticks.time)).to_array(),
            value: later(from.v.value, next.v.value).to_array(),
            change: balance.change.to_array(),
            excess: balance.excess(p.dt).to_array(),
            model: balance.model.to_array(),
            disturbance: (balance.disturbance - balance.smoothing).to_array(),
            surplus: surplus.to_array(),
        }
    }

    fn add(&mut self, terms: &Terms, lane: usize) {
        let (time, value) = (terms.time[lane], terms.value[lane]);
        self.excess.highest(terms.excess[lane], time);
        self.model.highest(terms.model[lane], time);
        self.disturbance.highest(terms.disturbance[lane], time);
        let window = &mut self.window;
        if window.duration == 0.0 {
            window.start = value - terms.change[lane];
        }
        window.duration += self.evaluator.parameters.dt;
        window.surplus += terms.surplus[lane];
        window.value = value;
        if window.duration >= self.window_length {
            if window.surplus > 0.0 {
                self.outside += window.duration;
                self.rise.highest(window.value - window.start, time);
            }
            self.window = Window::default();
        }
    }

    /// The rows of the table so far.
    pub fn verdicts(&self) -> Vec<Verdict> {
        let info = Requirement::Information;
        let zero = Requirement::AtMost(0.0);
        // Without a tick on which the command acted exactly there is nothing to judge.
        let is_judged = self.is_prompt && (self.limits.is_none() || self.excess.value().is_some());
        let balanced = if is_judged { zero } else { info };
        let weather = if self.disturbance.value().is_some() { zero } else { balanced };
        let equation = if self.evaluator.parameters.saturated.is_some() { "(53)" } else { "(36)" };
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
