//! Records between the host and a step image: plain little-endian 32-bit words.
//!
//! An input file is one controller configuration, then a [`Sample`] for every step.
//! An output file is one [`Answer`] for every step, then one [`Closing`].
//! Every record names its words once, in [`Record::visit`], for reading and writing alike.
#![no_std]

pub mod allocation;
pub mod estimator;
pub mod filter;

use ctrl_core::config::{CascadeGains, IntegralAction, RobustAdaptiveConfig, SaturatedConfig};
use ctrl_core::reference::Reference;
use ctrl_core::rotors::RotorModel;
use ctrl_core::vehicle::{InitialEstimate, Interval, Uncertainty, VectorInterval, VehicleState};
use glam::{Quat, Vec3};

/// A value that is a fixed sequence of 32-bit words.
pub trait Record: Copy {
    /// The value with all words zero.
    fn zero() -> Self;

    /// Shows every word in order; `word` may change it.
    fn visit(&mut self, word: &mut impl FnMut(&mut u32));

    /// Takes a value from `next`; `None` as soon as that ends.
    fn read(mut next: impl FnMut() -> Option<u32>) -> Option<Self> {
        let (mut record, mut complete) = (Self::zero(), true);
        record.visit(&mut |word| match next() {
            Some(read) => *word = read,
            None => complete = false,
        });
        complete.then_some(record)
    }

    /// Gives every word to `sink`.
    fn write(&self, mut sink: impl FnMut(u32)) {
        let mut copy = *self;
        copy.visit(&mut |word| sink(*word));
    }
}

fn number(x: &mut f32, word: &mut impl FnMut(&mut u32)) {
    let mut bits = x.to_bits();
    word(&mut bits);
    *x = f32::from_bits(bits);
}

fn vector(x: &mut Vec3, word: &mut impl FnMut(&mut u32)) {
    for component in [&mut x.x, &mut x.y, &mut x.z] {
        number(component, word);
    }
}

fn quaternion(x: &mut Quat, word: &mut impl FnMut(&mut u32)) {
    for component in [&mut x.x, &mut x.y, &mut x.z, &mut x.w] {
        number(component, word);
    }
}

fn uncertainty(x: &mut Uncertainty, word: &mut impl FnMut(&mut u32)) {
    let Uncertainty { mass, inertia, disturbance_acceleration, disturbance_torque } = x;
    number(&mut mass.lower, word);
    number(&mut mass.upper, word);
    vector(&mut inertia.lower, word);
    vector(&mut inertia.upper, word);
    number(disturbance_acceleration, word);
    vector(disturbance_torque, word);
}

fn initial(x: &mut InitialEstimate, word: &mut impl FnMut(&mut u32)) {
    number(&mut x.mass, word);
    vector(&mut x.inertia, word);
}

fn cascade(x: &mut CascadeGains, word: &mut impl FnMut(&mut u32)) {
    let CascadeGains {
        k1,
        k2,
        k3,
        c,
        m1,
        m2,
        gamma1,
        delta_1,
        delta_min_translation,
        delta_min_rotation,
    } = x;
    number(k1, word);
    number(k2, word);
    vector(k3, word);
    for gain in [c, m1, m2, gamma1, delta_1, delta_min_translation, delta_min_rotation] {
        number(gain, word);
    }
}

fn rotors(x: &mut RotorModel, word: &mut impl FnMut(&mut u32)) {
    let RotorModel { lag, residual_lag } = x;
    number(lag, word);
    number(residual_lag, word);
}

fn integral(x: &mut IntegralAction, word: &mut impl FnMut(&mut u32)) {
    let IntegralAction { acceleration_max, gamma_d, torque_max, gamma_t } = x;
    for x in [acceleration_max, gamma_d, torque_max, gamma_t] {
        number(x, word);
    }
}

const ZERO_UNCERTAINTY: Uncertainty = Uncertainty {
    mass: Interval { lower: 0.0, upper: 0.0 },
    inertia: VectorInterval::splat(0.0, 0.0),
    disturbance_acceleration: 0.0,
    disturbance_torque: Vec3::ZERO,
};
const ZERO_INITIAL: InitialEstimate = InitialEstimate { mass: 0.0, inertia: Vec3::ZERO };
const ZERO_CASCADE: CascadeGains = CascadeGains {
    k1: 0.0,
    k2: 0.0,
    k3: Vec3::ZERO,
    c: 0.0,
    m1: 0.0,
    m2: 0.0,
    gamma1: 0.0,
    delta_1: 0.0,
    delta_min_translation: 0.0,
    delta_min_rotation: 0.0,
};

