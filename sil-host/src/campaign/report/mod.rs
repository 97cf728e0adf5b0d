//! One self-contained HTML page a campaign.

pub mod failure_probability;
