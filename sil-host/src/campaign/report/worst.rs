//! The runs closest to each bound and those beyond it, with the command that flies each again.

use maud::{Markup, html};

use super::scan::Scan;
use super::summary::swatch;
use super::tightest::Close;
use crate::campaign::{Campaign, Guarantee, Variant};
use sim::number::number;

/// Violated runs that are listed without a click.
const OPEN: u64 = 10;

/// The section's content.
#[must_use]
pub fn section(campaign: &Campaign, scan: &Scan) -> Markup {
    html! {
        (violations(campaign, scan))
        h3 { "Tightest margins" }
        @for (index, variant) in campaign.variants().iter().enumerate() {
            @for (guarantee, tally) in campaign.guarantees().iter().zip(&scan.variants[index].tallies) {
                @if let Some(tally) = tally {
                    (tightest(campaign, (index, variant), guarantee, tally.tightest.runs()))
                }
            }
        }
    }
}

fn tightest(
    campaign: &Campaign,
    (index, variant): (usize, &Variant),
    guarantee: &Guarantee,
    runs: &[Close],
) -> Markup {
    let unit = if guarantee.unit == "-" { "1" } else { guarantee.unit };
    html! {
        @if let Some(worst) = runs.first() {
            details {
                summary {
                    (swatch(index)) (variant.name) ", " (guarantee.name) ": " (margin(worst, unit))
                    ", seed " (worst.seed)
                }
                .table { table {
                    thead { tr {
                        th.n { "seed" } th.n { "observed [" (unit) "]" } th.n { "margin [" (unit) "]" }
                        th { "command" }
                    } }
                    tbody {
                        @for run in runs {
                            tr {
                                td.n { (run.seed) }
                                td.n { (run.observed.map_or_else(|| "-".to_owned(), number)) }
                                td.n { @if run.margin.is_nan() { "-" } @else { (number(run.margin)) } }
                                (command(campaign, run.seed, variant))
                            }
                        }
                    }
                } }
            }
        }
    }
}

fn margin(worst: &Close, unit: &str) -> String {
    if worst.margin.is_nan() {
        "nothing observed".to_owned()
    } else {
        format!("margin {} {unit}", number(worst.margin))
    }
}

fn violations(campaign: &Campaign, scan: &Scan) -> Markup {
    let all = scan.violated();
    let listed = scan.violations.len();
    html! {
        @if all == 0 {
            p { "No run violated a guarantee." }
        } @else {
            details open[all <= OPEN] {
                summary {
                    @if listed as u64 == all {
                        (all) " violated runs"
                    } @else {
                        "The first " (listed) " of " (all) " violated runs"
                    }
                }
                .table { table {
                    thead { tr {
                        th.n { "seed" } th { "variant" } th { "violated" } th { "command" }
                    } }
                    tbody {
                        @for row in &scan.violations {
                            @let variant = &campaign.variants()[row.variant];
                            tr {
                                td.n { (row.seed) }
                                th { (swatch(row.variant)) (variant.name) }
                                td.reason { (row.reason) }
                                (command(campaign, row.seed, variant))
                            }
                        }
                    }
                } }
            }
        }
    }
}

/// A cell with a button that copies the command, and the command itself.
fn command(campaign: &Campaign, seed: u32, variant: &Variant) -> Markup {
    html! {
        @if let Some(index) = campaign.index(seed) {
            td.command {
                button type="button" { "Copy" }
                code { (campaign.replay_command(index, variant)) }
            }
        } @else {
            td { "-" }
        }
    }
}
