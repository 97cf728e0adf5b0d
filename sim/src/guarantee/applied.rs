//! Applied thrust and torque, for a scenario whose actuators deviate from the command.

use super::Monitor;
use super::verdict::{AxisExtremes, Extreme, Requirement, Verdict};
use crate::observer::Observer;
use crate::plant::actuation::{ActuationConfig, Limits};
use crate::tick::Tick;

/// Checks that the applied wrench stays within the rotor limits; counts the commands that do not.
#[derive(Clone, Copy, Debug)]
pub struct Applied {
    shown: bool,
    limits: Option<Limits>,
    thrust: Extreme,
    torque: AxisExtremes,
    highest_torque: Extreme,
    cut: u64,
    latest_cut: f64,
}

impl Applied {
    /// Rows only for a vehicle that is not ideal.
    #[must_use]
    pub fn new(actuation: &ActuationConfig) -> Self {
        Self {
            shown: !actuation.is_ideal(),
            limits: actuation.limits(),
            thrust: Extreme::default(),
            torque: AxisExtremes::new(torque_requirements(actuation)),
            highest_torque: Extreme::default(),
            cut: 0,
            latest_cut: 0.0,
        }
    }

    /// Shows the rows whatever the actuators are.
    pub fn show(&mut self) {
        self.shown = true;
    }

    fn thrust_requirement(&self) -> Requirement {
        let limit = self.limits.and_then(|limits| limits.thrust_max);
        limit.map_or(Requirement::Information, |max| Requirement::Inside(0.0, max.into()))
    }

    fn torque(&self) -> (Requirement, Extreme) {
        match self.limits.and_then(|limits| limits.torque_max) {
            Some(_) => self.torque.tightest(),
            None => (Requirement::Information, self.highest_torque),
        }
    }
}

fn torque_requirements(actuation: &ActuationConfig) -> [Requirement; 3] {
    let limits = actuation.limits().and_then(|limits| limits.torque_max);
    limits.map_or([Requirement::Information; 3], |limits| {
        limits.as_dvec3().to_array().map(Requirement::AtMost)
    })
}

impl Observer for Applied {
    fn observe(&mut self, tick: &Tick) {
        if !self.shown {
            return;
        }
        let applied = &tick.applied;
        match self.thrust_requirement() {
            Requirement::Information => self.thrust.highest(applied.thrust, tick.time),
            limited => self.thrust.tightest(applied.thrust, tick.time, limited),
        };
        let torque = applied.torque_body.abs();
        self.torque.observe(torque, tick.time);
        for component in torque.to_array() {
            self.highest_torque.highest(component, tick.time);
        }
        if self.limits.is_some_and(|limits| limits.cuts(&tick.output.wrench)) {
            self.cut += 1;
            self.latest_cut = tick.time;
        }
    }
}

impl Monitor for Applied {
    fn verdicts(&self) -> Vec<Verdict> {
        if !self.shown {
            return Vec::new();
        }
        let row = |name, unit, requirement, extreme| {
            Verdict::new((name, "-", unit), requirement, extreme)
        };
        let (torque, highest) = self.torque();
        let mut rows = vec![
            row(
                "applied thrust, nearest to its limits",
                "N",
                self.thrust_requirement(),
                self.thrust,
            ),
            row("applied torque, peak about any axis", "N m", torque, highest),
        ];
        rows.extend(self.limits.map(|_| {
            let cut = Extreme::at(self.cut as f64, self.latest_cut);
            row(
                "ticks with a command beyond the rotor limits",
                "ticks",
                Requirement::Information,
                cut,
            )
        }));
        rows
    }
}
