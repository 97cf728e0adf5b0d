//! Laws with a model of rotors that lag: V obeys its balance behind such rotors.

use sim::guarantee::{Guarantees, Requirement, Verdict};
use sim::observer::Observer;
use sim::scenario::LoadedScenario;
use sim::tick::Tick;

/// Monitors of a flight whose ticks are tampered with.
struct Tampered<F>(Guarantees, F);

impl<F: Fn(&mut Tick)> Observer for Tampered<F> {
    fn observe(&mut self, tick: &Tick) {
        let mut tick = *tick;
        (self.1)(&mut tick);
        self.0.observe(&tick);
    }
}

fn rows(name: &str, changes: &[&str], ticks: u64, tamper: impl Fn(&mut Tick)) -> Vec<Verdict> {
    let changes: Vec<_> = changes.iter().map(ToString::to_string).collect();
    let loaded = LoadedScenario::open(name, &changes).unwrap_or_else(|error| panic!("{error}"));
    let mut monitors = Tampered(loaded.scenario().monitors(), tamper);
    loaded.flight().expect("valid").observe(ticks, &mut monitors);
    monitors.0.verdicts()
}

fn row<'a>(rows: &'a [Verdict], start: &str) -> &'a Verdict {
    rows.iter().find(|row| row.name.starts_with(start)).expect("a row")
}

const LAWS: [(&str, &str); 2] =
    [("paper-robust-adaptive", "robust_adaptive"), ("paper-saturated", "saturated")];

#[test]
fn v_obeys_its_balance_behind_rotors_that_the_law_models() {
    for (name, key) in LAWS {
        for (lag, residual_lag) in [(0.03, 0.03), (0.03, 0.0075), (0.005, 0.002)] {
            let model =
                format!("controller.{key}.rotors={{lag={lag}, residual_lag={residual_lag}}}");
            let actuation = format!("actuation.rotor_lag={lag}");
            let rows = rows(name, &[&model, &actuation], 20_000, |_| {});
            let balance = row(&rows, "Lyapunov balance residual");
            assert_eq!(balance.requirement, Requirement::AtMost(0.0));
            assert!(balance.pass, "{name} {lag} {residual_lag}: {balance:?}");
        }
    }
}

#[test]
fn a_law_that_takes_the_command_for_what_acts_breaks_the_balance() {
    for (name, key) in LAWS {
        let model = format!("controller.{key}.rotors={{lag=0.03, residual_lag=0.0075}}");
        let command_acts = |tick: &mut Tick| {
            tick.intermediates.acting_torque_body = tick.intermediates.torque_body;
            tick.auxiliary.rate = Default::default();
        };
        let rows = rows(name, &[&model, "actuation.rotor_lag=0.03"], 5_000, command_acts);
        assert!(!row(&rows, "Lyapunov balance residual").pass, "{name}");
    }
}
