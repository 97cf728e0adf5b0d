//! One self-contained HTML page per scenario: result, table of guarantees, all figures, and a replay.

use maud::{Markup, html};
use serde_json::json;

use crate::asset;
use crate::figure::Figure;
use crate::replay3d::Track;
use crate::report::{FlightReport, bound};
use sim::guarantee::{Requirement, Verdict};
use sim::number::number;

/// The page of one flight, with its figures and the track that it replays.
#[must_use]
pub fn page(outcome: &FlightReport, figures: &[Figure], track: &Track) -> String {
    let (class, result) = if outcome.passed() {
        ("pass", "Every guarantee holds")
    } else {
        ("fail", "A guarantee is violated")
    };
    let content = html! {
        @for sentence in &outcome.broken_assumptions {
            p.fail { "Outside the theorem: " (sentence) "." }
        }
        p class={ "result " (class) } { (result) " over " (number(outcome.flight_time)) " s of flight." }
        h2 { "Guarantees" }
        (table(&outcome.verdicts))
        section #replay { h2 { "Replay" } }
        section #figures { h2 { "Figures" } }
    };
    let data = json!({ "name": outcome.name, "track": track, "figures": figures }).to_string();
    asset::page(&outcome.name, &outcome.description, &content, &data, &asset::RUN)
}

fn table(verdicts: &[Verdict]) -> Markup {
    let optional = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), number);
    html! {
        .table { table {
            thead { tr {
                th {} th { "guarantee" } th { "equation" } th { "bound" } th { "observed" }
                th { "margin" } th { "unit" } th { "at [s]" }
            } }
            tbody {
                @for verdict in verdicts {
                    tr {
                        @let result = result(verdict);
                        td class=(result) { (result) }
                        td { (verdict.name) }
                        td { (verdict.equation) }
                        td.n { (bound(verdict.requirement)) }
                        td.n { (optional(verdict.observed)) }
                        td.n { (optional(verdict.margin)) }
                        td { (verdict.unit) }
                        td.n { (verdict.time.map_or_else(|| "-".to_owned(), |time| format!("{time:.3}"))) }
                    }
                }
            }
        } }
    }
}

fn result(verdict: &Verdict) -> &'static str {
    match verdict.requirement {
        Requirement::Information => "info",
        _ if verdict.pass => "pass",
        _ => "fail",
    }
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
        let page = page(&outcome(11.5), &[], &Track::new(&[]));
        assert!(page.contains("Every guarantee holds over 20 s"));
        assert!(page.contains("thrust &lt;peak&gt;") && page.contains("f &amp; g"));
        assert!(page.contains("mass &gt; m_hi"));
        assert!(page.contains("&lt;= 12") && page.contains(">11.5<") && page.contains(">1.500<"));
        assert!(page.contains("default-src 'none'") && !page.contains("src="), "self-contained");
    }

    #[test]
    fn a_violation_is_shown() {
        let page = page(&outcome(12.5), &[], &Track::new(&[]));
        assert!(page.contains("A guarantee is violated") && page.contains("class=\"fail\">fail"));
    }
}
