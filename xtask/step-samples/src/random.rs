//! Single samples without a flight behind them: any attitude and rate, and hostile input.

use ctrl_core::jet::Jet;
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::VehicleState;
use glam::{Quat, Vec3};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use step_record::{Record, Sample};

/// Uniform numbers with a fixed seed.
struct Source(Xoshiro256PlusPlus);

impl Source {
    fn new() -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(1))
    }

    /// In `[-bound, bound)`.
    fn number(&mut self, bound: f32) -> f32 {
        let unit = (self.0.next_u32() >> 8) as f32 / (1 << 24) as f32;
        bound * (2.0 * unit - 1.0)
    }

    fn vector(&mut self, bound: f32) -> Vec3 {
        Vec3::new(self.number(bound), self.number(bound), self.number(bound))
    }

    fn below(&mut self, bound: u32) -> u32 {
        self.0.next_u32() % bound
    }

    fn sample(&mut self) -> Sample {
        let spin =
            Quat::from_xyzw(self.number(1.0), self.number(1.0), self.number(1.0), self.number(1.0));
        let vehicle = VehicleState {
            position_world: self.vector(10.0),
            velocity_world: self.vector(5.0),
            attitude: spin.normalize(),
            rate_body: self.vector(8.0),
        };
        let reference = Reference {
            velocity_world: self.vector(3.0),
            acceleration_world: self.vector(0.25),
            jerk_world: self.vector(0.2),
            snap_world: self.vector(0.1),
            ..Reference::hover(self.vector(2.0))
        };
        Sample { vehicle, reference: reference.facing(Jet::constant(Vec3::X)) }
    }
}

/// Vehicles anywhere near the reference, in any attitude, tumbling.
pub fn tumbling(count: usize) -> Vec<Sample> {
    let mut source = Source::new();
    (0..count).map(|_| source.sample()).collect()
}

/// As [`tumbling`], but in every second sample one to three words are replaced by the worst.
pub fn hostile(count: usize) -> Vec<Sample> {
    const WORST: [f32; 12] = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        f32::MIN,
        f32::MIN_POSITIVE,
        1e-42,
        0.0,
        -0.0,
        1e20,
        -1e10,
        1e5,
    ];
    let mut source = Source::new();
    let mut samples: Vec<_> = (0..count).map(|_| source.sample()).collect();
    for sample in samples.iter_mut().step_by(2) {
        for _ in 0..=source.below(3) {
            let (victim, worst) = (source.below(WORDS), source.below(WORST.len() as u32));
            let mut index = 0;
            sample.visit(&mut |word| {
                if index == victim {
                    *word = WORST[worst as usize].to_bits();
                }
                index += 1;
            });
        }
    }
    samples
}

/// Words in a sample: 13 of the vehicle's state, 24 of the reference.
const WORDS: u32 = 37;
