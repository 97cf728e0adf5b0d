//! Rotors between the commanded wrench and the vehicle, `[rotors]` of a scenario: allocation to their limits, a
//! thrust curve, a battery, failures and drag; one file per effect.
//!
//! ```text
//! wrench -> mixer -> throttle u_i -> T_max (V/V_nominal)^2 curve(u_i) -> delay, lag -> part left -> wrench, drag
//! ```

mod battery;
mod drag;
mod failure;
mod frame;
mod mixer;
mod thrust_curve;

pub use battery::{BatteryModel, BatteryState};
pub use failure::RotorFailure;
pub use frame::{Frame, Ring};
pub use thrust_curve::ThrustCurveConfig;

use ctrl_core::allocation::{RotorThrusts, Spin};
use ctrl_core::error::ConfigError;
use ctrl_core::vehicle::{GRAVITY, Wrench};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::actuation::delay::Delay;
use super::actuation::lag::Lag;
use super::actuation::{ActuationConfig, Combine};
use super::rigid_body::RigidBody;
use super::{AppliedWrench, Disturbance, PlantParameters, PlantState};
use drag::RotorDrag;
use mixer::Mixer;

/// `[rotors]` of a scenario; what is absent does not act.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RotorsConfig {
    /// Places, spins and limits.
    pub frame: Frame,
    /// Whether controller 2 is told what the mixer makes of its torque, and takes that for the torque that acts in (39) and (51):
    /// `AdaptiveController::step_limited`.
    #[serde(default)]
    pub tells_law: bool,
    /// Thrust over throttle; the square, known to the mixer, where it is absent.
    pub thrust_curve: Option<ThrustCurveConfig>,
    /// `c`: drag of a rotor per speed through the air, for each root of a newton (N s/m per root newton).
    pub drag: Option<f64>,
    /// The battery; where it is absent, the voltage is the nominal one.
    pub battery: Option<BatteryModel>,
    /// Rotors that become weak or dead.
    #[serde(default)]
    pub failures: Vec<RotorFailure>,
}

impl RotorsConfig {
    fn thrust_curve(&self) -> ThrustCurveConfig {
        self.thrust_curve.unwrap_or(ThrustCurveConfig::SQUARE)
    }

    /// What the table makes untrue of the theorems' assumptions, one sentence each.
    #[must_use]
    pub fn broken_assumptions(&self) -> Vec<String> {
        let mut sentences =
            vec!["the wrench is allocated to rotors, each within its limits".to_owned()];
        if !self.thrust_curve().is_known() {
            sentences.push("the rotors' thrust curve is not the one that the mixer assumes".into());
        }
        if let Some(coefficient) = self.drag.filter(|drag| *drag > 0.0) {
            sentences.push(format!(
                "rotor drag of {coefficient} N s/m per root newton adds to the disturbance, without a bound"
            ));
        }
        if let Some(battery) = &self.battery {
            let followed = if battery.compensation_time.is_some() {
                ", which the mixer follows late"
            } else {
                ", which the mixer does not know"
            };
            sentences
                .push(format!("thrust goes with the square of the battery's voltage{followed}"));
        }
        sentences.extend(self.failures.iter().map(|failure| {
            let RotorFailure { rotor, time, thrust_left, .. } = failure;
            format!("rotor {rotor} gives {} % of its thrust from {time} s on", 100.0 * thrust_left)
        }));
        sentences
    }
}

/// A number for each rotor: its thrust (N), its throttle or a part; zero for those that are not there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Thrusts(pub [f64; Thrusts::MAX]);

impl Thrusts {
    /// Most rotors of a vehicle.
    pub const MAX: usize = ctrl_core::allocation::MAX_ROTORS;
    const ALL_ONE: Self = Self([1.0; Self::MAX]);

    fn times(self, other: Self) -> Self {
        Self(std::array::from_fn(|index| self.0[index] * other.0[index]))
    }
}

impl Combine for Thrusts {
    fn combined(self, a: f64, other: Self, b: f64) -> Self {
        Self(std::array::from_fn(|index| a * self.0[index] + b * other.0[index]))
    }
}

/// The rotors in flight. Before the first command they hover.
#[derive(Clone, Debug)]
pub struct Rotors {
    mixer: Mixer,
    tells_law: bool,
    curve: ThrustCurveConfig,
    thrust_max: Thrusts,
    /// Columns of the torque: that of each rotor for a newton (m).
    torque_arms: [DVec3; Thrusts::MAX],
    battery: Option<(BatteryModel, BatteryState)>,
    failures: Vec<RotorFailure>,
    /// Part of its thrust that each rotor gives now.
    health: Thrusts,
    drag: Option<RotorDrag>,
    delay: Delay<Thrusts>,
    lag: Option<Lag<Thrusts>>,
    step_period: f64,
    tick: u64,
}