impl Record for RobustAdaptiveConfig {
    fn zero() -> Self {
        Self {
            step_period: 0.0,
            reference_acceleration_max: 0.0,
            uncertainty: ZERO_UNCERTAINTY,
            initial: ZERO_INITIAL,
            cascade: ZERO_CASCADE,
            k4: Vec3::ZERO,
            gamma2: Vec3::ZERO,
            integral: IntegralAction::OFF,
            rotors: RotorModel::OFF,
        }
    }

    fn visit(&mut self, word: &mut impl FnMut(&mut u32)) {
        number(&mut self.step_period, word);
        number(&mut self.reference_acceleration_max, word);
        uncertainty(&mut self.uncertainty, word);
        initial(&mut self.initial, word);
        cascade(&mut self.cascade, word);
        vector(&mut self.k4, word);
        vector(&mut self.gamma2, word);
        integral(&mut self.integral, word);
        rotors(&mut self.rotors, word);
    }
}

impl Record for SaturatedConfig {
    fn zero() -> Self {
        Self {
            step_period: 0.0,
            reference_acceleration_max: 0.0,
            uncertainty: ZERO_UNCERTAINTY,
            initial: ZERO_INITIAL,
            cascade: ZERO_CASCADE,
            thrust_max: 0.0,
            torque_max: Vec3::ZERO,
            k4: Vec3::ZERO,
            k5: 0.0,
            gamma2: Vec3::ZERO,
            gamma3: 0.0,
            integral: IntegralAction::OFF,
            rotors: RotorModel::OFF,
        }
    }

    fn visit(&mut self, word: &mut impl FnMut(&mut u32)) {
        number(&mut self.step_period, word);
        number(&mut self.reference_acceleration_max, word);
        uncertainty(&mut self.uncertainty, word);
        initial(&mut self.initial, word);
        cascade(&mut self.cascade, word);
        let Self { thrust_max, torque_max, k4, k5, gamma2, gamma3, .. } = self;
        number(thrust_max, word);
        vector(torque_max, word);
        vector(k4, word);
        number(k5, word);
        vector(gamma2, word);
        number(gamma3, word);
        integral(&mut self.integral, word);
        rotors(&mut self.rotors, word);
    }
}

/// The input of one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// State of the vehicle.
    pub vehicle: VehicleState,
    /// Reference of the step.
    pub reference: Reference,
}

impl Record for Sample {
    fn zero() -> Self {
        Self { vehicle: VehicleState::at_rest(Vec3::ZERO), reference: Reference::hover(Vec3::ZERO) }
    }

    fn visit(&mut self, word: &mut impl FnMut(&mut u32)) {
        let VehicleState { position_world, velocity_world, attitude, rate_body } =
            &mut self.vehicle;
        vector(position_world, word);
        vector(velocity_world, word);
        quaternion(attitude, word);
        vector(rate_body, word);
        let Reference {
            position_world,
            velocity_world,
            acceleration_world,
            jerk_world,
            snap_world,
            left_world,
            left_rate_world,
            left_acceleration_world,
        } = &mut self.reference;
        for derivative in
            [position_world, velocity_world, acceleration_world, jerk_world, snap_world]
        {
            vector(derivative, word);
        }
        for derivative in [left_world, left_rate_world, left_acceleration_world] {
            vector(derivative, word);
        }
    }
}

/// Output of one step, and the emulator's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Bits of `f` and of the three components of `tau`.
    pub wrench: [u32; 4],
    /// Bits of the step's status.
    pub status: u32,
    /// Ticks of the emulator's timer around the call: instructions, plus those of the reading.
    pub ticks: u32,
}

impl Record for Answer {
    fn zero() -> Self {
        Self { wrench: [0; 4], status: 0, ticks: 0 }
    }

    fn visit(&mut self, word: &mut impl FnMut(&mut u32)) {
        self.wrench.iter_mut().for_each(&mut *word);
        word(&mut self.status);
        word(&mut self.ticks);
    }
}

/// Record after the last step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Closing {
    /// Deepest stack of any step, from painted memory (B).
    pub stack: u32,
    /// Size of the validated controller (B).
    pub controller_size: u32,
    /// Size of its state (B).
    pub state_size: u32,
}

impl Record for Closing {
    fn zero() -> Self {
        Self { stack: 0, controller_size: 0, state_size: 0 }
    }

    fn visit(&mut self, word: &mut impl FnMut(&mut u32)) {
        let Self { stack, controller_size, state_size } = self;
        [stack, controller_size, state_size].into_iter().for_each(word);
    }
}
