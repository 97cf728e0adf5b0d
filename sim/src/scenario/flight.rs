//! From a scenario to a vehicle at the first tick.

use ctrl_core::controller::TrackingController;
use ctrl_core::error::ConfigError;
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::saturated::Saturated;
use ctrl_core::trajectory::AnyTrajectory;
use ctrl_core::vehicle::WrenchBounds;

use super::{ControllerConfig, Scenario};
use crate::closed_loop::{Flight, Observer};
use crate::plant::actuation::Actuators;
use crate::plant::disturbance::DisturbanceProcess;
use crate::plant::rigid_body::RigidBody;
use crate::plant::{PlantParameters, PlantState};

/// A flight of whichever controller the scenario chose.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is one of it, and it never moves in flight")]
pub enum AnyFlight {
    /// Controller 1 flies.
    RobustAdaptive(Flight<RobustAdaptive, AnyTrajectory>),
    /// Controller 2 flies.
    Saturated(Flight<Saturated, AnyTrajectory>),
}

macro_rules! of_either {
    ($flight:expr, $inner:ident => $value:expr) => {
        match $flight {
            AnyFlight::RobustAdaptive($inner) => $value,
            AnyFlight::Saturated($inner) => $value,
        }
    };
}

impl AnyFlight {
    /// The vehicle of `scenario` at the first tick.
    ///
    /// # Errors
    /// The parameter that the controller or the trajectory refuses.
    pub fn new(scenario: &Scenario) -> Result<Self, ConfigError> {
        Ok(match &scenario.controller {
            ControllerConfig::RobustAdaptive(config) => {
                Self::RobustAdaptive(start(RobustAdaptive::new(config)?, scenario)?)
            }
            ControllerConfig::Saturated(config) => {
                Self::Saturated(start(Saturated::new(config)?, scenario)?)
            }
        })
    }

    /// Flies `ticks` control ticks; `observer` sees each of them.
    pub fn advance<O: Observer>(&mut self, ticks: u64, observer: &mut O) {
        of_either!(self, flight => flight.advance(ticks, observer));
    }

    /// The set in which every wrench of the controller lies.
    #[must_use]
    pub fn bounds(&self) -> WrenchBounds {
        of_either!(self, flight => flight.controller().bounds())
    }

    /// The plant's state now.
    #[must_use]
    pub fn truth(&self) -> &PlantState {
        of_either!(self, flight => flight.truth())
    }
}

/// The vehicle of `scenario` at the first tick, with another controller in place of its own.
pub fn start<C: TrackingController>(
    controller: C,
    scenario: &Scenario,
) -> Result<Flight<C, AnyTrajectory>, ConfigError> {
    let trajectory = scenario.trajectory.build(controller.step_period())?;
    controller.accept(&trajectory)?;
    let period = f64::from(controller.step_period());
    let parameters = PlantParameters::from(scenario.vehicle);
    let body = RigidBody::new(&parameters, period, scenario.plant_steps_per_tick);
    let actuators = Actuators::new(&scenario.actuation, &parameters, &body);
    let disturbance = DisturbanceProcess::new(&scenario.disturbance, scenario.seed, period);
    let flight = Flight::new(controller, trajectory, body, disturbance, scenario.initial.state());
    Ok(flight.with_actuators(actuators))
}
