//! The check of a proposal: a small campaign over the corners of vehicle and first estimates, under every
//! kind of disturbance at its bound, with the predicted peaks as what the flights must keep.

use std::collections::BTreeMap;
use std::path::Path;

use glam::{DVec3, Vec3};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde::Serialize;

use super::noise_flight::{self, NoiseCheck};
use super::proposal::Proposal;
use super::push_flight::{self, PushCheck};
use crate::campaign::{
    Campaign, CampaignError, CampaignOverrides, CampaignProgress, Definition, RunOutcome, Sampling,
    VariantDefinition, Vary, fly_run,
};

/// Steepest start of a check flight (deg).
const TILT_MAX: f64 = 30.0;

/// Result of the check.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// Flights.
    pub flights: u32,
    /// Flights that kept every guarantee.
    pub held: u32,
    /// Predicted peaks and the largest observed errors.
    pub comparisons: Vec<Comparison>,
    /// Reasons of the others, a sentence each.
    pub reasons: Vec<String>,
    /// Torque activity under the rate noise, if there is any.
    pub noise: Option<NoiseCheck>,
    /// Time until a lasting push is held, with integral action.
    pub push: Option<PushCheck>,
}

/// A bound and the worst of all flights.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Name of the guarantee.
    pub name: &'static str,
    /// Predicted peak.
    pub predicted: f64,
    /// Largest of all flights; none if no flight got so far.
    pub observed: Option<f64>,
    /// Unit of both.
    pub unit: &'static str,
}

impl Check {
    /// `true` if every flight kept every guarantee, the torque activity is the predicted one, and a lasting push is held
    /// in the predicted time.
    #[must_use]
    pub fn passed(&self) -> bool {
        let quiet = self.noise.is_none_or(|noise| noise.passed());
        let held = self.push.is_none_or(|push| push.passed());
        self.flights > 0 && self.held == self.flights && quiet && held
    }
}

/// Flies the check of `proposal` on every core.
///
/// # Errors
/// When the campaign cannot be read: a fault of this program.
pub fn check(proposal: &Proposal) -> Result<Check, CampaignError> {
    check_watched(proposal, &())
}

/// As [`check`], with its progress watched.
///
/// # Errors
/// As [`check`], and when `progress` asks for the end.
pub fn check_watched(
    proposal: &Proposal,
    progress: &dyn CampaignProgress,
) -> Result<Check, CampaignError> {
    let campaign = campaign(proposal)?;
    let columns = campaign.guarantees();
    progress.begin(campaign.runs(), 0);
    let runs = (0..campaign.runs()).into_par_iter().map(|index| {
        let run = (!progress.cancelled()).then(|| fly_run(&campaign, index))?;
        progress.run_completed(run.flight_time, run.violated());
        Some(run)
    });
    let runs: Option<Vec<_>> = runs.collect();
    let runs = runs.ok_or(CampaignError::Interrupted)?;
    let rows: Vec<_> = runs.into_iter().flat_map(|run| run.rows).collect();
    let judged = columns.iter().enumerate().filter(|(_, it)| it.name.ends_with("after settling"));
    let comparisons = judged.zip(proposal.bounds()).map(|((column, it), predicted)| Comparison {
        name: it.name,
        predicted,
        observed: rows.iter().map(|row| row.guarantees[column].observed).fold(None, worse),
        unit: it.unit,
    });
    let failed = rows.iter().filter(|row| row.outcome != RunOutcome::Held);
    let reasons = failed.map(|row| {
        let variant = &campaign.variants()[row.variant].name;
        format!("run {}, {variant}: {}", row.seed, row.reason)
    });
    Ok(Check {
        flights: rows.len() as u32,
        held: rows.iter().filter(|row| row.outcome == RunOutcome::Held).count() as u32,
        comparisons: comparisons.collect(),
        reasons: reasons.collect(),
        noise: noise_flight::fly(proposal).map_err(CampaignError::Definition)?,
        push: push_flight::fly(proposal).map_err(CampaignError::Definition)?,
    })
}

/// The larger of two observations; NaN is the largest.
fn worse(kept: Option<f64>, seen: Option<f64>) -> Option<f64> {
    match (kept, seen) {
        (Some(kept), Some(seen)) if kept.is_nan() || kept >= seen => Some(kept),
        (kept, None) => kept,
        (_, seen) => seen,
    }
}

/// The campaign, which `sil-host campaign` can fly, too.
///
/// # Errors
/// As [`check`].
pub fn campaign(proposal: &Proposal) -> Result<Campaign, CampaignError> {
    let name = format!("{}-check", proposal.request.name);
    let text = toml_edit::ser::to_string_pretty(&definition(proposal, &name))
        .expect("a definition is plain TOML");
    Campaign::parse(&name, &text, Path::new(""), &CampaignOverrides::default(), &[])
}

