//! The link between a vehicle and its host: messages, framing, parameters, path upload.
//!
//! `docs/protocol.md` describes the bytes for clients in other languages. A frame is
//!
//! ```text
//! COBS( direction and version | sequence u16 LE | postcard message | CRC-32 u32 LE ) 0x00
//! ```
//!
//! [`Encoder`] makes frames and [`Decoder`] takes bytes as they come; neither panics, allocates or
//! trusts its input. What comes out has passed the checksum, and its numbers are whatever the
//! other side sent: NaN is for the receiver of a message to judge.

#![no_std]
#![deny(unsafe_code)]

#[cfg(test)]
extern crate std;

mod frame;
mod message;
mod parameter;
mod statistics;
mod upload;

#[cfg(test)]
mod tests;

pub use frame::{Decoder, EncodeError, Encoder, Received};
pub use message::{
    Acknowledgement, ControllerKind, Downlink, EstimatorSetting, FaultKind, FaultReport, Guidance,
    Health, Identity, Lasting, Message, ParameterOrigin, ParameterValue, ParametersInForce,
    Rejection, Secret, Telemetry, TrajectorySelection, Uplink,
};
pub use parameter::Parameters;
pub use statistics::{GroupHealth, LinkStatistics};
pub use upload::{PathUpload, UploadError};

/// Version of the protocol; frames of another version are counted and dropped.
pub const VERSION: u8 = 1;

/// Longest parameter name (bytes).
pub const NAME_MAX: usize = 48;
/// Longest text of a fault report (bytes).
pub const TEXT_MAX: usize = 96;
/// Registers in a fault report.
pub const REGISTERS: usize = 14;
/// Rate groups in a health report.
pub const GROUPS: usize = 4;

/// Longest message (bytes); the tests hold the longest of each kind against it.
pub const MAX_MESSAGE: usize = 192;
/// Direction and version, sequence.
const HEADER: usize = 3;
/// CRC-32.
const CHECKSUM: usize = 4;
/// Longest frame before COBS (bytes).
const MAX_PAYLOAD: usize = HEADER + MAX_MESSAGE + CHECKSUM;
/// Longest frame on the wire (bytes): one byte of COBS and the delimiter more.
pub const MAX_FRAME: usize = MAX_PAYLOAD + 2;

// One byte of COBS is enough up to here.
const _: () = assert!(MAX_PAYLOAD <= 254);
