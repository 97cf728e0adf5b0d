//! Section on the varied values, their sampling, and the meaning of the report's bounds.

use maud::{Markup, html};

use crate::campaign::{Campaign, Sampling, Vary};
use sim::number::number;

/// The section's content.
#[must_use]
pub fn section(campaign: &Campaign) -> Markup {
    let definition = campaign.definition();
    html! {
        p { (sampling(definition.sampling)) }
        p {
            (campaign.runs()) " runs, seeds " (campaign.seed(0)) " to "
            (campaign.seed(campaign.runs() - 1))
            "; a run has the same values and the same seed, from which its disturbance is drawn too, in \
             every variant."
        }
        (varied(campaign))
        (settings(campaign))
    }
}

/// Distributions of the varied values.
#[must_use]
pub fn varied(campaign: &Campaign) -> Markup {
    let definition = campaign.definition();
    html! {
        @if !definition.vary.is_empty() {
            .table { table {
                thead { tr { th { "varied" } th { "distribution" } th { "unit" } } }
                tbody {
                    @for vary in &definition.vary {
                        tr {
                            th { code { (vary.path) @for path in &vary.also { ", " (path) } } }
                            td { (distribution(vary)) }
                            td { (vary.unit) }
                        }
                    }
                }
            } }
        }
    }
}

/// Settings of all runs and of each variant.
fn settings(campaign: &Campaign) -> Markup {
    let definition = campaign.definition();
    let all = ("All runs set".to_owned(), &definition.set);
    let each = definition.variant.iter().map(|it| (format!("Variant {} sets", it.name), &it.set));
    let changed = std::iter::once(all).chain(each).filter(|(_, changes)| !changes.is_empty());
    html! {
        @for (name, changes) in changed {
            p {
                (name) ": "
                @for (index, change) in changes.iter().enumerate() {
                    @if index > 0 { ", " }
                    code { (change) }
                }
            }
        }
        @for variant in campaign.variants().iter().filter(|it| !campaign.is_replayable_by_name(it)) {
            p.fail {
                "This program has another scenario " code { (variant.scenario) } " than the one that was \
                 flown: the commands below repeat the runs only with the program that wrote the results."
            }
        }
    }
}

/// Explanation of the sampling and of the bounds on the failure probability under it.
#[must_use]
pub fn sampling(sampling: Sampling) -> &'static str {
    match sampling {
        Sampling::MonteCarlo => {
            "Monte Carlo: every run draws its values and its disturbance independently. The bounds on \
             the failure probability are exact for vehicles and flights distributed as defined here."
        }
        Sampling::LatinHypercube => {
            "Latin hypercube: every stratum of each value is met once, so runs are not independent. \
             The bounds on the failure probability are computed as if they were. Stratified samples \
             usually scatter less, which makes the bounds cautious, but that is not proved for rare \
             violations."
        }
        Sampling::Sobol => {
            "Owen-scrambled Sobol points: they fill the space more evenly than independent draws. The \
             bounds on the failure probability are computed as if runs were independent. Such points \
             usually scatter less, which makes the bounds cautious, but that is not proved for rare \
             violations."
        }
        Sampling::Grid => {
            "Grid: the levels are a choice, not draws of a distribution. Counts are shares of the grid; \
             the bounds on the failure probability say what these counts would mean if every run drew \
             its cell at random, and promise nothing between the levels."
        }
    }
}

/// A distribution in words.
fn distribution(vary: &Vary) -> String {
    let span = |lower: f64, upper: f64| format!("{} to {}", number(lower), number(upper));
    if let Some(range) = &vary.uniform {
        return format!("uniform, {}", span(range.lower, range.upper));
    }
    if let Some(range) = &vary.log_uniform {
        return format!("log-uniform, {}", span(range.lower, range.upper));
    }
    if let Some(normal) = &vary.normal {
        let cut = |side, end: Option<f64>| {
            end.map_or(String::new(), |x| format!(", {side} {}", number(x)))
        };
        let (mean, deviation) = (number(normal.mean), number(normal.deviation));
        let ends = cut("not below", normal.lower) + &cut("not above", normal.upper);
        return format!("normal, mean {mean}, standard deviation {deviation}{ends}");
    }
    if let Some(it) = &vary.triangular {
        return format!("triangular, {}, mode {}", span(it.lower, it.upper), number(it.mode));
    }
    if let Some(values) = &vary.values {
        let values: Vec<_> = values.iter().map(|value| number(*value)).collect();
        return format!("one of {}", values.join(", "));
    }
    if let Some(it) = &vary.linspace {
        return format!("{} levels, {}", it.levels, span(it.lower, it.upper));
    }
    if let Some(it) = &vary.logspace {
        return format!("{} levels at equal ratios, {}", it.levels, span(it.lower, it.upper));
    }
    vary.rigid_body.as_ref().map_or_else(String::new, |range| {
        format!("principal moments of a rigid body, {}", span(range.lower, range.upper))
    })
}
