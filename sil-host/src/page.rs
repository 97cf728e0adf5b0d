//! One self-contained HTML page per scenario: result, table of guarantees, all figures, and a replay.

use std::fmt::Write;

use serde_json::json;

use crate::asset;
use crate::figure::svg::escape;
use crate::replay3d::Track;
use crate::report::{FlightReport, bound};
use sim::guarantee::{Requirement, Verdict};
use sim::number::number;

/// The page of one flight; `figures` are SVG documents, `track` is what it replays.
#[must_use]
pub fn html(outcome: &FlightReport, figures: &[String], track: &Track) -> String {
    let mut page = asset::beginning(&outcome.name, &outcome.description);
    for sentence in &outcome.broken_assumptions {
        let _ = writeln!(page, "<p class=\"fail\">Outside the theorem: {}.</p>", escape(sentence));
    }
    let (class, result) = if outcome.passed() {
        ("pass", "Every guarantee holds")
    } else {
        ("fail", "A guarantee is violated")
    };
    let _ = writeln!(
        page,
        "<p class=\"result {class}\">{result} over {} s of flight.</p>",
        number(outcome.flight_time)
    );
    page.push_str("<h2>Guarantees</h2>\n");
    page.push_str(&table(&outcome.verdicts));
    page.push_str("<section id=\"replay\"><h2>Replay</h2>\n</section>\n<h2>Figures</h2>\n");
    for figure in figures {
        let _ = writeln!(page, "<figure>{figure}</figure>");
    }
    let data = json!({ "name": outcome.name, "track": track }).to_string();
    page + &asset::end(&data, &[asset::RUN])
}

fn table(verdicts: &[Verdict]) -> String {
    let mut table = String::from(
        "<div class=\"table\"><table><thead><tr><th></th><th>guarantee</th><th>equation</th><th>bound</th>\
         <th>observed</th><th>margin</th><th>unit</th><th>at [s]</th></tr></thead><tbody>\n",
    );
    for verdict in verdicts {
        let result = match verdict.requirement {
            Requirement::Information => "info",
            _ if verdict.pass => "pass",
            _ => "fail",
        };
        let optional = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), number);
        let _ = writeln!(
            table,
            "<tr><td class=\"{result}\">{result}</td><td>{}</td><td>{}</td>\
             <td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td>{}</td>\
             <td class=\"n\">{}</td></tr>",
            escape(verdict.name),
            escape(verdict.equation),
            escape(&bound(verdict.requirement)),
            optional(verdict.observed),
            optional(verdict.margin),
            escape(verdict.unit),
            verdict.time.map_or_else(|| "-".to_owned(), |time| format!("{time:.3}")),
        );
    }
    table.push_str("</tbody></table></div>\n");
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::guarantee::verdict::Extreme;

    fn outcome(observed: f64) -> FlightReport {
        let row = ("thrust <peak>", "(7)", "N");
        FlightReport {
            name: "a-flight".to_owned(),
            description: "f & g".to_owned(),
            broken_assumptions: vec!["mass > m_hi".to_owned()],
            verdicts: vec![Verdict::new(
                row,
                Requirement::AtMost(12.0),
                Extreme::at(observed, 1.5),
            )],
            flight_time: 20.0,
            wall_time: 0.1,
            directory: "out/a-flight".into(),
        }
    }

    #[test]
    fn the_page_shows_result_and_rows_and_escapes_text() {
        let page = html(&outcome(11.5), &[], &Track::new(&[]));
        assert!(page.contains("Every guarantee holds over 20 s"));
        assert!(page.contains("thrust &lt;peak&gt;") && page.contains("f &amp; g"));
        assert!(page.contains("mass &gt; m_hi"));
        assert!(page.contains("&lt;= 12") && page.contains(">11.5<") && page.contains(">1.500<"));
        assert!(page.contains("default-src 'none'") && !page.contains("src="), "self-contained");
    }

    #[test]
    fn a_violation_is_shown() {
        let page = html(&outcome(12.5), &[], &Track::new(&[]));
        assert!(page.contains("A guarantee is violated") && page.contains("class=\"fail\">fail"));
    }
}
