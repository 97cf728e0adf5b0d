//! Tracking controllers for VTOL UAVs with unknown mass, unknown inertia, bounded disturbances and
//! input limits, after "Tracking Control of UAVs with Uncertainty and Input Constraints".
//!
//! Pure computation for host and microcontroller: no clock, no I/O, no allocation, fixed step,
//! `f32`. Equation numbers in round brackets are the paper's, with the corrections of the project's
//! theory page.
//!
//! ```text
//! trajectory -> Reference -----------+
//! sensors -> VehicleState -> TrackingController::step -> Wrench -> Allocator -> rotors
//!                     Supervisor (arming, failsafe) gates the wrench
//! ```
//!
//! | result of the paper | type |
//! |---|---|
//! | Theorem 1: robust adaptive tracking | [`robust_adaptive::RobustAdaptive`] |
//! | Theorem 2: the same within thrust and torque limits | [`saturated::Saturated`] |
//! | Assumptions 1 to 3: known bounds | [`vehicle::Uncertainty`] |
//! | Assumption 4: bounded reference acceleration | [`trajectory::Trajectory::acceleration_bound`] |
//! | Inequalities (19), (54) | checked by the constructors, [`error::ConfigError`] |
//! | Wrench bounds (7), (8), (19), (20) | [`vehicle::WrenchBounds`] |
//!
//! # Example
//!
//! One step at rest on the reference: the thrust is the estimated weight.
//!
//! ```
//! use ctrl_core::config::{CascadeGains, IntegralAction, RobustAdaptiveConfig};
//! use ctrl_core::controller::TrackingController;
//! use ctrl_core::reference::Reference;
//! use ctrl_core::robust_adaptive::RobustAdaptive;
//! use ctrl_core::rotors::RotorModel;
//! use ctrl_core::vehicle::{
//!     InitialEstimate, Interval, Uncertainty, VectorInterval, VehicleState,
//! };
//! use glam::Vec3;
//!
//! let controller = RobustAdaptive::new(&RobustAdaptiveConfig {
//!     step_period: 1e-3,               // s
//!     reference_acceleration_max: 0.3, // m/s^2
//!     uncertainty: Uncertainty {
//!         mass: Interval { lower: 0.7, upper: 1.0 },     // kg
//!         inertia: VectorInterval::splat(0.03, 0.12),    // kg m^2, about each axis
//!         disturbance_acceleration: 0.05,                // m/s^2
//!         disturbance_torque: Vec3::new(0.05, 0.05, 0.02), // N m
//!     },
//!     initial: InitialEstimate { mass: 0.8, inertia: Vec3::splat(0.06) },
//!     cascade: CascadeGains {
//!         k1: 1.0, k2: 0.8, k3: Vec3::splat(3.0), c: 0.1, m1: 2.0, m2: 2.0, gamma1: 0.05,
//!         delta_1: 0.1, delta_min_translation: 0.1, delta_min_rotation: 0.05,
//!     },
//!     k4: Vec3::splat(0.5),
//!     gamma2: Vec3::splat(0.01),
//!     integral: IntegralAction::OFF,
//!     rotors: RotorModel::OFF,
//! })?;
//! let mut state = controller.initial_state();
//! let height = Vec3::new(0.0, 0.0, 5.0);
//! let output =
//!     controller.step(&mut state, &VehicleState::at_rest(height), &Reference::hover(height));
//! assert!((output.wrench.thrust - 0.8 * 9.81).abs() < 1e-5); // N
//! # Ok::<(), ctrl_core::error::ConfigError>(())
//! ```
//!
//! # Features
//!
//! - `serde`: configurations, states, references and outputs as serde types.
//! - `defmt`: `defmt::Format` for errors, modes and outputs.
//! - `scalar-math`: glam's scalar code, for the same bits on host and microcontroller. It acts on glam in
//!   the whole build, so the choice is the application's.
#![no_std]
#![deny(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod adaptation;
pub mod allocation;
mod auxiliary;
mod cascade;
pub mod config;
pub mod controller;
pub mod error;
pub mod estimator;
pub mod filter;
pub mod jet;
pub mod list;
pub mod mode;
#[cfg(feature = "serde")]
pub mod per_axis;
pub mod reference;
pub mod robust_adaptive;
pub mod rotation;
pub mod rotors;
pub mod saturated;
pub mod saturation;
pub mod setpoint;
pub mod sqrt;
pub mod trajectory;
pub mod trigonometry;
pub mod vehicle;
