//! Page of a campaign by splitting.

use maud::{Markup, html};

use super::Splitting;
use super::estimate::RareProbability;
use super::walk::Place;
use crate::asset;
use crate::campaign::report::definition;
use crate::campaign::{Campaign, Variant};
use sim::number::number;

/// Runs whose commands are listed.
const LISTED: usize = 20;

/// The whole page; `places` are the particles at the end.
pub fn page<'a>(
    campaign: &Campaign,
    splitting: &Splitting,
    rare: &RareProbability,
    counts: [u32; 3],
    places: impl Iterator<Item = &'a Place>,
) -> String {
    let sections = [
        ("summary", "Summary", summary(rare, counts)),
        ("method", "Method", method(splitting, rare)),
        ("definition", "Definition", definition::varied(campaign)),
        ("worst", "Runs that violate it", commands(campaign, rare, places)),
    ];
    let content = html! {
        nav aria-label="Sections" {
            @for (id, title, _) in &sections { a href={ "#" (id) } { (title) } }
        }
        main {
            @for (id, title, content) in &sections { section id=(id) { h2 { (title) } (content) } }
        }
    };
    asset::page(campaign.name(), &campaign.definition().description, &content, "{}", &[])
}

fn summary(rare: &RareProbability, [held, violated, refused]: [u32; 3]) -> Markup {
    let class = if rare.passed() && rare.finished { "pass" } else { "fail" };
    let tiles = [
        (format!("{:.2e}", rare.probability), "probability"),
        (format!("{:.1e}", rare.lower), "lower bound"),
        (format!("{:.1e}", rare.upper), "upper bound"),
        (rare.flights.to_string(), "flights"),
        (format!("{:.1e}", rare.equivalent_draws), "independent draws instead"),
    ];
    html! {
        p class={ "result " (class) } { (rare.sentence()) }
        .tiles { @for (value, name) in &tiles { .tile { b { (value) } span { (name) } } } }
        p.muted {
            (held) " flights held it, " (violated) " violated it, " (refused) " were refused. Most were chosen near \
             its violation: their share is no probability."
        }
    }
}

fn method(splitting: &Splitting, rare: &RareProbability) -> Markup {
    html! {
        p {
            (splitting.replicas) " replicas of " (splitting.particles) " particles, walks of " (splitting.steps)
            " steps; " (rare.replaced) " times the particle nearest to holding the guarantee was replaced by one \
             nearer to violating it. docs/campaign-evidence.md derives estimate and interval."
        }
        p.muted {
            "The interval is exact for walks that forget where they began. The number of replacements then scatters \
             between the replicas as a Poisson variable does, with a dispersion of 1; here it is "
            (format!("{:.2}", rare.dispersion)) ". Where it is more, the interval has been widened to what the \
             replicas show. " (format!("{:.0} %", 100.0 * rare.acceptance)) " of the proposals were accepted."
        }
        @if !rare.finished {
            p.fail {
                "The campaign's runs were used up before every particle violated the guarantee: the upper bound \
                 holds, the estimate is one of the level that was reached."
            }
        }
    }
}

fn commands<'a>(
    campaign: &Campaign,
    rare: &RareProbability,
    places: impl Iterator<Item = &'a Place>,
) -> Markup {
    let variant = &campaign.variants()[0];
    html! {
        @if rare.finished {
            p.muted { "Particles at the end: draws of the runs that violate the guarantee." }
            .table { table {
                thead { tr {
                    @for parameter in campaign.parameters() { th.n { (parameter.path) } }
                    th.n { "seed" } th { "command" }
                } }
                tbody { @for place in places.take(LISTED) { (run(campaign, variant, place)) } }
            } }
        }
    }
}

/// Values, seed and command of one run.
fn run(campaign: &Campaign, variant: &Variant, place: &Place) -> Markup {
    let values = campaign.values_at(&place.unit());
    html! {
        tr {
            @for value in &values { td.n { (number(*value)) } }
            td.n { (place.seed) }
            td.command {
                button type="button" { "Copy" }
                code { (campaign.command(variant, &values, place.seed)) }
            }
        }
    }
}
