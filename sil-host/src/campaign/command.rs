//! `campaign`: flies what is missing of a campaign and tells what came out.

use std::fmt::Write;

use super::built_in::BuiltInCampaign;
use super::error::CampaignError;
use super::execute::{execute, pool};
use super::plan::{Campaign, Variant};
use super::progress::Progress;
use super::store::Store;
use super::summary::Summary;
use super::table::Results;
use crate::cli::{CampaignArguments, RunArguments};
use crate::report::{self, Outcome};
use crate::run;

/// Flies a campaign, or lists, shows or repeats; whether every guarantee held.
///
/// # Errors
/// See [`CampaignError`].
pub fn campaign(arguments: &CampaignArguments) -> Result<bool, CampaignError> {
    if arguments.list {
        print!("{}", built_in_table());
        return Ok(true);
    }
    let name = arguments.campaign.as_ref().ok_or_else(|| {
        CampaignError::Usage("which campaign? --list lists the built-in ones".to_owned())
    })?;
    let campaign = Campaign::open(name, &arguments.own_changes(), &arguments.changes)?;
    match (arguments.show, arguments.only) {
        (true, _) => {
            let built_in = BuiltInCampaign::named(name).map(|it| it.text.to_owned());
            print!("{}", built_in.unwrap_or_else(|| campaign.text()));
            Ok(true)
        }
        (_, Some(seed)) => repeat(&campaign, seed, arguments),
        _ => fly(&campaign, arguments),
    }
}

/// Names and descriptions of the built-in campaigns.
#[must_use]
pub fn built_in_table() -> String {
    let width = BuiltInCampaign::ALL.iter().map(|it| it.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for built_in in BuiltInCampaign::ALL {
        let description = Campaign::open(built_in.name, &[], &[])
            .map_or_else(|error| error.to_string(), |it| it.definition().description.clone());
        let _ = writeln!(text, "{:width$}  {description}", built_in.name);
    }
    text
}

fn fly(campaign: &Campaign, arguments: &CampaignArguments) -> Result<bool, CampaignError> {
    let directory = arguments.out.join(arguments.shard.directory_name(campaign.name()));
    let share = arguments.shard.range(campaign.runs());
    let mut store = Store::open(&directory, campaign, &share, arguments.restart)?;
    let missing = store.next()..share.end;
    let before = share.len() as u32 - missing.len() as u32;
    let pool = pool(arguments.threads)?;
    let progress = Progress::new(campaign.name(), share.len() as u32, before, arguments.quiet);
    execute(campaign, missing, &pool, &progress, |lines| store.append(lines))?;
    progress.finish();
    conclude(&Results::open(&directory)?, arguments.json, arguments.quiet)
}

/// Writes what follows from a complete table, and prints the summary; whether every guarantee held.
pub(super) fn conclude(results: &Results, json: bool, quiet: bool) -> Result<bool, CampaignError> {
    #[cfg(feature = "parquet")]
    super::parquet::write(results)?;
    super::report::write(results)?;
    let summary = Summary::read(results)?;
    if json {
        println!("{}", summary.json());
    } else {
        print!("{}", summary.table(quiet));
    }
    Ok(summary.passed)
}

/// Flies one run again, with trace and figures, as `run` does.
fn repeat(
    campaign: &Campaign,
    seed: u32,
    arguments: &CampaignArguments,
) -> Result<bool, CampaignError> {
    let index = campaign.index(seed).ok_or_else(|| {
        let (first, last) = (campaign.seed(0), campaign.seed(campaign.runs() - 1));
        CampaignError::Usage(format!("--only {seed}: seeds go from {first} to {last}"))
    })?;
    let variants = chosen(campaign, arguments.variant.as_deref())?;
    let mut outcomes = Vec::new();
    for variant in variants {
        if !arguments.quiet && !arguments.json {
            println!("{}", campaign.replay_command(index, variant));
        }
        let arguments = RunArguments {
            scenarios: Vec::new(),
            changes: Vec::new(),
            out: arguments.out.join(campaign.name()).join(format!("seed-{seed}")),
            trace_every: arguments.trace_every,
            seed: None,
            quiet: arguments.quiet,
            json: arguments.json,
            log: arguments.log.clone(),
        };
        let scenario = campaign.scenario(index, variant)?.renamed(&variant.name);
        outcomes.push(run::fly(&scenario, &arguments)?);
    }
    if arguments.json {
        println!("{}", report::json(&outcomes));
    } else {
        outcomes.iter().for_each(|it| print!("{}", report::table(it, arguments.quiet)));
    }
    Ok(outcomes.iter().all(Outcome::passed))
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
        let message = format!("--variant: there are {}", known.join(", "));
        return Err(CampaignError::Usage(message));
    }
    Ok(chosen)
}
