//! Flies the missing runs of a campaign on all cores.

use std::ops::Range;

use rayon::iter::{ParallelBridge, ParallelIterator};
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::error::CampaignError;
use super::flight::fly_run;
use super::plan::Campaign;
use super::progress::CampaignProgress;
use super::row::Row;
use super::table::line;
use super::window::Window;

/// Runs a thread may be ahead of the next one to be written: some flights take longer than others.
const AHEAD: u32 = 64;

/// A run that has been flown.
#[derive(Debug)]
pub struct Flown {
    /// One row per variant.
    pub rows: Vec<Row>,
    /// They as lines of the table.
    pub lines: String,
}

/// A pool of `threads` worker threads [default: one per core].
///
/// # Errors
/// When threads cannot be started.
pub fn pool(threads: Option<u32>) -> Result<ThreadPool, CampaignError> {
    let threads = threads.map_or(0, |threads| threads as usize);
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|error| CampaignError::Usage(format!("worker threads: {error}")))
}

/// Flies `runs` and passes their rows to `write`, in order, with their lines of the table.
///
/// # Errors
/// The first of `write`.
pub fn execute(
    campaign: &Campaign,
    runs: Range<u32>,
    pool: &ThreadPool,
    progress: &dyn CampaignProgress,
    write: impl FnMut(Vec<Flown>) -> Result<(), CampaignError> + Send,
) -> Result<(), CampaignError> {
    let ahead = AHEAD.saturating_mul(pool.current_num_threads() as u32);
    let window = Window::new(runs.start, ahead, write);
    // A bridge hands runs out one at a time and in order, as the window requires.
    pool.install(|| {
        runs.par_bridge().try_for_each(|index| {
            if !window.admit(index) {
                return Ok(());
            }
            let run = fly_run(campaign, index);
            let violated = run.violated();
            let lines = run.rows.iter().map(|row| line(campaign, row)).collect();
            window.finish(index, Flown { rows: run.rows, lines })?;
            progress.run_completed(run.flight_time, violated);
            Ok(())
        })
    })
}
