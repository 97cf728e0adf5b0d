//! Style sheets and scripts of the pages: files under `assets/`, put into the program so that a page
//! needs nothing but itself.

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// Colours, type and tables of every page.
const PAGE_STYLE: &str = include_str!("../assets/page.css");

/// Charts, tiles and the replay.
const REPORT_STYLE: &str =
    concat!(include_str!("../assets/uplot/uPlot.min.css"), include_str!("../assets/report.css"));

/// Choice of the theme; goes into the head, so that a page is not shown in the wrong one first.
const THEME: &str = include_str!("../assets/theme.js");

/// Scripts of replay and charts, in order.
const REPLAY: [&str; 12] = [
    include_str!("../assets/uplot/uPlot.iife.min.js"),
    include_str!("../assets/element.js"),
    include_str!("../assets/number.js"),
    include_str!("../assets/command.js"),
    include_str!("../assets/chart/chart.js"),
    include_str!("../assets/replay/rotation.js"),
    include_str!("../assets/replay/flight.js"),
    include_str!("../assets/replay/camera.js"),
    include_str!("../assets/replay/scene.js"),
    include_str!("../assets/replay/orbit.js"),
    include_str!("../assets/replay/strip.js"),
    include_str!("../assets/replay/player.js"),
];

/// Scripts of a flight's page, beside the replay, in order.
pub const RUN: [&str; 2] =
    [include_str!("../assets/chart/figure.js"), include_str!("../assets/run.js")];

/// Scripts of a campaign's report, beside the replay, in order.
pub const REPORT: [&str; 5] = [
    include_str!("../assets/tooltip.js"),
    include_str!("../assets/chart/distribution.js"),
    include_str!("../assets/chart/scatter.js"),
    include_str!("../assets/chart/heat_map.js"),
    include_str!("../assets/report.js"),
];

/// No page may load anything, wherever it is opened.
const CONTENT_POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// A page: its name and description, the button that changes the theme, `content`, its data as JSON,
/// the replay, and `own` scripts.
#[must_use]
pub fn page(name: &str, description: &str, content: &Markup, json: &str, own: &[&str]) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(CONTENT_POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (name) }
                style { (PreEscaped(PAGE_STYLE)) (PreEscaped(REPORT_STYLE)) }
                (scripts(&[THEME]))
            }
            body {
                header {
                    div { h1 { (name) } p { (description) } }
                    button #theme type="button" { "Dark theme" }
                }
                (content)
                noscript {
                    p.fail { "Charts and replays need JavaScript; nothing is loaded from anywhere." }
                }
                #tooltip role="tooltip" hidden {}
                #copied role="status" hidden {}
                (data(json))
                (scripts(&REPLAY))
                (scripts(own))
            }
        }
    };
    page.into_string()
}

/// Script elements with the given texts, none of which may hold `</script`.
fn scripts(texts: &[&str]) -> Markup {
    html! {
        @for text in texts { script { "\n" (PreEscaped(text)) } }
    }
}

/// An element that holds `json` for the scripts of a page.
fn data(json: &str) -> Markup {
    // A string of the data must not end the element.
    let json = json.replace("</", "<\\/");
    html! { script #data type="application/json" { (PreEscaped(json)) } }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sha2::{Digest, Sha256};

    #[test]
    fn the_chart_library_is_unmodified() {
        let sum = |text: &str| -> String {
            Sha256::digest(text).iter().map(|byte| format!("{byte:02x}")).collect()
        };
        let readme = include_str!("../assets/README.md");
        for file in [
            include_str!("../assets/uplot/uPlot.iife.min.js"),
            include_str!("../assets/uplot/uPlot.min.css"),
            include_str!("../assets/uplot/LICENSE"),
        ] {
            assert!(readme.contains(&sum(file)), "no file of assets/README.md has {}", sum(file));
        }
    }

    #[test]
    fn no_script_ends_its_element() {
        for text in REPLAY.iter().chain(&REPORT).chain(&RUN).chain(&[THEME]) {
            assert!(!text.contains("</script") && !text.contains("<!--"));
        }
    }

    #[test]
    fn data_cannot_end_its_element_and_reads_back() {
        let hostile = "</script><script>alert(1)</script>";
        let page = data(&serde_json::to_string(hostile).expect("a string")).into_string();
        assert_eq!(page.matches("</").count(), 1, "{page}");
        let json = page.split_once('>').and_then(|(_, rest)| rest.rsplit_once("</"));
        let (json, _) = json.expect("an element");
        assert_eq!(serde_json::from_str::<String>(json).expect("JSON"), hostile);
    }
}
