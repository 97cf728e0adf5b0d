//! Statistics that a health report carries.

use serde::{Deserialize, Serialize};

/// Statistics of a decoder; counts wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LinkStatistics {
    /// Frames that were delivered.
    pub delivered: u32,
    /// Frames with broken COBS, too long or short, or with a wrong checksum.
    pub damaged: u32,
    /// Whole frames of another version or of the other direction.
    pub foreign: u32,
    /// Whole frames that hold no message of this version.
    pub malformed: u32,
    /// Whole frames dropped as late or doubled.
    pub late: u32,
    /// Sequence numbers that were skipped: frames that were damaged or never arrived.
    pub lost: u32,
}

/// Statistics of one rate group.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GroupHealth {
    /// Finishes, timely or late.
    pub completed: u32,
    /// Longest time from release to finish (us).
    pub worst_time: u32,
    /// Missed deadlines and missed releases.
    pub overruns: u32,
}
