//! Cost of the control ticks of a flight on the vehicle.

use std::fmt;

use ctrl_core::vehicle::VehicleState;

/// Unit of the cost of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CostUnit {
    /// Instructions; one is this many counts of the image's counter.
    Instructions {
        /// Counts in an instruction.
        counts: u32,
    },
    /// Cycles of the processor.
    Cycles,
}

impl CostUnit {
    /// The unit on the board of that name, if an emulated one counts in this one.
    #[must_use]
    pub fn on(self, board: &str) -> Self {
        if board.starts_with("emulated") { self } else { Self::Cycles }
    }

    /// The cost for a count of the image.
    #[must_use]
    pub fn cost(self, count: u32) -> u32 {
        match self {
            Self::Instructions { counts } => count / counts.max(1),
            Self::Cycles => count,
        }
    }
}

impl fmt::Display for CostUnit {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Instructions { .. } => "instructions",
            Self::Cycles => "cycles",
        })
    }
}

/// Smallest, mean and largest cost of a control tick, and the input of the largest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepCost {
    ticks: u64,
    sum: u64,
    minimum: u32,
    maximum: Option<(u32, u64, VehicleState)>,
}

impl StepCost {
    /// Takes in a tick of flight: its cost and its sample.
    pub fn observe(&mut self, tick: u64, cost: u32, sample: &VehicleState) {
        self.minimum = if self.ticks == 0 { cost } else { self.minimum.min(cost) };
        if self.maximum.is_none_or(|(maximum, ..)| cost > maximum) {
            self.maximum = Some((cost, tick, *sample));
        }
        self.ticks += 1;
        self.sum += u64::from(cost);
    }

    /// The smallest cost; zero before the first tick.
    #[must_use]
    pub fn minimum(&self) -> u32 {
        self.minimum
    }

    /// The mean cost; NaN before the first tick.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.sum as f64 / self.ticks as f64
    }

    /// The largest cost, the first tick that had it, and the tick's sample.
    #[must_use]
    pub fn maximum(&self) -> Option<(u32, u64, VehicleState)> {
        self.maximum
    }
}

impl fmt::Display for StepCost {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some((maximum, tick, sample)) = self.maximum else { return out.write_str("no tick") };
        write!(
            out,
            "{} to {maximum}, mean {:.1}; most at tick {tick}: ",
            self.minimum,
            self.mean()
        )?;
        let VehicleState { position_world, velocity_world, attitude, rate_body } = sample;
        write!(out, "position {position_world}, velocity {velocity_world}, ")?;
        write!(out, "attitude {attitude}, rate {rate_body}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn instructions_are_counted_in_the_emulator_and_cycles_on_a_board() {
        let unit = CostUnit::Instructions { counts: 4 };
        assert_eq!(unit.on("emulated STM32F405").cost(8000), 2000);
        assert_eq!(unit.on("STM32F405").cost(8000), 8000);
        assert_eq!(unit.on("STM32F405").to_string(), "cycles");
    }

    #[test]
    fn the_first_largest_cost_keeps_its_input() {
        let mut cost = StepCost::default();
        for (tick, spent) in [3, 9, 1, 9, 8].into_iter().enumerate() {
            cost.observe(tick as u64, spent, &VehicleState::at_rest(Vec3::X * tick as f32));
        }
        assert_eq!((cost.minimum(), cost.mean()), (1, 6.0));
        assert_eq!(cost.maximum(), Some((9, 1, VehicleState::at_rest(Vec3::X))));
    }
}
