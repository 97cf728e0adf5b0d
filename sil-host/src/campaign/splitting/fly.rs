//! Flies a campaign by splitting: replicas side by side, each asked for a run and told its score.

use std::path::Path;

use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use super::Splitting;
use super::estimate::RareProbability;
use super::page;
use super::replica::Replica;
use super::table::{Flight, Flights};
use super::walk::Place;
use crate::campaign::error::CampaignError;
use crate::campaign::execute::pool;
use crate::campaign::flight::fly_values;
use crate::campaign::fly::CampaignOptions;
use crate::campaign::plan::Campaign;
use crate::campaign::progress::CampaignProgress;
use crate::campaign::row::{Row, RunOutcome};
use crate::campaign::shard::Shard;
use crate::campaign::summary::{Summary, VariantSummary};

/// Flies what is missing of `campaign`, and writes the table, the page and the summary.
///
/// Flights that the table holds are taken from there: the campaign continues where it was interrupted.
///
/// # Errors
/// See [`CampaignError`].
pub fn fly(
    campaign: &Campaign,
    splitting: &Splitting,
    options: &CampaignOptions,
    progress: &dyn CampaignProgress,
) -> Result<Summary, CampaignError> {
    if options.shard != Shard::WHOLE {
        let message =
            "a campaign with `[splitting]` cannot be shared: its flights depend on each other";
        return Err(CampaignError::Usage(message.to_owned()));
    }
    let directory = options.out.join(campaign.name());
    let mut flights = Flights::open(&directory, campaign, options.restart)?;
    progress.begin(campaign.runs(), (flights.held() as u32).min(campaign.runs()));
    let pool = pool(options.threads)?;
    let mut ascent = Ascent::new(campaign, splitting);
    while let Some(round) = ascent.round() {
        let held = flights.held().min(round.len());
        let fresh = pool.install(|| {
            let flown = round[held..].par_iter().map(|asked| {
                let (flight, time) = asked.fly(campaign, ascent.guarantee);
                progress.run_completed(time, flight.outcome == RunOutcome::Violated);
                flight
            });
            flown.collect::<Vec<_>>()
        });
        let mut fresh = fresh.into_iter();
        for asked in round {
            match flights.take() {
                Some(flight) if flight.is_of(asked.replica, &asked.place, &asked.values) => {
                    ascent.tell(asked, &flight);
                }
                Some(_) => return Err(flights.foreign()),
                None => {
                    let Some(flight) = fresh.next() else { break };
                    let kept = ascent.tell(asked, &flight);
                    flights.append(&flight, kept)?;
                }
            }
        }
        if progress.cancelled() {
            return Err(CampaignError::Interrupted);
        }
    }
    conclude(&directory, campaign, splitting, ascent)
}

/// A run that a replica has asked for.
#[derive(Debug)]
struct Asked {
    replica: u32,
    place: Place,
    values: Vec<f64>,
}

impl Asked {
    /// The flight, and its simulated time (s).
    fn fly(&self, campaign: &Campaign, guarantee: usize) -> (Flight, f64) {
        let mut time = 0.0;
        let row = fly_values(campaign, self.place.seed, self.values.clone(), 0, &mut time);
        let Row { seed, parameters, outcome, guarantees, .. } = row;
        let seen = guarantees[guarantee];
        let mut flight = Flight { replica: self.replica, seed, values: parameters, outcome, seen };
        if let Some(score) = flight.score() {
            // Of the one guarantee; others may have failed.
            flight.outcome = if score > 0.0 { RunOutcome::Violated } else { RunOutcome::Held };
        }
        (flight, time)
    }
}

/// All replicas.
struct Ascent<'a> {
    campaign: &'a Campaign,
    /// Number of the guarantee among the columns.
    guarantee: usize,
    replicas: Vec<Replica>,
    flights: u64,
    counts: [u32; 3],
}

impl<'a> Ascent<'a> {
    fn new(campaign: &'a Campaign, splitting: &Splitting) -> Self {
        let guarantee = campaign.guarantees().iter().position(|it| it.key == splitting.guarantee);
        let replica =
            |number| Replica::new(splitting, campaign.seed(0), number, campaign.dimensions());
        Self {
            campaign,
            guarantee: guarantee.unwrap_or_default(), // checked with the definition
            replicas: (0..splitting.replicas).map(replica).collect(),
            flights: 0,
            counts: [0; 3],
        }
    }

    /// The next run of every replica that is not done; none at the end, or when the campaign's runs are used up.
    fn round(&mut self) -> Option<Vec<Asked>> {
        let left = u64::from(self.campaign.runs()).saturating_sub(self.flights) as usize;
        let campaign = self.campaign;
        let going = self.replicas.iter().filter(|replica| !replica.is_done()).count();
        if going == 0 || left < going {
            return None;
        }
        let ask = |(number, replica): (usize, &mut Replica)| {
            let place = replica.ask()?;
            let values = campaign.values_at(&place.unit());
            Some(Asked { replica: number as u32, place, values })
        };
        Some(self.replicas.iter_mut().enumerate().filter_map(ask).collect())
    }

    /// Passes a flight on to its replica; `true` if it is kept.
    fn tell(&mut self, asked: Asked, flight: &Flight) -> bool {
        self.flights += 1;
        let outcomes = RunOutcome::ALL.iter().zip(&mut self.counts);
        outcomes.for_each(|(outcome, count)| *count += u32::from(*outcome == flight.outcome));
        self.replicas[asked.replica as usize].tell(asked.place, flight.score())
    }

    fn probability(&self, splitting: &Splitting) -> RareProbability {
        let sum = |value: fn(&Replica) -> u64| self.replicas.iter().map(value).sum::<u64>() as f64;
        let replaced: Vec<_> = self.replicas.iter().map(|replica| replica.replaced).collect();
        let finished = self.replicas.iter().all(Replica::is_done);
        let unset = RareProbability {
            guarantee: splitting.guarantee.clone(),
            probability: f64::NAN,
            lower: 0.0,
            upper: 1.0,
            confidence: splitting.confidence,
            demanded: splitting.failure_probability,
            finished,
            replaced: 0,
            dispersion: 1.0,
            acceptance: sum(|it| it.accepted) / sum(|it| it.proposed).max(1.0),
            flights: self.flights,
            equivalent_draws: 0.0,
        };
        unset.estimated(&replaced, splitting.particles)
    }
}

/// Writes the page; the summary.
fn conclude(
    directory: &Path,
    campaign: &Campaign,
    splitting: &Splitting,
    ascent: Ascent<'_>,
) -> Result<Summary, CampaignError> {
    let rare = ascent.probability(splitting);
    let places = ascent.replicas.iter().flat_map(Replica::places);
    let path = directory.join(crate::campaign::report::REPORT);
    let html = page::page(campaign, splitting, &rare, ascent.counts, places);
    std::fs::write(&path, html).map_err(CampaignError::io(&path))?;
    let [held, violated, refused] = ascent.counts;
    let passed = rare.passed();
    let variant = VariantSummary {
        name: campaign.variants()[0].name.clone(),
        held,
        violated,
        refused,
        rare: Some(rare),
        ..VariantSummary::default()
    };
    Ok(Summary {
        name: campaign.name().to_owned(),
        description: campaign.definition().description.clone(),
        directory: directory.to_owned(),
        passed,
        variants: vec![variant],
    })
}
