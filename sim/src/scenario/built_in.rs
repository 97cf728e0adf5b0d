//! The scenarios that come with the program. Their files are the only place for their numbers.

/// A scenario that comes with the program.
#[derive(Clone, Copy, Debug)]
pub struct BuiltIn {
    /// What to call it on the command line.
    pub name: &'static str,
    /// Its TOML, comments included.
    pub text: &'static str,
}

/// What `run` flies when nothing is named: the paper's two simulations.
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
    "tilt-recovery",
    "waypoints",
];

impl BuiltIn {
    /// The one of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        BUILT_IN.iter().find(|scenario| scenario.name == name)
    }
}
