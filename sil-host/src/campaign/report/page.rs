//! The page: what is text is text; what is drawn is drawn by its scripts from the data it carries.

use std::fmt::Write;

use super::document::Document;
use super::scan::Scan;
use super::{definition, guarantees, summary, worst};
use crate::asset;
use crate::campaign::Campaign;
use crate::figure::svg::escape;

/// The whole page.
///
/// # Panics
/// Never: the data are plain numbers and texts.
#[must_use]
pub fn html(campaign: &Campaign, scan: &Scan, document: &Document) -> String {
    let name = escape(campaign.name());
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">{}\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <title>{name}</title>\n<style>\n{}{}</style>\n{}</head><body>\n\
         <header><div><h1>{name}</h1>\n<p>{}</p></div>\
         <button id=\"theme\" type=\"button\">Dark theme</button></header>\n",
        asset::CONTENT_POLICY,
        asset::PAGE_STYLE,
        asset::REPORT_STYLE,
        asset::scripts(&[asset::THEME]),
        escape(&campaign.definition().description),
    );
    page += &sections(campaign, scan);
    page.push_str(
        "<noscript><p class=\"fail\">Charts and replays need JavaScript; nothing is loaded from \
         anywhere.</p></noscript>\n\
         <div id=\"tooltip\" role=\"tooltip\" hidden></div>\n\
         <div id=\"copied\" role=\"status\" hidden></div>\n",
    );
    page += &asset::data(&serde_json::to_string(document).expect("numbers and texts"));
    page += &asset::scripts(&asset::REPLAY);
    page += &asset::scripts(&asset::REPORT);
    page.push_str("</body></html>\n");
    page
}

/// Links to all sections, and the sections; those that scripts fill are empty.
fn sections(campaign: &Campaign, scan: &Scan) -> String {
    let shown = scan.shown().len();
    let flown: u64 = scan.variants.iter().map(super::scan::VariantScan::flown).sum();
    let draw = if shown as u64 == flown {
        "<p class=\"muted\">Every run that was flown.</p>\n".to_owned()
    } else {
        format!(
            "<p class=\"muted\">{shown} of {flown} flights: a draw that does not depend on their \
             outcome, and the violated runs listed above.</p>\n"
        )
    };
    let axes = campaign.definition().envelope.as_ref();
    let over = axes.map(|[across, up]| format!("{} and {}", escape(across), escape(up)));
    let mut all = vec![
        ("summary", "Summary", summary::section(campaign, scan)),
        ("definition", "Definition", definition::section(campaign)),
        ("guarantees", "Guarantees", guarantees::section(campaign, scan)),
        ("worst", "Worst cases", worst::section(campaign, scan)),
        ("distributions", "Distributions", String::new()),
        ("scatter", "Parameters and margins", draw),
    ];
    if let Some(over) = over {
        let text = format!(
            "<p class=\"muted\">Share of flights that held every guarantee, over {over}.</p>\n"
        );
        all.push(("envelope", "Recovery envelope", text));
    }
    if flown > 0 {
        let text =
            "<p class=\"muted\">Flown again from their seeds when this page was written.</p>\n";
        all.push(("replay", "Replay", text.to_owned()));
    }
    let mut page = String::from("<nav aria-label=\"Sections\">");
    for (id, title, _) in &all {
        let _ = write!(page, "<a href=\"#{id}\">{title}</a>");
    }
    page.push_str("</nav>\n<main>\n");
    for (id, title, content) in &all {
        let _ = writeln!(page, "<section id=\"{id}\"><h2>{title}</h2>\n{content}</section>");
    }
    page + "</main>\n"
}
