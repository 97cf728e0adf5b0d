//! Summary of the results in a few numbers.

use std::fmt::Write;

use super::failure_probability::FailureProbability;
use super::scan::{Scan, VariantScan};
use crate::campaign::Campaign;
use crate::figure::svg::escape;
use sim::number::number;

/// The section's content.
#[must_use]
pub fn section(campaign: &Campaign, scan: &Scan) -> String {
    let flown: u64 = scan.variants.iter().map(VariantScan::flown).sum();
    let refused: u64 = scan.variants.iter().map(|it| it.refused).sum();
    let violated = scan.violated();
    let (class, result) = match (flown, violated) {
        (0, _) => ("fail", "Nothing was flown.".to_owned()),
        (_, 0) => ("pass", format!("Every guarantee held in all {flown} flights.")),
        _ => ("fail", format!("{violated} of {flown} flights violated a guarantee.")),
    };
    let mut page = format!("<p class=\"result {class}\">{result}</p>\n<div class=\"tiles\">");
    let runs: u64 = scan.variants.iter().map(|it| it.flown() + it.refused).max().unwrap_or(0);
    for (value, name) in [
        (runs, "runs"),
        (campaign.variants().len() as u64, "variants"),
        (flown, "flights"),
        (flown - violated, "held"),
        (violated, "violated"),
        (refused, "refused"),
    ] {
        let _ = write!(page, "<div class=\"tile\"><b>{value}</b><span>{name}</span></div>");
    }
    page.push_str("</div>\n");
    if runs < u64::from(campaign.runs()) {
        let _ = writeln!(
            page,
            "<p class=\"fail\">The table has {runs} of the campaign's {} runs.</p>",
            campaign.runs()
        );
    }
    page + &table(campaign, scan)
}

fn table(campaign: &Campaign, scan: &Scan) -> String {
    let mut table = String::from(
        "<div class=\"table\"><table><thead><tr><th>variant</th><th>scenario</th>\
         <th class=\"n\">flown</th><th class=\"n\">held</th><th class=\"n\">violated</th>\
         <th>probability of any violation</th><th class=\"n\">refused</th>\
         <th class=\"n\">outside the theorem</th></tr></thead><tbody>\n",
    );
    for (index, (variant, counts)) in campaign.variants().iter().zip(&scan.variants).enumerate() {
        let _ = writeln!(
            table,
            "<tr><th>{}{}</th><td>{}</td><td class=\"n\">{}</td>\
             <td class=\"n\">{}</td><td class=\"n{}\">{}</td><td>{}</td><td class=\"n\">{}</td>\
             <td class=\"n\">{}</td></tr>",
            swatch(index),
            escape(&variant.name),
            escape(&variant.scenario),
            counts.flown(),
            counts.held,
            if counts.violated > 0 { " fail" } else { "" },
            counts.violated,
            probability(
                FailureProbability::observed(counts.violated, counts.flown()),
                counts.violated
            ),
            counts.refused,
            outside(counts),
        );
    }
    table + "</tbody></table></div>\n" + &refusals(campaign, scan)
}

fn outside(counts: &VariantScan) -> String {
    match counts.outside {
        0 => "0".to_owned(),
        outside => format!("{outside} ({} violated)", counts.outside_violated),
    }
}

fn refusals(campaign: &Campaign, scan: &Scan) -> String {
    let mut list = String::new();
    for (variant, counts) in campaign.variants().iter().zip(&scan.variants) {
        for (reason, (runs, seed)) in &counts.refusals {
            let _ = writeln!(
                list,
                "<p class=\"muted\">{}: {runs} refused, the first with seed {seed}: {}</p>",
                escape(&variant.name),
                escape(reason)
            );
        }
    }
    list
}

/// A patch in the colour of a variant; colours repeat after the last, as they do in `theme.js`.
pub(super) fn swatch(variant: usize) -> String {
    format!("<span class=\"swatch v{}\"></span>", variant % 6)
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
