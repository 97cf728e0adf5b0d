//! The wrenches with which the allocation is measured: the same on host and target, from a seed.

use ctrl_core::allocation::{
    Allocation, Allocator, MAX_ROTORS, RotorGeometry, RotorWatch, RotorWatchConfig,
    RotorWatchState, Spin,
};
use ctrl_core::error::ConfigError;
use ctrl_core::vehicle::{Interval, Wrench};
use glam::Vec3;

use super::{Record, number, vector};

/// Wrenches of each kind.
pub const EACH: usize = 500;

/// Limits of every rotor (N).
const LIMITS: Interval = Interval { lower: 0.2, upper: 4.0 };

/// Vehicles that are measured.
pub const VEHICLES: usize = 3;

/// Losses of a rotor that are measured: each of the hexarotor and of the octorotor.
pub const LOSSES: [(usize, usize); 14] = [
    (1, 0),
    (1, 1),
    (1, 2),
    (1, 3),
    (1, 4),
    (1, 5),
    (2, 0),
    (2, 1),
    (2, 2),
    (2, 3),
    (2, 4),
    (2, 5),
    (2, 6),
    (2, 7),
];

/// A quadrotor, a hexarotor and an octorotor.
#[must_use]
pub fn geometry(vehicle: usize) -> RotorGeometry {
    use Spin::{Anticlockwise as A, Clockwise as C};
    match vehicle {
        0 => RotorGeometry::quad_x(0.2, 0.016, LIMITS),
        1 => RotorGeometry::ring(&[A, A, C, C, A, C], 0.3, 0.0, 0.02, LIMITS),
        _ => RotorGeometry::ring(&[A, C, A, C, A, C, A, C], 0.3, 0.2, 0.02, LIMITS),
    }
}

/// The command that is allocated after a loss: far beyond the limits.
#[must_use]
pub fn command_after_loss(rotors: usize) -> Wrench {
    commands(rotors).nth(EACH).unwrap_or_default()
}

/// Commands for a vehicle with so many rotors: [`EACH`] near hover, then as many far beyond the limits.
pub fn commands(rotors: usize) -> impl Iterator<Item = Wrench> {
    let mut bits: u64 = 0x9E37_79B9_7F4A_7C15;
    let mut random = move || {
        bits ^= bits << 13;
        bits ^= bits >> 7;
        bits ^= bits << 17;
        (bits >> 40) as f32 * (1.0 / 8_388_608.0) - 1.0
    };
    let rotors = rotors as f32;
    (0..2 * EACH).map(move |index| {
        let reach = if index < EACH { 0.05 } else { 1.5 };
        let torque = Vec3::new(random(), random(), 0.1 * random());
        let thrust = rotors * (2.0 + 2.0 * reach * random());
        Wrench { thrust, torque_body: torque * reach * rotors * 0.3 }
    })
}

/// Bits of an allocation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AllocationAnswer {
    thrusts: [f32; 8],
    thrust: f32,
    torque_body: Vec3,
}

impl AllocationAnswer {
    /// Of an allocation.
    #[must_use]
    pub fn new(allocation: &Allocation) -> Self {
        let mut thrusts = [0.0; 8];
        thrusts.iter_mut().zip(&allocation.thrusts).for_each(|(place, thrust)| *place = *thrust);
        let Wrench { thrust, torque_body } = allocation.achieved;
        Self { thrusts, thrust, torque_body }
    }
}

impl Record for AllocationAnswer {
    fn zero() -> Self {
        Self { thrusts: [0.0; 8], thrust: 0.0, torque_body: Vec3::ZERO }
    }

    fn visit(&mut self, word: &mut impl FnMut(&mut u32)) {
        self.thrusts.iter_mut().for_each(|thrust| number(thrust, word));
        number(&mut self.thrust, word);
        vector(&mut self.torque_body, word);
    }
}

/// Ticks of the flight that loses a rotor, and the one at which it does.
pub const LOSS_TICKS: usize = 600;
const LOST_AT: usize = 300;
/// The rotor that fails.
const LOST: usize = 2;
/// Step period of that flight (s).
const PERIOD: f32 = 1e-3;
const INERTIA: Vec3 = Vec3::new(0.0486, 0.0486, 0.098);
const WATCH: RotorWatchConfig = RotorWatchConfig {
    inertia: INERTIA,
    disturbance_torque: 0.05,
    rotor_lag: 0.03,
    smoothing_time: 0.05,
    share: 0.6,
    time: 0.03,
};

/// One tick of the flight that loses a rotor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LossAnswer {
    /// The rotor that is found to have failed at this tick.
    pub found: Option<u32>,
    rate_body: Vec3,
    allocation: AllocationAnswer,
}

impl Record for LossAnswer {
    fn zero() -> Self {
        Self { found: None, rate_body: Vec3::ZERO, allocation: AllocationAnswer::zero() }
    }

    fn visit(&mut self, word: &mut impl FnMut(&mut u32)) {
        let mut found = self.found.unwrap_or(u32::MAX);
        word(&mut found);
        self.found = Some(found).filter(|found| *found != u32::MAX);
        vector(&mut self.rate_body, word);
        self.allocation.visit(word);
    }
}

/// Flies the turning hexarotor under gusts through the failure of a rotor, its allocation and detection in the loop: `watch` is the detection's
/// step, `answer` receives every tick.
///
/// # Errors
/// Of the constructors; none of the constants is refused.
pub fn fly_through_loss(
    mut watch: impl FnMut(&RotorWatch, &mut RotorWatchState, Vec3, &[f32]) -> Option<usize>,
    mut answer: impl FnMut(LossAnswer),
) -> Result<(), ConfigError> {
    let geometry = geometry(1);
    let (mut allocator, detection) =
        (Allocator::new(&geometry)?, RotorWatch::new(&WATCH, &geometry, PERIOD)?);
    let whole = allocator.clone();
    let mut state = RotorWatchState::default();
    let (mut rate, mut angle) = (Vec3::ZERO, Vec3::ZERO);
    let mut gusts = commands(6);
    let mut thrusts = [8.34 / 6.0; MAX_ROTORS];
    for tick in 0..LOSS_TICKS {
        let torque_body = -0.5 * rate - angle;
        let allocation = allocator.allocate(&Wrench { thrust: 8.34, torque_body });
        for (thrust, commanded) in thrusts.iter_mut().zip(&allocation.thrusts) {
            *thrust += 0.033 * (commanded - *thrust);
        }
        if tick >= LOST_AT {
            thrusts[LOST] = 0.0;
        }
        let gust = gusts.next().unwrap_or_default().torque_body * 0.3;
        let torque = whole.wrench(&thrusts[..6]).torque_body + gust;
        rate += PERIOD * (torque + (INERTIA * rate).cross(rate)) / INERTIA;
        angle += PERIOD * rate;
        let found = watch(&detection, &mut state, rate, &allocation.thrusts);
        if let Some(rotor) = found {
            allocator.lose(rotor)?;
        }
        let found = found.map(|rotor| rotor as u32);
        answer(LossAnswer {
            found,
            rate_body: rate,
            allocation: AllocationAnswer::new(&allocation),
        });
    }
    Ok(())
}
