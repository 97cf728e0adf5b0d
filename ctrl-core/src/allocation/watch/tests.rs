use core::f32::consts::FRAC_PI_6;

use super::*;
use crate::allocation::{Allocator, Spin};
use crate::vehicle::{Interval, Wrench};
use proptest::prelude::*;

const DT: f32 = 1e-3;
const INERTIA: Vec3 = Vec3::new(0.0486, 0.0486, 0.098);
const CONFIG: RotorWatchConfig = RotorWatchConfig {
    inertia: INERTIA,
    disturbance_torque: 0.05,
    rotor_lag: 0.03,
    smoothing_time: 0.05,
    share: 0.6,
    time: 0.03,
};

fn geometry(rotors: usize) -> RotorGeometry {
    use Spin::{Anticlockwise as A, Clockwise as C};
    let limits = Interval { lower: 0.05, upper: 4.0 };
    let spins: &[Spin] = if rotors == 6 { &[A, A, C, C, A, C] } else { &[A, C, A, C, A, C, A, C] };
    RotorGeometry::ring(spins, 0.25, FRAC_PI_6, 0.016, limits)
}

/// A vehicle that turns under rotors with a lag, a law that damps its rate, and a disturbance.
struct Turning {
    watch: RotorWatch,
    allocator: Allocator,
    columns: [Vec3; MAX_ROTORS],
    state: RotorWatchState,
    rate: Vec3,
    attitude: Vec3,
    thrusts: [f32; MAX_ROTORS],
    health: [f32; MAX_ROTORS],
    inertia: Vec3,
}

impl Turning {
    fn new(rotors: usize) -> Self {
        let geometry = geometry(rotors);
        let watch = RotorWatch::new(&CONFIG, &geometry, DT).unwrap();
        Self {
            columns: watch.torques,
            watch,
            allocator: Allocator::new(&geometry).unwrap(),
            state: RotorWatchState::default(),
            rate: Vec3::ZERO,
            attitude: Vec3::ZERO,
            thrusts: [8.34 / rotors as f32; MAX_ROTORS],
            health: [1.0; MAX_ROTORS],
            inertia: INERTIA,
        }
    }

    /// One period; the rotor that was found, which the allocation then leaves out.
    fn step(&mut self, wanted: Vec3, disturbance: Vec3, noise: Vec3) -> Option<usize> {
        let torque_body = -1.5 * (self.rate - wanted) - 6.0 * self.attitude;
        let command = self.allocator.allocate(&Wrench { thrust: 8.34, torque_body });
        let mut torque = disturbance;
        for (i, commanded) in command.thrusts.iter().enumerate() {
            self.thrusts[i] += (1.0 - libm::expf(-DT / 0.03)) * (commanded - self.thrusts[i]);
            torque += self.health[i] * self.thrusts[i] * self.columns[i];
        }
        let turning = (self.inertia * self.rate).cross(self.rate);
        self.rate += DT * (torque + turning) / self.inertia;
        self.attitude += DT * self.rate;
        let found = self.watch.step(&mut self.state, Some(self.rate + noise), &command.thrusts);
        if let Some(rotor) = found {
            self.allocator.lose(rotor).unwrap();
        }
        found
    }
}

/// Numbers in [-1, 1] from a seed.
fn random(bits: &mut u64) -> f32 {
    *bits ^= *bits << 13;
    *bits ^= *bits >> 7;
    *bits ^= *bits << 17;
    (*bits >> 40) as f32 * (1.0 / 8_388_608.0) - 1.0
}

fn noise(bits: &mut u64, size: f32) -> Vec3 {
    Vec3::new(random(bits), random(bits), random(bits)) * size
}

#[test]
fn every_rotor_that_dies_is_found_within_a_tenth_of_a_second_and_no_other() {
    for rotors in [6, 8] {
        for dead in 0..rotors {
            let (mut vehicle, mut bits) = (Turning::new(rotors), 7 + dead as u64);
            // Uniform, with the deviation of a BMI088 at 1 kHz.
            let gyro = 0.0077 * ROOT_OF_THREE;
            for _ in 0..1000 {
                let gust = noise(&mut bits, 0.05);
                assert_eq!(vehicle.step(Vec3::ZERO, gust, noise(&mut bits, gyro)), None);
            }
            vehicle.health[dead] = 0.0;
            let found = (0..1000).find_map(|k| {
                let gust = noise(&mut bits, 0.05);
                Some((k, vehicle.step(Vec3::ZERO, gust, noise(&mut bits, gyro))?))
            });
            let (after, rotor) = found.expect("found");
            assert!(rotor == dead && after < 100, "{rotors}: {dead}, found {rotor} after {after}");
            // The others go on, and nothing else is found.
            for _ in 0..3000 {
                assert_eq!(vehicle.step(Vec3::ZERO, Vec3::ZERO, noise(&mut bits, gyro)), None);
            }
            assert_eq!(vehicle.state.failed(), RotorSet::rotor(dead));
            assert!(vehicle.rate.length() < 0.5, "{}", vehicle.rate);
        }
    }
}

