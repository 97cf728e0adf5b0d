//! A flight for a page to play back: a bounded number of ticks, dense where the motion is fast.

mod recorder;
mod track;

pub use recorder::ReplayRecorder;
pub use track::Track;
