//! Sensors of the vehicle, in the units of data sheets, and the flight by them.
//!
//! One file per effect ([`noise`], [`bias`], [`distortion`], [`converter`], [`schedule`], [`jump`],
//! [`filter`], [`vibration`], [`fault`]) and one
//! per sensor that is made of them. Every effect draws from its own stream of the scenario's seed, so that
//! one sensor does not change another. `docs/sensors.md` gives equations and sources of numbers.

pub mod barometer;
pub mod bias;
pub mod capture;
mod config;
pub mod consistency;
pub mod converter;
pub mod distortion;
pub mod fault;
pub mod filter;
pub mod flow;
pub mod gnss;
pub mod imu;
pub mod jump;
pub mod magnetometer;
mod navigation;
pub mod noise;
mod preset;
pub mod random;
pub mod rangefinder;
pub mod schedule;
pub mod vibration;

pub use config::{
    BarometerChoice, CaptureChoice, FlowChoice, GnssChoice, ImuChoice, MagnetometerChoice,
    RangefinderChoice, SensorsConfig,
};
pub use navigation::{ErrorState, Innovations, Navigation, SensorSamples};
pub use preset::{PRESETS, SensorPreset};
