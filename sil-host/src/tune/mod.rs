//! Gains from what is known of a vehicle; `docs/tune.md` derives the method.

pub mod check;
pub mod design;
pub mod hover;
pub mod peak;
pub mod pole;
pub mod proposal;
pub mod request;
pub mod survey;
pub mod ultimate;
