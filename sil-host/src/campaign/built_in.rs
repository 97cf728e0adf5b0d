//! The campaigns that come with the program. Their files are the only place for their numbers.

/// A campaign that comes with the program.
#[derive(Clone, Copy, Debug)]
pub struct BuiltInCampaign {
    /// Name on the command line.
    pub name: &'static str,
    /// Its TOML, comments included.
    pub text: &'static str,
}

macro_rules! built_in {
    ($($name:literal),* $(,)?) => {
        &[$(BuiltInCampaign {
            name: $name,
            text: include_str!(concat!("../../../campaigns/", $name, ".toml")),
        }),*]
    };
}

impl BuiltInCampaign {
    /// Every one of them.
    pub const ALL: &[Self] = built_in![
        "paper-uncertainty",
        "recovery-envelope",
        "torque-limits",
        "sensitivity",
        "guarantees-controller-1",
        "guarantees-tilt-recovery",
        "guarantees-paper-saturated",
    ];

    /// The one of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        Self::ALL.iter().find(|campaign| campaign.name == name)
    }
}
