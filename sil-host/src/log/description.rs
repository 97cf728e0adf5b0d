//! Facts about the whole flight in a log.

use ctrl_core::allocation::RotorGeometry;
use ctrl_core::controller::AdaptiveController;
use ctrl_core::error::ConfigError;
use ctrl_core::reference::Reference;
use ctrl_core::trajectory::Trajectory;
use ctrl_core::vehicle::WrenchBounds;
use firmware::vehicle::VEHICLE;
use link::Parameters;

use ctrl_core::controller::ControllerConfig;
use sim::scenario::{LoadedScenario, Scenario, ScenarioError};

/// The program's version.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The commit that the program was built from; the version where that was not known.
pub const COMMIT: &str = env!("GYRFALCON_COMMIT");

/// The version as PX4 writes it: major, minor and patch in a byte each, then the kind of release (0:
/// development).
#[must_use]
pub fn release() -> u32 {
    let mut parts = VERSION.split('.').map(|part| part.parse::<u8>().unwrap_or(0));
    let mut part = || parts.next().unwrap_or(0);
    u32::from_be_bytes([part(), part(), part(), 0])
}

/// Facts known before the flight.
#[derive(Clone, Debug)]
pub struct Description {
    /// The scenario's name.
    pub scenario: String,
    /// The scenario's description.
    pub description: String,
    /// Key of the controller in a scenario file.
    pub controller: &'static str,
    /// Seed of every random number.
    pub seed: u64,
    /// The scenario as TOML, changes included.
    pub toml: String,
    /// Every number of the controller and the true vehicle, by the path of its field.
    pub parameters: Vec<(String, f32)>,
    /// Fixed time between two control ticks (s).
    pub step_period: f64,
    /// The set in which every wrench of the controller lies.
    pub bounds: WrenchBounds,
    /// The rotors that the log allocates the command to: those of the firmware's vehicle.
    pub geometry: Option<RotorGeometry>,
    /// The plant has a battery.
    pub battery: bool,
    /// The reference from start to end, at [`PATH`] instants or, in a short flight, at every tick.
    pub path: Vec<Reference>,
}

/// Most instants of a path: enough that it looks round.
pub const PATH: u64 = 1000;

impl Description {
    /// The description of a scenario's flight.
    ///
    /// # Errors
    /// The parameter that the controller or the trajectory refuses.
    pub fn new(loaded: &LoadedScenario) -> Result<Self, ScenarioError> {
        let scenario = loaded.scenario();
        Ok(Self {
            scenario: scenario.name.clone(),
            description: scenario.description.clone(),
            controller: scenario.controller.key(),
            seed: scenario.seed,
            toml: loaded.text().to_owned(),
            parameters: parameters(scenario),
            step_period: scenario.controller.step_period().into(),
            bounds: loaded.flight()?.controller().bounds(),
            geometry: Some(VEHICLE.geometry.clone()),
            battery: scenario.rotors.as_ref().is_some_and(|rotors| rotors.battery.is_some()),
            path: path(scenario).map_err(|error| loaded.refusal(&error))?,
        })
    }
}

impl Description {
    /// Follows parameters of the controller that have changed since.
    ///
    /// # Errors
    /// Names the parameter that the controller refuses; nothing is then changed.
    pub fn follow(&mut self, controller: &ControllerConfig) -> Result<(), ConfigError> {
        self.bounds = controller.build()?.bounds();
        for (name, value) in parameters_of(controller) {
            let known = self.parameters.iter_mut().find(|(known, _)| *known == name);
            known.into_iter().for_each(|(_, old)| *old = value);
        }
        Ok(())
    }
}

fn path(scenario: &Scenario) -> Result<Vec<Reference>, ConfigError> {
    let trajectory = scenario.trajectory.build(scenario.controller.step_period())?;
    let ticks = scenario.ticks();
    let every = ticks.div_ceil(PATH).max(1) as usize;
    Ok((0..ticks).step_by(every).map(|tick| trajectory.reference(tick)).collect())
}

fn parameters(scenario: &Scenario) -> Vec<(String, f32)> {
    let mut all = parameters_of(&scenario.controller);
    let vehicle = &scenario.vehicle;
    let [x, y, z] = vehicle.inertia.to_array();
    let rest = [
        ("step_period", f64::from(scenario.controller.step_period())),
        ("vehicle.mass", vehicle.mass),
        ("vehicle.inertia.x", x),
        ("vehicle.inertia.y", y),
        ("vehicle.inertia.z", z),
    ];
    all.extend(rest.map(|(name, value)| (name.to_owned(), value as f32)));
    all
}

fn parameters_of(controller: &ControllerConfig) -> Vec<(String, f32)> {
    match controller {
        ControllerConfig::RobustAdaptive(config) => named(config),
        ControllerConfig::Saturated(config) => named(config),
    }
}

/// The names of `docs/protocol.md` with their values.
fn named<C: Parameters>(config: &C) -> Vec<(String, f32)> {
    let all = (0..).map_while(|index| config.parameter_at(index));
    all.map(|(name, value)| (name.to_owned(), value)).collect()
}
