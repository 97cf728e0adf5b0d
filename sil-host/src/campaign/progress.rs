//! Progress of a campaign.

/// Receiver of a campaign's progress, called from every worker thread.
pub trait CampaignProgress: Sync {
    /// Called once before the first run: number of runs in all, and of those flown earlier.
    fn begin(&self, total: u32, before: u32);

    /// Called after every run with its simulated time in all variants (s), and whether it violated a guarantee.
    fn run_completed(&self, flight_time: f64, violated: bool);

    /// `true` to end the campaign after the runs that are being flown; a later call continues it.
    fn cancelled(&self) -> bool {
        false
    }
}

/// No progress is shown.
impl CampaignProgress for () {
    fn begin(&self, _: u32, _: u32) {}

    fn run_completed(&self, _: f64, _: bool) {}
}
