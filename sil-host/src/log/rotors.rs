//! Rotors of the firmware's vehicle, for logs of flights that do not simulate single rotors.

use ctrl_core::allocation::{Allocator, RotorGeometry};
use sim::tick::Tick;

use super::moment::MOTORS;

/// The allocation, with the limits that normalise its result.
#[derive(Clone, Debug)]
pub(super) struct Rotors {
    allocator: Allocator,
    geometry: RotorGeometry,
}

impl Rotors {
    /// The rotors of a geometry; none if it is none that can be allocated to.
    pub(super) fn new(geometry: &RotorGeometry) -> Option<Self> {
        let allocator = Allocator::new(geometry).ok()?;
        Some(Self { allocator, geometry: geometry.clone() })
    }

    /// Thrust of each rotor over its limit under the command of a tick; NaN while no thrust is commanded.
    pub(super) fn controls(&self, tick: &Tick) -> [f32; MOTORS] {
        let mut controls = [f32::NAN; MOTORS];
        let wrench = &tick.output.wrench;
        if wrench.thrust > 0.0 {
            let thrusts = self.allocator.allocate(wrench).thrusts;
            let rotors = self.geometry.rotors.iter().zip(&thrusts);
            for (control, (rotor, thrust)) in controls.iter_mut().zip(rotors) {
                *control = thrust / rotor.thrust.upper;
            }
        }
        controls
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ctrl_core::vehicle::Wrench;
    use firmware::vehicle::VEHICLE;
    use glam::Vec3;
    use sim::guarantee::test_flight::{both, sample};

    #[test]
    fn thrust_is_shared_by_the_rotors_and_none_is_nan() {
        let rotors = Rotors::new(&VEHICLE.geometry).unwrap();
        let mut tick = sample(&both(1e-3)[1]);
        tick.output.wrench = Wrench { thrust: 8.0, torque_body: Vec3::ZERO };
        let controls = rotors.controls(&tick);
        for control in &controls[..4] {
            assert!((control - 0.5).abs() < 1e-6, "{controls:?}"); // 8 N of 4 x 4 N
        }
        assert!(controls[4..].iter().all(|control| control.is_nan()));
        // Rolling left side up (positive about body x): the left rotors, first and second, give more.
        tick.output.wrench.torque_body = Vec3::new(0.1, 0.0, 0.0);
        let controls = rotors.controls(&tick);
        assert!(controls[0] > 0.51 && controls[1] > 0.51 && controls[2] < 0.49, "{controls:?}");
        tick.output.wrench = Wrench::default();
        assert!(rotors.controls(&tick).iter().all(|control| control.is_nan()));
    }
}
