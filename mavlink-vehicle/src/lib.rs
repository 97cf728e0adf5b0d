//! A vehicle of `ctrl-core` on MAVLink, for ground stations and autopilot scripts.
//!
//! [`Protocol`] is the state machine: packets of a [`Decoder`] go in, [`Frame`]s come out, and the vehicle
//! behind it is a [`Vehicle`]. Clock, ports and threads are the caller's, so host and firmware share it:
//!
//! ```text
//! bytes -> Decoder -> Protocol::handle --- Vehicle: parameters, commands, navigator
//! bytes <- Frame   <- Protocol::next_frame
//! ```
//!
//! Nothing here panics, allocates, blocks or loops without a bound. Messages are the structs of the crate
//! `mavlink` with a dialect of our own ([`message`]), since the enum of all messages takes more flash than a
//! controller. What goes over the wire is NED and FRD ([`coordinates`]); the core's frames are ENU and FLU.
//!
//! `docs/how-to/ground-station.md` lists messages and commands.

#![no_std]
#![deny(unsafe_code)]
#![allow(deprecated, reason = "ground stations in use send and expect superseded messages, too")]

#[cfg(test)]
extern crate std;

mod command;
pub mod coordinates;
mod decoder;
mod flight_mode;
mod frame;
mod log_transfer;
pub mod message;
mod mission;
mod parameter;
mod parameter_exchange;
mod protocol;
mod set_point;
mod signing;
mod status_text;
mod stream;
mod telemetry;
mod vehicle;

#[cfg(test)]
mod tests;

pub use decoder::{Decoder, Packet};
pub use flight_mode::FlightMode;
pub use frame::{FRAME_MAX, Frame};
pub use parameter::{NAMES, ParameterName, long_name, short_name};
pub use protocol::{Autopilot, Protocol, ProtocolConfig, ProtocolMemory};
pub use signing::{Line, SigningKey, SigningRefusals};
pub use status_text::{Part, Severity};
pub use vehicle::{Battery, Lasting, LogEntry, ParameterRefusal, Vehicle, View};
