//! The wrenches with which the allocation is measured: the same on host and target, from a seed.

use ctrl_core::allocation::{Allocation, RotorGeometry, Spin};
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
