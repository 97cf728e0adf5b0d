//! The verdict on each guarantee, a table a variant.

use std::fmt::Write;

use super::scan::{Scan, VariantScan};
use super::summary::{probability, swatch};
use super::tally::Tally;
use crate::campaign::{Campaign, Guarantee};
use crate::figure::svg::escape;
use crate::report::bound;
use sim::number::number;

const HEADINGS: &str = "<div class=\"table\"><table><thead><tr><th></th><th>guarantee</th><th>equation</th>\
     <th class=\"n\">bound</th><th class=\"n\">held</th><th class=\"n\">violated</th>\
     <th>probability of a violation</th><th class=\"n\">worst observed</th>\
     <th class=\"n\">margin</th><th>unit</th><th class=\"n\">seed</th></tr></thead><tbody>\n";

/// The section's content.
#[must_use]
pub fn section(campaign: &Campaign, scan: &Scan) -> String {
    let mut page = String::from(
        "<p class=\"muted\">Bounds on the probability that a run violates a guarantee are those of \
         Clopper and Pearson with 95 % confidence: a two-sided interval, or, where no run violated \
         it, a one-sided upper bound. Refused runs do not count.</p>\n",
    );
    for (index, (variant, counts)) in campaign.variants().iter().zip(&scan.variants).enumerate() {
        let name = escape(&variant.name);
        let _ = writeln!(page, "<h3>{}{name}</h3>", swatch(index));
        page.push_str(HEADINGS);
        page += &rows(campaign, counts);
        page.push_str("</tbody></table></div>\n");
        page += &remarks(counts);
    }
    page
}

fn rows(campaign: &Campaign, counts: &VariantScan) -> String {
    let tallies = campaign.guarantees().iter().zip(&counts.tallies);
    let bounds = tallies.filter_map(|(guarantee, tally)| Some((guarantee, tally.as_ref()?)));
    bounds.filter(|(_, tally)| tally.is_bound()).map(|(it, tally)| row(it, tally)).collect()
}

fn row(guarantee: &Guarantee, tally: &Tally) -> String {
    let (class, result) = match (tally.runs, tally.violated) {
        (0, _) => ("info", "none"),
        (_, 0) => ("pass", "held"),
        _ => ("fail", "violated"),
    };
    let optional = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), number);
    let worst = tally.tightest.runs().first();
    let mut requirement = escape(&bound(tally.requirement));
    if tally.varies {
        requirement = format!("varies, as {requirement}");
    }
    format!(
        "<tr><td class=\"{class}\">{result}</td><td>{}</td><td>{}</td><td class=\"n\">{requirement}</td>\
         <td class=\"n\">{}</td><td class=\"n\">{}</td><td>{}</td><td class=\"n\">{}</td>\
         <td class=\"n\">{}</td><td>{}</td><td class=\"n\">{}</td></tr>\n",
        escape(guarantee.name),
        escape(&guarantee.equation),
        tally.runs - tally.violated,
        tally.violated,
        probability(tally.probability(), tally.violated),
        optional(worst.and_then(|run| run.observed)),
        optional(worst.map(|run| run.margin).filter(|margin| !margin.is_nan())),
        escape(guarantee.unit),
        worst.map_or_else(|| "-".to_owned(), |run| run.seed.to_string()),
    )
}

/// Note on how to read the table.
fn remarks(counts: &VariantScan) -> String {
    let mut page = String::new();
    let tallies = || counts.tallies.iter().flatten();
    if tallies().any(|tally| tally.varies) {
        page.push_str(
            "<p class=\"muted\">A bound that varies follows the varied values; the one shown is that \
             of the first run.</p>\n",
        );
    }
    let unobserved = tallies().map(|tally| tally.unobserved).max().unwrap_or(0);
    if unobserved > 0 {
        let _ = writeln!(
            page,
            "<p class=\"muted\">What a flight never observed, as when it ends before the settling time, \
             counts as violated: {unobserved} runs.</p>"
        );
    }
    page
}
