//! Corners of the grid: every end of the inertia with both ends of the mass.

use sim::scenario::VehicleConfig;

use super::inertia::ends;
use super::{Case, Kind, STEP_PERIODS};

/// The built-in scenario `name` on vehicles at the ends of mass and inertia, leaning by `tilt_deg` in
/// directions all around, with kinds of disturbance and step rates taking turns.
#[must_use]
pub fn corners(name: &str, tilt_deg: f64) -> Vec<Case> {
    let base = Case::built_in(name);
    let known = *base.scenario.controller.uncertainty();
    let masses = [known.mass.lower, known.mass.upper];
    let vehicles = masses.into_iter().flat_map(|mass| {
        ends(known.inertia).map(|inertia| VehicleConfig { mass: mass.into(), inertia })
    });
    vehicles
        .enumerate()
        .map(|(index, vehicle)| {
            let mut case = base.clone().stepped(STEP_PERIODS[index % STEP_PERIODS.len()]);
            let kind = Kind::ALL[(index + 1) % Kind::ALL.len()];
            let signs =
                core::array::from_fn(|i| if index >> (i % 4) & 1 == 1 { -1.0 } else { 1.0 });
            case = case.disturbed(kind, signs, index as f64 / 14.0);
            case.scenario.vehicle = vehicle;
            case.scenario.initial.tilt_deg = tilt_deg;
            case.scenario.initial.tilt_direction_deg = (137.5 * index as f64) % 360.0;
            case
        })
        .collect()
}
