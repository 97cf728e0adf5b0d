//! Flights under commands: the vehicle of a scenario in real time, on MAVLink.
//!
//! [`FlownVehicle`] is plant, session, pilot and control group, one control tick after the other, as the
//! firmware has them; [`Ports`] carries its bytes; [`fly()`] paces both. Every flight from Arm to Disarm has its
//! own directory of results, with its trace, its log and the guarantees that are judged on the truth. [`fly_image()`]
//! has the firmware's image in the place of all but the plant.

mod error;
pub mod failsafe;
mod image;
mod image_law;
mod image_line;
mod observed_law;
mod pace;
mod plant;
mod ports;
mod record;
mod session;
mod signing;
mod vehicle;

pub use error::FlyError;
pub use image::{ImageOptions, ImageReport, fly_image};
pub use mavlink_vehicle::SigningKey;
pub use ports::{PortOptions, Ports};
pub use record::{FlightLogs, FlownReport};
pub use session::{FlyEvent, FlyOptions, fly};
pub use signing::read_key;
pub use vehicle::{FlownTick, FlownVehicle, Interference};
