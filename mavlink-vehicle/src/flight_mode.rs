//! Modes as ground stations see them.
//!
//! `custom_mode` has PX4's numbers, main mode in the third byte and sub-mode in the fourth, whatever autopilot
//! is claimed: under a generic one it is opaque, and `AVAILABLE_MODES` names each. There is no manual mode.

use ctrl_core::mode::navigation::NavigationMode;
use mavlink::dialects::common::MavStandardMode;

const AUTO: u32 = 4;
const OFFBOARD: u32 = 6;

/// A mode of flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlightMode {
    /// The mode of the navigation.
    pub navigation: NavigationMode,
    /// Name for people.
    pub name: &'static str,
    main: u32,
    sub: u32,
    /// MAVLink's standard mode; zero if it has none.
    standard: u8,
}

/// Every mode, as `AVAILABLE_MODES` lists them.
pub(crate) const MODES: [FlightMode; 6] = [
    mode(NavigationMode::Hold, "Hold", AUTO, 3, 0),
    mode(NavigationMode::TakeOff, "Takeoff", AUTO, 2, 8),
    mode(NavigationMode::Mission, "Mission", AUTO, 4, 6),
    mode(NavigationMode::Offboard, "Offboard", OFFBOARD, 0, 0),
    mode(NavigationMode::Return, "Return", AUTO, 5, 5),
    mode(NavigationMode::Land, "Land", AUTO, 6, 7),
];

const fn mode(
    navigation: NavigationMode,
    name: &'static str,
    main: u32,
    sub: u32,
    standard: u8,
) -> FlightMode {
    FlightMode { navigation, name, main, sub, standard }
}

impl FlightMode {
    /// The mode of a mode of the navigation.
    #[must_use]
    pub fn of(navigation: NavigationMode) -> Self {
        let [hold, ..] = MODES;
        // wcet: at most 6 iterations
        MODES.into_iter().find(|mode| mode.navigation == navigation).unwrap_or(hold)
    }

    /// The number in heartbeats.
    #[must_use]
    pub fn custom_mode(self) -> u32 {
        self.main << 16 | self.sub << 24
    }

    pub(crate) fn with_custom(number: u32) -> Option<Self> {
        // wcet: at most 6 iterations
        MODES.into_iter().find(|mode| mode.custom_mode() == number)
    }

    pub(crate) fn with_main_and_sub(main: f32, sub: f32) -> Option<Self> {
        // wcet: at most 6 iterations
        MODES.into_iter().find(|mode| mode.main as f32 == main && mode.sub as f32 == sub)
    }

    pub(crate) fn with_standard(number: f32) -> Option<Self> {
        // wcet: at most 6 iterations
        MODES.into_iter().find(|mode| mode.standard != 0 && f32::from(mode.standard) == number)
    }

    pub(crate) fn standard(self) -> MavStandardMode {
        match self.standard {
            5 => MavStandardMode::MAV_STANDARD_MODE_SAFE_RECOVERY,
            6 => MavStandardMode::MAV_STANDARD_MODE_MISSION,
            7 => MavStandardMode::MAV_STANDARD_MODE_LAND,
            8 => MavStandardMode::MAV_STANDARD_MODE_TAKEOFF,
            _ => MavStandardMode::MAV_STANDARD_MODE_NON_STANDARD,
        }
    }
}
