//! The page: what is text is text; what is drawn is drawn by its scripts from the data it carries.

use maud::{Markup, html};

use super::document::Document;
use super::scan::{Scan, VariantScan};
use super::{definition, evidence, guarantees, summary, worst};
use crate::asset;
use crate::campaign::{Campaign, Decision, Evidence};

/// The whole page.
///
/// # Panics
/// Never: the data are plain numbers and texts.
#[must_use]
pub fn page(
    campaign: &Campaign,
    scan: &Scan,
    document: &Document,
    evidence: &[Evidence],
) -> String {
    let json = serde_json::to_string(document).expect("numbers and texts");
    let description = &campaign.definition().description;
    asset::page(
        campaign.name(),
        description,
        &sections(campaign, scan, evidence),
        &json,
        &asset::REPORT,
    )
}

/// Links to all sections, and the sections; those that scripts fill have at most an introduction.
fn sections(campaign: &Campaign, scan: &Scan, evidence: &[Evidence]) -> Markup {
    let flown: u64 = scan.variants.iter().map(VariantScan::flown).sum();
    let mut all = vec![
        ("summary", "Summary", summary::section(campaign, scan, is_decided(evidence))),
        ("definition", "Definition", definition::section(campaign)),
        ("guarantees", "Guarantees", guarantees::section(campaign, scan)),
        ("worst", "Worst cases", worst::section(campaign, scan)),
        ("distributions", "Distributions", html! {}),
        ("scatter", "Parameters and margins", drawn(scan.shown().len(), flown)),
    ];
    if !evidence.is_empty() {
        all.insert(1, ("evidence", "Evidence", evidence::section(campaign, evidence)));
    }
    if let Some([across, up]) = &campaign.definition().envelope {
        let over = html! {
            p.muted { "Share of flights that held every guarantee, over " (across) " and " (up) "." }
        };
        all.push(("envelope", "Recovery envelope", over));
    }
    if flown > 0 {
        let when = html! { p.muted { "Flown again from their seeds when this page was written." } };
        all.push(("replay", "Replay", when));
    }
    html! {
        nav aria-label="Sections" {
            @for (id, title, _) in &all { a href={ "#" (id) } { (title) } }
        }
        main {
            @for (id, title, content) in &all {
                section id=(id) { h2 { (title) } (content) }
            }
        }
    }
}

/// `true` if the campaign ended because its demand was decided.
fn is_decided(evidence: &[Evidence]) -> bool {
    !evidence.is_empty() && evidence.iter().all(|it| it.decision != Decision::Undecided)
}

/// The number of flights that the chart draws, and their choice.
fn drawn(shown: usize, flown: u64) -> Markup {
    html! {
        p.muted {
            @if shown as u64 == flown {
                "Every run that was flown."
            } @else {
                (shown) " of " (flown) " flights: a draw that does not depend on their outcome, and the \
                 violated runs listed above."
            }
        }
    }
}
