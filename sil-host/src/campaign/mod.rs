//! Campaigns: many flights of one scenario with varied parameters.

pub mod report;
