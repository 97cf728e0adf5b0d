//! The runs closest to each bound and those beyond it, with the command that flies each again.

use std::fmt::Write;

use super::scan::Scan;
use super::summary::swatch;
use super::tightest::Close;
use crate::campaign::{Campaign, Guarantee, Variant};
use crate::figure::svg::escape;
use sim::number::number;

/// Violated runs that are listed without a click.
const OPEN: u64 = 10;

/// The section's content.
#[must_use]
pub fn section(campaign: &Campaign, scan: &Scan) -> String {
    let mut page = violations(campaign, scan);
    page.push_str("<h3>Tightest margins</h3>\n");
    for (index, variant) in campaign.variants().iter().enumerate() {
        let tallies = campaign.guarantees().iter().zip(&scan.variants[index].tallies);
        for (guarantee, tally) in tallies {
            let runs = tally.as_ref().map_or(&[][..], |tally| tally.tightest.runs());
            if let Some(worst) = runs.first() {
                page += &tightest(campaign, (index, variant), guarantee, worst, runs);
            }
        }
    }
    page
}

fn tightest(
    campaign: &Campaign,
    (index, variant): (usize, &Variant),
    guarantee: &Guarantee,
    worst: &Close,
    runs: &[Close],
) -> String {
    let unit = if guarantee.unit == "-" { "1" } else { guarantee.unit };
    let unit = escape(unit);
    let mut page = format!(
        "<details><summary>{}{}, {}: {}, seed {}</summary>\n\
         <div class=\"table\"><table><thead><tr><th class=\"n\">seed</th>\
         <th class=\"n\">observed [{unit}]</th><th class=\"n\">margin [{unit}]</th>\
         <th>command</th></tr></thead><tbody>\n",
        swatch(index),
        escape(&variant.name),
        escape(guarantee.name),
        margin(worst, &unit),
        worst.seed,
    );
    for run in runs {
        let _ = writeln!(
            page,
            "<tr><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>{}</tr>",
            run.seed,
            run.observed.map_or_else(|| "-".to_owned(), number),
            if run.margin.is_nan() { "-".to_owned() } else { number(run.margin) },
            command(campaign, run.seed, variant)
        );
    }
    page + "</tbody></table></div></details>\n"
}

fn margin(worst: &Close, unit: &str) -> String {
    if worst.margin.is_nan() {
        "nothing observed".to_owned()
    } else {
        format!("margin {} {unit}", number(worst.margin))
    }
}

fn violations(campaign: &Campaign, scan: &Scan) -> String {
    let all = scan.violated();
    if all == 0 {
        return "<p>No run violated a guarantee.</p>\n".to_owned();
    }
    let listed = scan.violations.len();
    let which = if listed as u64 == all {
        format!("{all} violated runs")
    } else {
        format!("The first {listed} of {all} violated runs")
    };
    let open = if all <= OPEN { " open" } else { "" };
    let mut page = format!(
        "<details{open}><summary>{which}</summary>\n<div class=\"table\"><table><thead><tr>\
         <th class=\"n\">seed</th><th>variant</th><th>violated</th><th>command</th></tr></thead>\
         <tbody>\n"
    );
    for row in &scan.violations {
        let variant = &campaign.variants()[row.variant];
        let _ = writeln!(
            page,
            "<tr><td class=\"n\">{}</td><th>{}{}</th><td class=\"reason\">{}</td>{}</tr>",
            row.seed,
            swatch(row.variant),
            escape(&variant.name),
            escape(&row.reason),
            command(campaign, row.seed, variant)
        );
    }
    page + "</tbody></table></div></details>\n"
}

/// A cell with a button that copies the command, and the command itself.
fn command(campaign: &Campaign, seed: u32, variant: &Variant) -> String {
    let Some(index) = campaign.index(seed) else {
        return "<td>-</td>".to_owned();
    };
    let command = escape(&campaign.replay_command(index, variant));
    format!(
        "<td class=\"command\"><button type=\"button\">Copy</button><code>{command}</code></td>"
    )
}
