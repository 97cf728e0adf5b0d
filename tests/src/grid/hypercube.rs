//! Interior of the grid: a seeded Latin hypercube, in which every range is cut into as many strata as
//! there are flights and each stratum is flown once.

use core::f64::consts::TAU;

use glam::DVec3;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use sim::scenario::{InitialCondition, VehicleConfig};

use super::inertia::{between, rigid_body};
use super::{Case, Kind, STEP_PERIODS};

/// Extent of the starts; mass and inertia go across the intervals that the controller is told.
#[derive(Clone, Copy, Debug)]
pub struct Ranges {
    /// Angle between body z and world z (deg).
    pub tilt_deg: f64,
    /// Speed in any direction (m/s).
    pub speed: f64,
    /// Body rate about any axis (rad/s).
    pub rate: f64,
    /// Distance from the scenario's start in any direction (m).
    pub offset: f64,
}

/// Dimensions of the hypercube.
const DIMENSIONS: usize = 24;

/// `count` flights of the built-in scenario `name`.
#[must_use]
pub fn sample(name: &str, ranges: &Ranges, count: usize, seed: u64) -> Vec<Case> {
    let base = Case::built_in(name);
    let points = latin_hypercube(count, seed);
    points.iter().enumerate().map(|(index, point)| at(&base, ranges, index, point)).collect()
}

/// `count` points of the unit cube; in every dimension each of `count` equal strata holds one.
fn latin_hypercube(count: usize, seed: u64) -> Vec<[f64; DIMENSIONS]> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut points = vec![[0.0; DIMENSIONS]; count];
    for dimension in 0..DIMENSIONS {
        let mut strata: Vec<_> = (0..count).collect();
        strata.shuffle(&mut random);
        for (point, stratum) in points.iter_mut().zip(strata) {
            point[dimension] = (stratum as f64 + random.random::<f64>()) / count as f64;
        }
    }
    points
}

/// The flight at a point of the unit cube. Kinds of disturbance and step rates take turns.
fn at(base: &Case, ranges: &Ranges, index: usize, x: &[f64; DIMENSIONS]) -> Case {
    let mut case = base.clone().stepped(STEP_PERIODS[index % STEP_PERIODS.len()]);
    let kind = Kind::ALL[index % Kind::ALL.len()];
    let signs = core::array::from_fn(|i| if x[i] < 0.5 { -1.0 } else { 1.0 });
    case = case.disturbed(kind, signs, x[6]);
    let known = case.scenario.controller.uncertainty();
    case.scenario.vehicle = VehicleConfig {
        mass: between(known.mass.lower.into(), known.mass.upper.into(), x[7]),
        inertia: rigid_body(known.inertia, [x[8], x[9], x[10]]),
    };
    case.scenario.initial = InitialCondition {
        position: base.scenario.initial.position + ranges.offset * inside_ball(&x[11..14]),
        velocity: ranges.speed * inside_ball(&x[14..17]),
        rate_body: ranges.rate * inside_ball(&x[17..20]),
        heading_deg: 360.0 * x[20],
        tilt_deg: ranges.tilt_deg * x[21],
        tilt_direction_deg: 360.0 * x[22],
    };
    case.scenario.seed = (x[23] * 1e9) as u64;
    case
}

/// A direction, evenly over the sphere, times a length evenly in 0 to 1.
fn inside_ball(x: &[f64]) -> DVec3 {
    let (height, azimuth) = (2.0 * x[0] - 1.0, TAU * x[1]);
    let radius = (1.0 - height * height).sqrt();
    x[2] * DVec3::new(radius * azimuth.cos(), radius * azimuth.sin(), height)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stratum_of_every_dimension_holds_one_point() {
        let points = latin_hypercube(20, 7);
        for dimension in 0..DIMENSIONS {
            let mut strata: Vec<_> =
                points.iter().map(|point| (point[dimension] * 20.0) as usize).collect();
            strata.sort_unstable();
            assert!(strata.into_iter().eq(0..20), "dimension {dimension}");
        }
        assert_eq!(points, latin_hypercube(20, 7));
        assert_ne!(points, latin_hypercube(20, 8));
    }
}
