//! `campaign`.

use std::num::NonZeroU32;
use std::path::PathBuf;

use clap::Args;
use sil_host::campaign::{
    BuiltInCampaign, Campaign, CampaignError, CampaignOptions, CampaignOverrides, Shard, Summary,
    built_in_table, fly, repeat,
};
use sil_host::report::{self, FlightReport};
use sil_host::run::FlightOptions;

use super::LogArguments;
use super::campaign_progress::CampaignProgressBar;
use super::run::TRACE_EVERY;

/// Arguments of `campaign`.
#[derive(Clone, Debug, Args)]
pub struct CampaignArguments {
    /// Built-in campaign or TOML file.
    #[arg(value_name = "NAME|FILE", required_unless_present = "list")]
    pub campaign: Option<String>,
    /// List the built-in campaigns.
    #[arg(long)]
    pub list: bool,
    /// Print the campaign in full: save it, change it, fly the file.
    #[arg(long)]
    pub show: bool,
    /// Change a value of every scenario, as in `--set controller.saturated.k4=3` (repeatable).
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub changes: Vec<String>,
    /// Number of runs, in place of the campaign's.
    #[arg(long, value_name = "N")]
    pub runs: Option<u32>,
    /// Seed of the first run, in place of the campaign's.
    #[arg(long, value_name = "N")]
    pub first_seed: Option<u32>,
    /// Output directory; the campaign gets a directory below it, and results in it are continued.
    #[arg(long, default_value = "out", value_name = "DIR")]
    pub out: PathBuf,
    /// Overwrite results instead of continuing them.
    #[arg(long)]
    pub restart: bool,
    /// Fly only the i-th of n shares; `merge` joins them.
    #[arg(long, default_value = "1/1", value_name = "i/n")]
    pub shard: Shard,
    /// Worker threads [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub threads: Option<u32>,
    /// Re-run a single run by seed, with trace and figures.
    #[arg(long, value_name = "SEED", conflicts_with_all = ["shard", "restart"])]
    pub only: Option<u32>,
    /// With --only: the only variant to fly.
    #[arg(long, value_name = "NAME", requires = "only")]
    pub variant: Option<String>,
    /// With --only: control ticks per row of the trace.
    #[arg(long, default_value_t = TRACE_EVERY, value_name = "N")]
    pub trace_every: NonZeroU32,
    /// With --only: logs.
    #[command(flatten)]
    pub log: LogArguments,
    /// Show no progress, and print only violated guarantees.
    #[arg(long, short)]
    pub quiet: bool,
    /// Print the summary as JSON instead of a table.
    #[arg(long)]
    pub json: bool,
}

/// Flies a campaign, or lists, shows or repeats; `true` if every guarantee held.
///
/// # Errors
/// See [`CampaignError`].
pub fn campaign(arguments: &CampaignArguments) -> Result<bool, CampaignError> {
    if arguments.list {
        print!("{}", built_in_table());
        return Ok(true);
    }
    let name = arguments.campaign.as_ref().ok_or_else(|| {
        CampaignError::Usage(
            "no campaign is named: `campaign --list` lists the built-in ones".to_owned(),
        )
    })?;
    let overrides = CampaignOverrides { runs: arguments.runs, first_seed: arguments.first_seed };
    let campaign = Campaign::open(name, &overrides, &arguments.changes)?;
    match (arguments.show, arguments.only) {
        (true, _) => {
            let built_in = BuiltInCampaign::named(name).map(|it| it.text.to_owned());
            print!("{}", built_in.unwrap_or_else(|| campaign.text()));
            Ok(true)
        }
        (_, Some(seed)) => repeat_run(&campaign, seed, arguments),
        _ => fly_campaign(&campaign, arguments),
    }
}

fn fly_campaign(campaign: &Campaign, arguments: &CampaignArguments) -> Result<bool, CampaignError> {
    let CampaignArguments { out, restart, shard, threads, .. } = arguments;
    let options =
        CampaignOptions { out: out.clone(), restart: *restart, shard: *shard, threads: *threads };
    let progress = CampaignProgressBar::new(campaign.name(), arguments.quiet);
    let summary = fly(campaign, &options, &progress)?;
    progress.finish();
    print_summary(&summary, arguments.json, arguments.quiet);
    Ok(summary.passed)
}

/// Prints a campaign's summary.
pub(super) fn print_summary(summary: &Summary, json: bool, quiet: bool) {
    if json {
        println!("{}", summary.json());
    } else {
        print!("{}", summary.table(quiet));
    }
}

/// Flies one run again, with trace and figures, as `run` does.
fn repeat_run(
    campaign: &Campaign,
    seed: u32,
    arguments: &CampaignArguments,
) -> Result<bool, CampaignError> {
    let options = FlightOptions {
        out: arguments.out.clone(),
        trace_every: arguments.trace_every,
        log: arguments.log.options(),
    };
    let announce = |command: &str| {
        if !arguments.quiet && !arguments.json {
            println!("{command}");
        }
    };
    let reports = repeat(campaign, seed, arguments.variant.as_deref(), &options, &announce)?;
    if arguments.json {
        println!("{}", report::json(&reports));
    } else {
        reports.iter().for_each(|it| print!("{}", report::table(it, arguments.quiet)));
    }
    Ok(reports.iter().all(FlightReport::passed))
}
