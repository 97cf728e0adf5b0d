//! Campaigns: many flights of one scenario, with values drawn from distributions or taken from a grid.
//!
//! A [`Definition`] is read from TOML and checked into a [`Campaign`]. Every value of a run is a
//! function of definition and seed alone, so that any run can be repeated by itself, a campaign
//! continued where it was interrupted, and its seeds shared between machines.

mod built_in;
mod definition;
mod distribution;
mod error;
mod execute;
mod flight;
mod fly;
mod measures;
mod merge;
mod normal;
#[cfg(feature = "parquet")]
mod parquet;
mod plan;
mod progress;
mod read;
mod replay;
pub mod report;
mod row;
mod sampling;
mod shard;
mod splitting;
mod stop;
mod store;
mod summary;
mod table;
mod window;

pub use built_in::BuiltInCampaign;
pub use definition::{Definition, Sampling, VariantDefinition};
pub use distribution::{Range, Vary};
pub use error::CampaignError;
pub use flight::{Run, fly_run};
pub use fly::{CampaignOptions, built_in_table, fly, repeat};
pub use measures::{MEASURES, Measure};
pub use merge::merge;
pub use plan::{Campaign, Guarantee, Parameter, Variant};
pub use progress::CampaignProgress;
pub use read::CampaignOverrides;
pub use row::{Observed, Row, RunOutcome};
pub use shard::Shard;
pub use splitting::{RareProbability, Splitting};
pub use stop::{Decision, Evidence, StopRule};
pub use summary::{GuaranteeSummary, Summary, VariantSummary};
pub use table::{CampaignResults, RowReader, header, line};