impl Rotors {
    /// The rotors of a vehicle with `parameters` that `body` moves; delay and lag are those of `actuation`.
    /// Both tables must have been validated.
    ///
    /// # Errors
    /// Names what the allocation, the curve or the compensation refuses.
    pub fn new(
        config: &RotorsConfig,
        actuation: &ActuationConfig,
        parameters: &PlantParameters,
        body: &RigidBody,
    ) -> Result<Self, ConfigError> {
        let h = body.sub_step_duration();
        let step_period = h * f64::from(body.sub_steps());
        let geometry = config.frame.geometry();
        let (mut torque_arms, mut places) =
            ([DVec3::ZERO; Thrusts::MAX], [DVec3::ZERO; Thrusts::MAX]);
        let mut thrust_max = Thrusts::default();
        for (index, rotor) in geometry.rotors.iter().enumerate() {
            let place = rotor.position_body.as_dvec3();
            let reaction = f64::from(rotor.torque_ratio);
            let spin = if rotor.spin == Spin::Clockwise { reaction } else { -reaction };
            torque_arms[index] = DVec3::new(place.y, -place.x, spin);
            places[index] = place;
            thrust_max.0[index] = rotor.thrust.upper.into();
        }
        let mut mixer = Mixer::new(config, &geometry, step_period)?;
        let battery = config.battery.map(|battery| (battery, battery.at_start()));
        let weight = Wrench { thrust: parameters.mass as f32 * GRAVITY, ..Wrench::default() };
        let throttles = mixer.throttles(&weight, 0.0, battery.as_ref().map(|(_, state)| state));
        let actuation = actuation.in_steps_of(h);
        let mut new = Self {
            mixer,
            tells_law: config.tells_law,
            curve: config.thrust_curve(),
            thrust_max,
            torque_arms,
            battery,
            failures: config.failures.clone(),
            health: failure::health(&config.failures, 0.0),
            drag: config
                .drag
                .filter(|drag| *drag > 0.0)
                .map(|drag| RotorDrag::new(drag, parameters.mass, step_period, places)),
            delay: Delay::new(0.0, Thrusts::default(), body),
            lag: None,
            step_period,
            tick: 0,
        };
        let hover = new.thrusts_of(&throttles);
        new.delay = Delay::new(actuation.delay.unwrap_or_default(), hover, body);
        new.lag = Lag::new(actuation.rotor_lag.unwrap_or_default(), hover, h);
        Ok(new)
    }

    /// Receives the command of a tick, once before each [`advance`](Self::advance). Returns the wrench that acts
    /// at this instant.
    pub fn take(&mut self, command: &Wrench) -> AppliedWrench {
        let battery = self.battery.as_ref().map(|(_, state)| state);
        let throttles = self.mixer.throttles(command, self.time(), battery);
        self.take_throttles(&throttles)
    }

    /// `true` if the law is told what the mixer [makes](Self::made) of its command.
    #[must_use]
    pub fn tells_law(&self) -> bool {
        self.tells_law
    }

    /// Torque that the mixer makes of a command that it would receive now (N m).
    #[must_use]
    pub fn made(&self, command: &Wrench) -> Vec3 {
        let battery = self.battery.as_ref().map(|(_, state)| state);
        let (allocation, _) = self.mixer.clone().allocation(command, self.time(), battery);
        allocation.achieved.torque_body
    }

    /// As [`take`](Self::take), for the thrusts (N) of a flight controller that allocates itself, by throttles of
    /// the assumed curve; none stops the rotors.
    pub fn take_thrusts(&mut self, thrusts: Option<&RotorThrusts>) -> AppliedWrench {
        let throttles = thrusts.map(|thrusts| self.mixer.of_thrusts(thrusts, 1.0));
        self.take_throttles(&throttles.unwrap_or_default())
    }

    fn take_throttles(&mut self, throttles: &Thrusts) -> AppliedWrench {
        self.health = failure::health(&self.failures, self.time());
        let thrusts = self.thrusts_of(throttles);
        self.delay.take(thrusts);
        self.wrench(&self.acting())
    }

    fn time(&self) -> f64 {
        self.tick as f64 * self.step_period
    }

    /// Thrusts of whole rotors at `throttles` and the battery's voltage.
    fn thrusts_of(&self, throttles: &Thrusts) -> Thrusts {
        let supply = self.battery.as_ref().map_or(1.0, |(battery, state)| battery.supply(state));
        let share = |index: usize| self.curve.share(throttles.0[index]);
        Thrusts(std::array::from_fn(|index| supply * self.thrust_max.0[index] * share(index)))
    }

    /// Thrust of each rotor now (N).
    #[must_use]
    pub fn acting(&self) -> Thrusts {
        let whole = self.lag.map_or_else(|| self.delay.acting(0), |lag| lag.now());
        whole.times(self.health)
    }

    fn wrench(&self, thrusts: &Thrusts) -> AppliedWrench {
        let mut made = AppliedWrench::default();
        for (thrust, arm) in thrusts.0.into_iter().zip(self.torque_arms) {
            made.thrust += thrust;
            made.torque_body += thrust * arm;
        }
        made
    }

    /// Adds what the rotors' drag makes at `truth`, for the tick whose command was received last.
    pub fn add_drag(&self, truth: &PlantState, held: &mut Disturbance) {
        if let Some(drag) = &self.drag {
            held.push(drag.acting(&self.acting(), truth, held.wind_world));
        }
    }

    /// The state of the vehicle one step period later, under a held disturbance.
    pub fn advance(
        &mut self,
        body: &RigidBody,
        state: &PlantState,
        held: &Disturbance,
    ) -> PlantState {
        let mut state = *state;
        for step in 0..body.sub_steps() {
            let target = self.delay.acting(step);
            let health = self.health;
            let wrench = |thrusts: Thrusts| self.wrench(&thrusts.times(health));
            state = match self.lag {
                None => body.sub_step_held(&state, &wrench(target), held),
                Some(mut lag) => {
                    let stages = lag.advance(target).map(wrench);
                    self.lag = Some(lag);
                    body.sub_step_varying(&state, &stages, held)
                }
            };
        }
        if let Some((battery, before)) = self.battery {
            let power = battery.power(&self.acting().0);
            self.battery = Some((battery, battery.after(&before, power, self.step_period)));
        }
        self.tick += 1;
        state
    }

    /// The battery, if there is one.
    #[must_use]
    pub fn battery(&self) -> Option<BatteryState> {
        self.battery.map(|(_, state)| state)
    }
}
