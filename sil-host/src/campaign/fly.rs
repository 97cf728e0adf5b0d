//! Flies the missing runs of a campaign, and single runs again.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::built_in::BuiltInCampaign;
use super::error::CampaignError;
use super::execute::{execute, pool};
use super::plan::{Campaign, Variant};
use super::progress::CampaignProgress;
use super::shard::Shard;
use super::splitting;
use super::stop::Sequential;
use super::store::Store;
use super::summary::Summary;
use super::table::CampaignResults;
use crate::report::FlightReport;
use crate::run::{self, FlightOptions};

/// Options of a campaign's flights.
#[derive(Clone, Debug)]
pub struct CampaignOptions {
    /// Directory of results; the campaign gets one below it. Results that are there are continued.
    pub out: PathBuf,
    /// Overwrite results instead of continuing them.
    pub restart: bool,
    /// Share of the campaign to fly.
    pub shard: Shard,
    /// Worker threads; none: one per core.
    pub threads: Option<u32>,
}

/// Flies the missing runs and writes table, report and summary.
///
/// # Errors
/// See [`CampaignError`].
pub fn fly(
    campaign: &Campaign,
    options: &CampaignOptions,
    progress: &dyn CampaignProgress,
) -> Result<Summary, CampaignError> {
    if let Some(splitting) = &campaign.definition().splitting {
        return splitting::fly(campaign, splitting, options, progress);
    }
    let directory = options.out.join(options.shard.directory_name(campaign.name()));
    let share = options.shard.range(campaign.runs());
    let mut store = Store::open(&directory, campaign, &share, options.restart)?;
    let mut stop = Sequential::new(campaign);
    if stop.is_some() && options.shard != Shard::WHOLE {
        let message =
            "a campaign with `[stop]` cannot be shared: each run decides whether the next is flown";
        return Err(CampaignError::Usage(message.to_owned()));
    }
    let mut decided = match &mut stop {
        Some(stop) if store.next() > share.start => take_in(stop, &directory)?,
        _ => false,
    };
    let missing = if decided { 0..0 } else { store.next()..share.end };
    progress.begin(share.len() as u32, share.len() as u32 - missing.len() as u32);
    let pool = pool(options.threads)?;
    let flown = execute(campaign, missing, &pool, progress, |runs| {
        for run in runs {
            store.append(&run.lines)?;
            decided = stop.as_mut().is_some_and(|stop| stop.push(&run.rows));
            if decided || progress.cancelled() {
                return Err(CampaignError::Interrupted);
            }
        }
        Ok(())
    });
    if !decided {
        flown?;
    }
    conclude(&CampaignResults::open(&directory)?, options.shard == Shard::WHOLE)
}

/// Takes in the runs in `directory`; `true` if they decide.
fn take_in(stop: &mut Sequential, directory: &Path) -> Result<bool, CampaignError> {
    let results = CampaignResults::open(directory)?;
    for row in results.rows()? {
        stop.push(&[row?]);
    }
    Ok(stop.is_decided())
}

/// Writes the files that follow from a complete table; of a share no page, whose flights would be flown again for it.
///
/// # Errors
/// When they cannot be written.
pub(super) fn conclude(results: &CampaignResults, whole: bool) -> Result<Summary, CampaignError> {
    #[cfg(feature = "parquet")]
    super::parquet::write(results)?;
    if whole {
        super::report::write(results)?;
    }
    Summary::read(results)
}

/// Flies the run with `seed` again in one variant or in all, with trace and figures, as a single
/// scenario is flown; `before` receives the command that repeats each.
///
/// # Errors
/// When the campaign has no such seed or variant, and those of [`run::fly`].
pub fn repeat(
    campaign: &Campaign,
    seed: u32,
    variant: Option<&str>,
    options: &FlightOptions,
    before: &dyn Fn(&str),
) -> Result<Vec<FlightReport>, CampaignError> {
    if campaign.definition().splitting.is_some() {
        let message = "a flight of `[splitting]` has no seed of its own: its page lists commands";
        return Err(CampaignError::Usage(message.to_owned()));
    }
    let index = campaign.index(seed).ok_or_else(|| {
        let (first, last) = (campaign.seed(0), campaign.seed(campaign.runs() - 1));
        let name = campaign.name();
        CampaignError::Usage(format!(
            "seed {seed} is not a run of `{name}`: choose one from {first} to {last}"
        ))
    })?;
    let out = options.out.join(campaign.name()).join(format!("seed-{seed}"));
    let options = FlightOptions { out, ..options.clone() };
    let mut reports = Vec::new();
    for variant in chosen(campaign, variant)? {
        before(&campaign.replay_command(index, variant));
        let scenario = campaign.scenario(index, variant)?.renamed(&variant.name);
        reports.push(run::fly(&scenario, &options, &|_| ())?);
    }
    Ok(reports)
}

/// The variant of that name, or all.
fn chosen<'a>(
    campaign: &'a Campaign,
    name: Option<&str>,
) -> Result<Vec<&'a Variant>, CampaignError> {
    let chosen: Vec<_> =
        campaign.variants().iter().filter(|it| name.is_none_or(|name| it.name == name)).collect();
    if chosen.is_empty() {
        let known: Vec<_> = campaign.variants().iter().map(|it| it.name.as_str()).collect();
        let name = name.unwrap_or_default();
        let message = format!("no variant `{name}`: choose from {}", known.join(", "));
        return Err(CampaignError::Usage(message));
    }
    Ok(chosen)
}

/// Names and descriptions of the built-in campaigns.
#[must_use]
pub fn built_in_table() -> String {
    let width = BuiltInCampaign::ALL.iter().map(|it| it.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for built_in in BuiltInCampaign::ALL {
        let description = Campaign::open(built_in.name, &Default::default(), &[])
            .map_or_else(|error| error.to_string(), |it| it.definition().description.clone());
        let _ = writeln!(text, "{:width$}  {description}", built_in.name);
    }
    text
}
