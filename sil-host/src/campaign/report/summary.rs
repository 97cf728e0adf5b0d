//! Summary of the results in a few numbers.

use maud::{Markup, html};

use super::failure_probability::FailureProbability;
use super::scan::{Scan, VariantScan};
use crate::campaign::Campaign;
use sim::number::number;

/// The section's content.
#[must_use]
pub fn section(campaign: &Campaign, scan: &Scan, decided: bool) -> Markup {
    let flown: u64 = scan.variants.iter().map(VariantScan::flown).sum();
    let refused: u64 = scan.variants.iter().map(|it| it.refused).sum();
    let violated = scan.violated();
    let (class, result) = match (flown, violated) {
        (0, _) => ("fail", "Nothing was flown.".to_owned()),
        (_, 0) => ("pass", format!("Every guarantee held in all {flown} flights.")),
        _ => ("fail", format!("{violated} of {flown} flights violated a guarantee.")),
    };
    let runs: u64 = scan.variants.iter().map(|it| it.flown() + it.refused).max().unwrap_or(0);
    let tiles = [
        (runs, "runs"),
        (campaign.variants().len() as u64, "variants"),
        (flown, "flights"),
        (flown - violated, "held"),
        (violated, "violated"),
        (refused, "refused"),
    ];
    html! {
        p class={ "result " (class) } { (result) }
        .tiles {
            @for (value, name) in tiles { .tile { b { (value) } span { (name) } } }
        }
        @if decided {
            p.muted {
                "The campaign ended after " (runs) " of at most " (campaign.runs()) " runs, as soon as its demand \
                 was decided."
            }
        } @else if runs < u64::from(campaign.runs()) {
            p.fail { "The table has " (runs) " of the campaign's " (campaign.runs()) " runs." }
        }
        (table(campaign, scan))
        (refusals(campaign, scan))
    }
}

fn table(campaign: &Campaign, scan: &Scan) -> Markup {
    html! {
        .table { table {
            thead { tr {
                th { "variant" } th { "scenario" } th.n { "flown" } th.n { "held" } th.n { "violated" }
                th { "probability of any violation" } th.n { "refused" } th.n { "outside the theorem" }
            } }
            tbody {
                @for (index, (variant, counts)) in campaign.variants().iter().zip(&scan.variants).enumerate() {
                    tr {
                        th { (swatch(index)) (variant.name) }
                        td { (variant.scenario) }
                        td.n { (counts.flown()) }
                        td.n { (counts.held) }
                        td.n.fail[counts.violated > 0] { (counts.violated) }
                        td {
                            (probability(
                                FailureProbability::observed(counts.violated, counts.flown()),
                                counts.violated,
                            ))
                        }
                        td.n { (counts.refused) }
                        td.n { (outside(counts)) }
                    }
                }
            }
        } }
    }
}

fn outside(counts: &VariantScan) -> String {
    match counts.outside {
        0 => "0".to_owned(),
        outside => format!("{outside} ({} violated)", counts.outside_violated),
    }
}

fn refusals(campaign: &Campaign, scan: &Scan) -> Markup {
    html! {
        @for (variant, counts) in campaign.variants().iter().zip(&scan.variants) {
            @for (reason, (runs, seed)) in &counts.refusals {
                p.muted {
                    (variant.name) ": " (runs) " refused, the first with seed " (seed) ": " (reason)
                }
            }
        }
    }
}

/// A patch in the colour of a variant; colours repeat after the last, as they do in `theme.js`.
pub(super) fn swatch(variant: usize) -> Markup {
    html! { span class={ "swatch v" (variant % 6) } {} }
}

/// The bounds in words: two-sided, or one-sided when nothing was violated.
pub(super) fn probability(bounds: Option<FailureProbability>, violated: u64) -> String {
    let Some(bounds) = bounds else { return "-".to_owned() };
    if violated == 0 {
        format!("fewer than {} of runs", scientific(bounds.below))
    } else {
        format!("{} to {}", scientific(bounds.lower), scientific(bounds.upper))
    }
}

/// Two significant digits; small ones as `3.0e-4`.
fn scientific(share: f64) -> String {
    if share > 0.0 && share < 0.01 {
        format!("{share:.1e}")
    } else {
        number((share * 1e3).round() / 1e3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_violation_is_a_one_sided_bound_and_some_are_an_interval() {
        let text =
            |violated, runs| probability(FailureProbability::observed(violated, runs), violated);
        assert_eq!(text(0, 10_000), "fewer than 3.0e-4 of runs");
        assert_eq!(text(3, 50), "0.013 to 0.165");
        assert_eq!(text(10, 10), "0.692 to 1");
        assert_eq!(text(0, 0), "-");
    }
}
