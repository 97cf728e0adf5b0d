//! Disturbance of the vehicle: the sum of any of a constant, uniform noise, a sinusoid, gusts and wind, each
//! seeded on its own, so that adding one does not change another.

mod dryden;
mod gust;
mod noise;
mod sinusoid;

pub use dryden::Dryden;
pub use gust::Gust;
pub use noise::Noise;
pub use sinusoid::Sinusoid;

use ctrl_core::config::IntegralAction;
use glam::DVec3;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};

use super::{Disturbance, PlantState};
use dryden::DrydenProcess;
use gust::GustProcess;
use noise::NoiseProcess;
use sinusoid::SinusoidProcess;

/// The disturbances that act; a scenario without any is calm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DisturbanceConfig {
    /// The same at every tick.
    pub constant: Option<Constant>,
    /// Drawn anew at every tick.
    pub noise: Option<Noise>,
    /// Periodic.
    pub sinusoid: Option<Sinusoid>,
    /// Steps.
    pub gust: Option<Gust>,
    /// Wind with turbulence.
    pub dryden: Option<Dryden>,
}

/// A constant disturbance, as of steady wind or a displaced centre of mass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Constant {
    /// World frame (m/s^2).
    pub acceleration: DVec3,
    /// Body axes (N m).
    pub torque: DVec3,
}

impl DisturbanceConfig {
    /// The part of the constant that `integral` estimates: inside its bounds, the acceleration horizontal.
    #[must_use]
    pub fn lasting(&self, integral: &IntegralAction) -> Disturbance {
        let Some(constant) = self.constant else { return Disturbance::default() };
        let inside = |x: DVec3, bound: f32| {
            let bound = DVec3::splat(bound.into());
            x.clamp(-bound, bound)
        };
        let acceleration = inside(constant.acceleration, integral.acceleration_max);
        Disturbance {
            acceleration_world: acceleration.with_z(0.0),
            torque_body: inside(constant.torque, integral.torque_max),
            ..Disturbance::NONE
        }
    }

    /// [`bounds`](Self::bounds) of what is left to `D1` and `D2` beside the part that `integral` estimates.
    #[must_use]
    pub fn bounds_beside(&self, integral: &IntegralAction) -> (f64, DVec3) {
        let lasting = self.lasting(integral);
        let rest = self.constant.map(|constant| Constant {
            acceleration: constant.acceleration - lasting.acceleration_world,
            torque: constant.torque - lasting.torque_body,
        });
        Self { constant: rest, ..*self }.bounds()
    }

    /// Bound of each component of `d1` (m/s^2), and those of `d2` about each body axis (N m), over all time
    /// and seeds.
    #[must_use]
    pub fn bounds(&self) -> (f64, DVec3) {
        let mut bound = Disturbance::default();
        let mut add = |acceleration: DVec3, torque: DVec3| {
            bound.acceleration_world += acceleration.abs();
            bound.torque_body += torque.abs();
        };
        if let Some(constant) = self.constant {
            add(constant.acceleration, constant.torque);
        }
        if let Some(noise) = self.noise {
            add(DVec3::splat(noise.acceleration), noise.torque);
        }
        if let Some(sinusoid) = self.sinusoid {
            add(sinusoid.acceleration, sinusoid.torque);
        }
        if let Some(gust) = self.gust {
            add(DVec3::splat(gust.acceleration), gust.torque);
        }
        if self.dryden.is_some() {
            // Normal turbulence has no bound.
            add(DVec3::INFINITY, DVec3::ZERO);
        }
        (bound.acceleration_world.max_element(), bound.torque_body)
    }
}

/// A source of disturbances in a flight.
pub trait DisturbanceSource {
    /// The disturbance from now to the next tick, on a vehicle in the state `truth`; moves on by one
    /// tick.
    fn advance(&mut self, truth: &PlantState) -> Disturbance;
}

/// The configured disturbance, tick by tick.
#[derive(Clone, Debug)]
pub struct DisturbanceProcess {
    constant: Disturbance,
    noise: Option<NoiseProcess>,
    sinusoid: Option<SinusoidProcess>,
    gust: Option<GustProcess>,
    dryden: Option<DrydenProcess>,
}

impl DisturbanceProcess {
    /// Starts at tick zero; `step_period` (s).
    #[must_use]
    pub fn new(config: &DisturbanceConfig, seed: u64, step_period: f64) -> Self {
        Self {
            constant: config.constant.map_or_else(Disturbance::default, |constant| Disturbance {
                acceleration_world: constant.acceleration,
                torque_body: constant.torque,
                ..Disturbance::NONE
            }),
            noise: config.noise.map(|noise| NoiseProcess::new(&noise, stream(seed, 0))),
            sinusoid: config.sinusoid.map(|wave| SinusoidProcess::new(&wave, step_period)),
            gust: config.gust.map(|gust| GustProcess::new(&gust, step_period, stream(seed, 1))),
            dryden: config.dryden.map(|wind| DrydenProcess::new(&wind, step_period, seed)),
        }
    }
}

impl DisturbanceSource for DisturbanceProcess {
    #[inline]
    fn advance(&mut self, truth: &PlantState) -> Disturbance {
        let mut sum = self.constant;
        if let Some(noise) = &mut self.noise {
            sum.push(noise.advance());
        }
        if let Some(sinusoid) = &mut self.sinusoid {
            sum.push(sinusoid.advance());
        }
        if let Some(gust) = &mut self.gust {
            sum.push(gust.advance());
        }
        if let Some(dryden) = &mut self.dryden {
            let wind = dryden.advance(truth);
            sum.push(wind);
            sum.wind_world = wind.wind_world;
        }
        sum
    }
}

impl Disturbance {
    /// Adds acceleration and torque of another, in the same air.
    #[inline]
    pub(super) fn push(&mut self, other: Self) {
        self.acceleration_world += other.acceleration_world;
        self.torque_body += other.torque_body;
    }
}

/// Random numbers of one effect: non-overlapping streams (2^128 apart) of one seed.
fn stream(seed: u64, effect: u32) -> Xoshiro256PlusPlus {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    for _ in 0..effect {
        generator.jump();
    }
    generator
}

/// Each component uniform in `[-1, 1)`, on the grid that 32 bits give: one draw serves two.
///
/// Written out instead of taken from `rand`, whose sampling may change between versions.
#[inline]
fn uniform_pair(generator: &mut Xoshiro256PlusPlus) -> (DVec3, DVec3) {
    const SCALE: f64 = 1.0 / (1u64 << 31) as f64;
    let mut two = || {
        let bits = generator.next_u64();
        (f64::from(bits as u32 as i32) * SCALE, f64::from((bits >> 32) as u32 as i32) * SCALE)
    };
    let ((x, y), (z, u), (v, w)) = (two(), two(), two());
    (DVec3::new(x, y, z), DVec3::new(u, v, w))
}