#[test]
fn a_weak_rotor_and_a_neighbour_are_not_taken_for_a_dead_one() {
    let mut vehicle = Turning::new(6);
    vehicle.health[2] = 0.6;
    for _ in 0..3000 {
        assert_eq!(vehicle.step(Vec3::ZERO, Vec3::ZERO, Vec3::ZERO), None);
    }
}

#[test]
fn gusts_within_their_bound_turns_and_a_wrong_inertia_raise_no_alarm() {
    for (seed, scale) in [(1, 1.0), (2, 0.8), (3, 1.25)] {
        let (mut vehicle, mut bits) = (Turning::new(6), seed);
        vehicle.inertia = INERTIA * scale;
        let (mut gust, mut wanted) = (Vec3::ZERO, Vec3::ZERO);
        for k in 0..100_000 {
            if k % 300 == 0 {
                // The worst that is allowed: each axis at its bound.
                gust = noise(&mut bits, 1.0).signum() * 0.05;
                wanted = noise(&mut bits, 0.3);
            }
            let found = vehicle.step(wanted, gust, noise(&mut bits, 0.0133));
            assert_eq!(found, None, "{scale}, {k}");
        }
    }
}

#[test]
fn two_rotors_at_one_place_are_not_told_apart() {
    let mut geometry = geometry(8);
    for i in (0..8).step_by(2) {
        geometry.rotors[i + 1].position_body = geometry.rotors[i].position_body;
    }
    let watch = RotorWatch::new(&CONFIG, &geometry, DT).unwrap();
    let (mut state, mut rate) = (RotorWatchState::default(), Vec3::ZERO);
    for _ in 0..1000 {
        // What is left without the first one.
        rate -= DT * 1.3 * watch.torques[0] / INERTIA;
        state.before = Some(rate + DT * 1.3 * watch.torques[0] / INERTIA);
        assert_eq!(watch.step(&mut state, Some(rate), &[1.3; 8]), None);
        rate = Vec3::ZERO;
    }
    assert_eq!(state.failed(), RotorSet::empty());
}

#[test]
fn numbers_out_of_range_are_named() {
    let refused = |config: RotorWatchConfig| {
        RotorWatch::new(&config, &geometry(6), DT).unwrap_err().parameter
    };
    let no = f32::NAN;
    assert_eq!(refused(RotorWatchConfig { inertia: Vec3::ZERO, ..CONFIG }), "rotor_watch.inertia");
    let still = RotorWatchConfig { disturbance_torque: no, ..CONFIG };
    assert_eq!(refused(still), "rotor_watch.disturbance_torque");
    assert_eq!(refused(RotorWatchConfig { rotor_lag: -1.0, ..CONFIG }), "rotor_watch.rotor_lag");
    let sharp = RotorWatchConfig { smoothing_time: 1e-3, ..CONFIG };
    assert_eq!(refused(sharp), "rotor_watch.smoothing_time");
    assert_eq!(refused(RotorWatchConfig { share: 0.5, ..CONFIG }), "rotor_watch.share");
    assert_eq!(refused(RotorWatchConfig { time: 0.0, ..CONFIG }), "rotor_watch.time");
    let four = RotorGeometry::quad_x(0.2, 0.016, Interval { lower: 0.0, upper: 4.0 });
    let error = RotorWatch::new(&CONFIG, &four, DT).unwrap_err();
    assert_eq!(error.parameter, "rotors (count)");
}

proptest! {
    #[test]
    fn whatever_comes_it_goes_on_and_recovers(
        words in proptest::collection::vec(any::<[u32; 5]>(), 1..50),
        count in 0usize..12,
    ) {
        let watch = RotorWatch::new(&CONFIG, &geometry(6), DT).unwrap();
        let mut state = RotorWatchState::default();
        for word in words {
            let [x, y, z, a, b] = word.map(f32::from_bits);
            let thrusts = [a, b, a, b, a, b, a, b, a, b, a, b];
            let found = watch.step(&mut state, Some(Vec3::new(x, y, z)), &thrusts[..count]);
            prop_assert!(found.is_none_or(|rotor| rotor < 6));
        }
        // Rest at what the rotors give, then one that is dead turns it.
        state = RotorWatchState { failed: RotorSet::empty(), ..state };
        for _ in 0..6000 {
            watch.step(&mut state, Some(Vec3::ZERO), &[1.4; 6]);
        }
        state = RotorWatchState { failed: RotorSet::empty(), ..state };
        let turn = -1.4 * watch.torques[1] / INERTIA * DT;
        let found = (0..300).find_map(|k| watch.step(&mut state, Some(turn * k as f32), &[1.4; 6]));
        prop_assert_eq!(found, Some(1));
    }
}
