//! Section on the demand of `[stop]` and what the runs say about it.

use maud::{Markup, html};

use super::summary::swatch;
use crate::campaign::{Campaign, Decision, Evidence};

/// The section's content.
#[must_use]
pub fn section(campaign: &Campaign, evidence: &[Evidence]) -> Markup {
    html! {
        p.muted {
            "The campaign looks at its runs at numbers that are fixed beforehand, and ends once the demand is shown or \
             refuted. Its looks share the error, so that a decision is right with the stated confidence however \
             often it looks (docs/campaign-evidence.md). The bounds of the latest look hold together with those \
             of all others; the tables below, whose bounds are made for a fixed number of runs, do not know of the looks."
        }
        .table { table {
            thead { tr {
                th { "variant" } th { "demand" } th { "decision" } th.n { "runs" } th.n { "violated" }
                th.n { "looks" } th { "probability, bounds" } th.n { "confidence" }
            } }
            tbody {
                @for (index, (variant, it)) in campaign.variants().iter().zip(evidence).enumerate() {
                    (row(index, &variant.name, it))
                }
            }
        } }
    }
}

fn row(index: usize, variant: &str, evidence: &Evidence) -> Markup {
    let (class, decision) = match evidence.decision {
        Decision::Demonstrated => ("pass", "shown"),
        Decision::Refuted => ("fail", "refuted"),
        Decision::Undecided => ("fail", "undecided"),
    };
    let bounds = evidence
        .bounds
        .map_or_else(|| "-".to_owned(), |(lower, upper)| format!("{lower:.2e} to {upper:.2e}"));
    let what = evidence.guarantee.as_deref().unwrap_or("any guarantee");
    html! {
        tr {
            th { (swatch(index)) (variant) }
            td { (what) ": at most " (format!("{:e}", evidence.demanded)) }
            td class=(class) { (decision) }
            td.n { (evidence.runs) }
            td.n { (evidence.violated) }
            td.n { (evidence.looks) }
            td { (bounds) }
            td.n { (evidence.confidence) }
        }
    }
}
