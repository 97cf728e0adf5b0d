//! A flight for a page to play back: a bounded number of [`Frame`]s, dense where much happens.

mod frame;
mod recorder;
mod track;

pub use frame::Frame;
pub use recorder::FrameRecorder;
pub use track::Track;
