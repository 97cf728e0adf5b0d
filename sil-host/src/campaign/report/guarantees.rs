//! The verdict on each guarantee, one table per variant.

use maud::{Markup, html};

use super::scan::{Scan, VariantScan};
use super::summary::{probability, swatch};
use super::tally::Tally;
use crate::campaign::{Campaign, Guarantee};
use crate::report::bound;
use sim::number::number;

/// The section's content.
#[must_use]
pub fn section(campaign: &Campaign, scan: &Scan) -> Markup {
    html! {
        p.muted {
            "Bounds on the probability that a run violates a guarantee are those of Clopper and Pearson \
             with 95 % confidence: a two-sided interval, or, where no run violated it, a one-sided upper \
             bound. Refused runs do not count."
        }
        @for (index, (variant, counts)) in campaign.variants().iter().zip(&scan.variants).enumerate() {
            h3 { (swatch(index)) (variant.name) }
            .table { table {
                thead { tr {
                    th {} th { "guarantee" } th { "equation" } th.n { "bound" } th.n { "held" }
                    th.n { "violated" } th { "probability of a violation" } th.n { "worst observed" }
                    th.n { "margin" } th { "unit" } th.n { "seed" }
                } }
                tbody { (rows(campaign, counts)) }
            } }
            (remarks(counts))
        }
    }
}

fn rows(campaign: &Campaign, counts: &VariantScan) -> Markup {
    let tallies = campaign.guarantees().iter().zip(&counts.tallies);
    let bounds = tallies.filter_map(|(guarantee, tally)| Some((guarantee, tally.as_ref()?)));
    html! {
        @for (guarantee, tally) in bounds.filter(|(_, tally)| tally.is_bound()) {
            (row(guarantee, tally))
        }
    }
}

fn row(guarantee: &Guarantee, tally: &Tally) -> Markup {
    let (class, result) = match (tally.runs, tally.violated) {
        (0, _) => ("info", "none"),
        (_, 0) => ("pass", "held"),
        _ => ("fail", "violated"),
    };
    let optional = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), number);
    let worst = tally.tightest.runs().first();
    html! {
        tr {
            td class=(class) { (result) }
            td { (guarantee.name) }
            td { (guarantee.equation) }
            td.n { @if tally.varies { "varies, as " } (bound(tally.requirement)) }
            td.n { (tally.runs - tally.violated) }
            td.n { (tally.violated) }
            td { (probability(tally.probability(), tally.violated)) }
            td.n { (optional(worst.and_then(|run| run.observed))) }
            td.n { (optional(worst.map(|run| run.margin).filter(|margin| !margin.is_nan()))) }
            td { (guarantee.unit) }
            td.n { (worst.map_or_else(|| "-".to_owned(), |run| run.seed.to_string())) }
        }
    }
}

/// Note on how to read the table.
fn remarks(counts: &VariantScan) -> Markup {
    let tallies = || counts.tallies.iter().flatten();
    let unobserved = tallies().map(|tally| tally.unobserved).max().unwrap_or(0);
    html! {
        @if tallies().any(|tally| tally.varies) {
            p.muted {
                "A bound that varies follows the varied values; the one shown is that of the first run."
            }
        }
        @if unobserved > 0 {
            p.muted {
                "What a flight never observed, as when it ends before the settling time, counts as \
                 violated: " (unobserved) " runs."
            }
        }
    }
}
