//! Built-in scenarios. Their files are the only place for their numbers.

/// A built-in scenario.
#[derive(Clone, Copy, Debug)]
pub struct BuiltIn {
    /// Name on the command line.
    pub name: &'static str,
    /// Its TOML, comments included.
    pub text: &'static str,
}

/// Scenarios that `run` flies by default: the paper's two simulations.
pub const DEFAULT_SCENARIOS: [&str; 2] = ["paper-robust-adaptive", "paper-saturated"];

macro_rules! built_in {
    ($($name:literal),* $(,)?) => {
        &[$(BuiltIn {
            name: $name,
            text: include_str!(concat!("../../../scenarios/", $name, ".toml")),
        }),*]
    };
}

/// Every built-in scenario.
pub const BUILT_IN: &[BuiltIn] = built_in![
    "paper-robust-adaptive",
    "paper-saturated",
    "hover-gusts",
    "lemniscate",
    "sensors-indoors",
    "sensors-lemniscate",
    "sensors-near-ground",
    "sensors-outdoors",
    "sensors-wind",
    "steady-wind",
    "tilt-recovery",
    "waypoints",
];

impl BuiltIn {
    /// The built-in scenario of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        BUILT_IN.iter().find(|scenario| scenario.name == name)
    }
}
