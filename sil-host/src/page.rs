//! One self-contained HTML page a scenario: result, table of guarantees, and all figures.

use std::fmt::Write;

use crate::figure::svg::escape;
use crate::guarantee::{Requirement, Verdict};
use crate::report::{Outcome, bound, number};

const STYLE: &str = "
:root { color-scheme: light; }
body { margin: 2rem auto; max-width: 1160px; padding: 0 1rem; background: #fff; color: #222;
       font: 15px/1.45 Helvetica, Arial, 'Liberation Sans', sans-serif; }
h1 { font-size: 1.5rem; margin-bottom: .2rem; }
h2 { font-size: 1.15rem; margin-top: 2rem; }
p.result { font-weight: bold; }
table { border-collapse: collapse; font-size: 13.5px; }
th, td { padding: .22rem .7rem; border-bottom: 1px solid #e2e2e2; text-align: left; }
th { border-bottom: 2px solid #444; }
td.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.pass { color: #1a7f37; } .fail { color: #c1121f; font-weight: bold; } .info { color: #777; }
figure { margin: 1.4rem 0; } figure svg { width: 100%; height: auto; }
";

/// The page of one flight; `figures` are SVG documents.
#[must_use]
pub fn html(outcome: &Outcome, figures: &[String]) -> String {
    let mut page = String::new();
    let name = escape(&outcome.name);
    let _ = write!(
        page,
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{name}</title>\
         <style>{STYLE}</style></head><body>\n<h1>{name}</h1>\n<p>{}</p>\n",
        escape(&outcome.description)
    );
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
    page.push_str("<h2>Figures</h2>\n");
    for figure in figures {
        let _ = writeln!(page, "<figure>{figure}</figure>");
    }
    page.push_str("</body></html>\n");
    page
}

fn table(verdicts: &[Verdict]) -> String {
    let mut table = String::from(
        "<table><thead><tr><th></th><th>guarantee</th><th>equation</th><th>bound</th>\
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
    table.push_str("</tbody></table>\n");
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guarantee::verdict::Extreme;

    fn outcome(observed: f64) -> Outcome {
        let row = ("thrust <peak>", "(7)", "N");
        Outcome {
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
        let page = html(&outcome(11.5), &[]);
        assert!(page.contains("Every guarantee holds over 20 s"));
        assert!(page.contains("thrust &lt;peak&gt;") && page.contains("f &amp; g"));
        assert!(page.contains("mass &gt; m_hi"));
        assert!(page.contains("&lt;= 12") && page.contains(">11.5<") && page.contains(">1.500<"));
        assert!(!page.contains("http") && !page.contains("src="), "self-contained");
    }

    #[test]
    fn a_violation_is_shown() {
        let page = html(&outcome(12.5), &[]);
        assert!(page.contains("A guarantee is violated") && page.contains("class=\"fail\">fail"));
    }
}
