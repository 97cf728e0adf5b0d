//! Campaigns: many flights of one scenario, with values drawn from distributions or taken from a grid.
//!
//! A [`Definition`] is read from TOML and checked into a [`Campaign`]. Every value of a run is a
//! function of definition and seed alone, so that any run can be repeated by itself, a campaign
//! continued where it was interrupted, and its seeds shared between machines.

mod built_in;
mod definition;
mod distribution;
mod error;
mod flight;
mod measures;
mod normal;
mod plan;
mod replay;
mod row;
mod sampling;
mod table;

pub use built_in::BuiltInCampaign;
pub use definition::{Definition, Sampling, VariantDefinition};
pub use distribution::{Range, Vary};
pub use error::CampaignError;
pub use flight::{Watch, fly};
pub use measures::{MEASURES, Measure};
pub use plan::{Campaign, Guarantee, Parameter, Variant};
pub use row::{Observed, Outcome, Row};
pub use table::{Results, RowReader, header, line};
