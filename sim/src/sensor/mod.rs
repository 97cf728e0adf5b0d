//! Sensors of the vehicle, in the units of data sheets, and the flight by them.
//!
//! One file per effect ([`noise`], [`bias`], [`distortion`], [`converter`], [`schedule`], [`jump`]) and one
//! per sensor that is made of them. Every effect draws from its own stream of the scenario's seed, so that
//! one sensor does not change another. `docs/sensors.md` gives equations and sources of numbers.

pub mod barometer;
pub mod bias;
pub mod capture;
mod config;
pub mod consistency;
pub mod converter;
pub mod distortion;
pub mod gnss;
pub mod imu;
pub mod jump;
pub mod magnetometer;
mod navigation;
pub mod noise;
pub mod random;
pub mod schedule;

pub use config::{
    BarometerChoice, CaptureChoice, GnssChoice, ImuChoice, MagnetometerChoice, SensorsConfig,
};
pub use navigation::{ErrorState, Innovations, Navigation};