fn definition(proposal: &Proposal, name: &str) -> Definition {
    let request = &proposal.request;
    let known = &request.known;
    let ends = |interval: ctrl_core::vehicle::Interval| {
        let mut ends = vec![f64::from(interval.lower), f64::from(interval.upper)];
        ends.dedup();
        ends
    };
    let between = |path: &str, lower: f64, upper: f64| Vary {
        path: path.to_owned(),
        uniform: Some(crate::campaign::Range { lower, upper }),
        ..Vary::default()
    };
    let mass =
        Vary { path: "vehicle.mass".to_owned(), values: Some(ends(known.mass)), ..Vary::default() };
    let (inertias, pairings) = inertias(proposal);
    let paired = |variant: VariantDefinition| {
        pairings.iter().map(move |(name, set)| VariantDefinition {
            name: format!("{}{name}", variant.name),
            set: [&variant.set[..], set].concat(),
            ..variant.clone()
        })
    };
    Definition {
        name: name.to_owned(),
        description: "Check of proposed gains over the corners of the uncertainty.".to_owned(),
        sampling: Sampling::Grid,
        runs: None,
        first_seed: 1,
        scenario: Some(request.name.clone()),
        set: vec![],
        envelope: None,
        stop: None,
        splitting: None,
        vary: [mass]
            .into_iter()
            .chain(inertias)
            .chain([
                between("initial.tilt_deg", 0.0, TILT_MAX),
                between("initial.tilt_direction_deg", 0.0, 360.0),
                between("initial.heading_deg", 0.0, 360.0),
            ])
            .collect(),
        variant: variants(proposal).into_iter().flat_map(paired).collect(),
        scenarios: BTreeMap::from([(request.name.clone(), proposal.scenario())]),
    }
}

/// Name and changes of a variant.
type Change = (String, Vec<String>);

/// Both ends of the inertia and of its first estimate: levels of the grid while the axes are alike, else
/// variants, since a level is one number.
fn inertias(proposal: &Proposal) -> (Vec<Vary>, Vec<Change>) {
    let known = &proposal.request.known.inertia;
    let paths = [
        "vehicle.inertia".to_owned(),
        format!("controller.{}.initial.inertia", proposal.law.key()),
    ];
    let ends = [known.lower, known.upper];
    if ends.iter().all(|end| *end == Vec3::splat(end.x)) {
        let mut values = ends.map(|end| f64::from(end.x)).to_vec();
        values.dedup();
        let levels = |path: &String| Vary {
            path: format!("{path}[0]"),
            also: vec![format!("{path}[1]"), format!("{path}[2]")],
            values: Some(values.clone()),
            ..Vary::default()
        };
        return (paths.iter().map(levels).collect(), vec![(String::new(), vec![])]);
    }
    let named = [("lower", known.lower), ("upper", known.upper)];
    let pairs = named.into_iter().flat_map(|truth| named.map(|estimate| (truth, estimate)));
    let changes = pairs.map(|((truth, j), (estimate, j_hat))| {
        let set =
            paths.iter().zip([j, j_hat]).map(|(path, j)| format!("{path}={}", list(j.as_dvec3())));
        (format!("-{truth}-inertia-taken-for-{estimate}"), set.collect())
    });
    (vec![], changes.collect())
}

/// A vector in TOML.
fn list(x: DVec3) -> String {
    format!("{:?}", x.to_array())
}

/// Noise at the full bounds; lasting disturbances at the bounds of what may last, at the speed that the
/// position loop likes least; on top of each what integral action is for.
fn variants(proposal: &Proposal) -> Vec<VariantDefinition> {
    let request = &proposal.request;
    let d1 = f64::from(request.known.disturbance_acceleration);
    let d2 = request.lasting_torque;
    let bandwidth = request.wanted.position_bandwidth;
    let calm = ["disturbance.noise.acceleration=0.0", "disturbance.noise.torque=0.0"];
    let variant = |name: &str, set: Vec<String>| VariantDefinition {
        name: name.to_owned(),
        scenario: None,
        set,
    };
    let lasting = |name: &str, more: Vec<String>| {
        variant(name, calm.iter().map(|&change| change.to_owned()).chain(more).collect())
    };
    let steady = request.steady;
    let constant = |sign: f64, d1: f64, d2: DVec3| {
        let push = d1 * DVec3::new(1.0, sign, sign);
        let push = push + steady.acceleration * DVec3::new(1.0, sign, 0.0);
        let torque = (d2 + DVec3::splat(steady.torque)) * DVec3::new(1.0, sign, 1.0);
        vec![
            format!("disturbance.constant.acceleration={}", list(push)),
            format!("disturbance.constant.torque={}", list(torque)),
        ]
    };
    let on_top = |more: Vec<String>| {
        let steady = if steady.is_none() { vec![] } else { constant(1.0, 0.0, DVec3::ZERO) };
        steady.into_iter().chain(more).collect::<Vec<_>>()
    };
    vec![
        variant("noise", on_top(vec![])),
        lasting("constant", constant(1.0, d1, d2)),
        lasting("constant-opposed", constant(-1.0, d1, d2)),
        lasting(
            "sinusoid",
            on_top(vec![
                format!("disturbance.sinusoid.frequency={:?}", bandwidth / core::f64::consts::TAU),
                format!("disturbance.sinusoid.acceleration=[{d1:?}, {d1:?}, {d1:?}]"),
                format!("disturbance.sinusoid.torque={}", list(d2)),
            ]),
        ),
        lasting(
            "gust",
            on_top(vec![
                format!("disturbance.gust.hold={:?}", core::f64::consts::PI / bandwidth),
                format!("disturbance.gust.acceleration={d1:?}"),
                format!("disturbance.gust.torque={}", list(d2)),
            ]),
        ),
    ]
}
