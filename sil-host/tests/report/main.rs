//! The report of a campaign: what it says, and that it works in a browser.

mod browser;
mod fixture;
mod flight;

use std::collections::BTreeSet;

use browser::Browser;
use serde_json::{Value, json};
use sil_host::campaign::RunOutcome;

/// Share of the pixels of the `n`-th canvas below `section` that differ from the most frequent one.
const DRAWN: &str = "((section, n) => {
    const canvas = document.querySelectorAll(section + ' canvas')[n];
    const pixels = new Uint32Array(canvas.getContext('2d')
        .getImageData(0, 0, canvas.width, canvas.height).data.buffer);
    const counts = new Map();
    pixels.forEach((pixel) => counts.set(pixel, (counts.get(pixel) || 0) + 1));
    return 1 - Math.max(...counts.values()) / pixels.length;
})";

/// Every canvas of the page: section, number in it, and what it shows.
const CANVASES: [(&str, usize, &str); 7] = [
    ("#distributions", 0, "histogram"),
    ("#distributions", 1, "cumulative share"),
    ("#scatter", 0, "scatter"),
    ("#envelope", 0, "map of the first variant"),
    ("#envelope", 1, "map of the second variant"),
    ("#replay", 0, "scene"),
    ("#replay", 1, "strip"),
];

/// Pixels by which the page is wider than its window.
const BEYOND: &str = "document.documentElement.scrollWidth - document.documentElement.clientWidth";

fn browser(name: &str) -> Browser {
    Browser::start(&fixture::directory(name))
}

/// `text` as HTML has it.
fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    text.replace('"', "&quot;")
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_else(|| panic!("{value} is no text"))
}

#[test]
fn it_draws_everything_in_both_themes_alone_and_without_complaint() {
    let mut browser = browser("themes");
    let mut backgrounds = BTreeSet::new();
    for theme in ["light", "dark"] {
        for width in [1280, 390] {
            browser.open(fixture::report(), width, theme);
            assert_eq!(browser.evaluate("document.documentElement.dataset.theme"), json!(theme));
            let background = browser.evaluate("getComputedStyle(document.body).backgroundColor");
            backgrounds.insert(text(&background).to_owned());
            for (section, number, what) in CANVASES {
                let drawn = browser.evaluate(&format!("{DRAWN}('{section}', {number})"));
                assert!(drawn.as_f64() > Some(0.003), "{theme}, {width}: {what}: {drawn}");
            }
            let canvases = browser.evaluate("document.querySelectorAll('canvas').length");
            assert_eq!(canvases, json!(CANVASES.len()));
            let beyond = browser.evaluate(BEYOND);
            assert_eq!(beyond, json!(0), "{width} px: the page is wider than the window");
            let complaints = browser.complaints();
            assert!(complaints.is_empty(), "{theme}, {width}: {complaints:#?}");
            let requests = browser.requests();
            assert_eq!(requests, [format!("file://{}", fixture::report().display())]);
        }
    }
    assert_eq!(backgrounds.len(), 2, "{backgrounds:?}");
}

#[test]
fn the_button_changes_the_theme_and_the_charts_with_it() {
    let mut browser = browser("toggle");
    browser.open(fixture::report(), 1280, "light");
    let pixels = "document.querySelector('#scatter canvas').toDataURL()";
    let light = browser.evaluate(pixels);
    browser.evaluate("document.getElementById('theme').click()");
    assert_eq!(browser.evaluate("document.documentElement.dataset.theme"), json!("dark"));
    browser.wait_for("document.getElementById('theme').textContent === 'Light theme'");
    browser.wait_for(&format!("{pixels} !== {light}"));
    browser.evaluate("document.getElementById('theme').click()");
    browser.wait_for(&format!("{pixels} === {light}"));
}

#[test]
fn the_replay_advances_when_played_and_stops() {
    let mut browser = browser("replay");
    browser.open(fixture::report(), 1280, "light");
    let slider = "Number(document.querySelector('#replay input').value)";
    let scene = "document.querySelector('#replay canvas').toDataURL()";
    let button = "document.querySelector('#replay .card button')";
    let start = browser.evaluate(scene);
    assert_eq!(browser.evaluate(slider), json!(0));
    browser.evaluate(&format!("{button}.click()"));
    browser.wait_for(&format!("{slider} > 20"));
    browser.evaluate(&format!("{button}.click()"));
    let stopped = browser.evaluate(slider);
    assert_ne!(browser.evaluate(scene), start, "the scene follows the time");
    let head = browser.evaluate("parseFloat(document.querySelector('.playhead').style.left)");
    assert!(head.as_f64() > Some(0.0), "the strip follows the time: {head}");
    browser.evaluate("new Promise((done) => setTimeout(() => done(true), 150))");
    assert_eq!(browser.evaluate(slider), stopped, "it stands still");

    browser.evaluate("document.querySelector('#replay canvas').focus()");
    let before = browser.evaluate(scene);
    for key in ["ArrowLeft", "+"] {
        browser.press(key);
    }
    assert_ne!(browser.evaluate(scene), before, "keys turn the view");
    let flights = browser.evaluate("document.querySelector('#replay select').options.length");
    assert!(flights.as_u64() > Some(3), "{flights} flights");
}

#[test]
fn a_run_in_the_scatter_plot_gives_its_command() {
    let mut browser = browser("scatter");
    browser.open(fixture::report(), 1280, "light");
    browser.evaluate("document.getElementById('scatter').scrollIntoView()");
    let tooltip = "(() => { const box = document.getElementById('tooltip');
        return box.hidden ? '' : box.textContent; })()";
    let area = browser.evaluate(
        "(() => { const { left, top, width, height } =
            document.querySelector('#scatter .u-over').getBoundingClientRect();
            return [left, top, width, height]; })()",
    );
    let side = |index: usize| area[index].as_f64().expect("a number");
    let places = (0..400).map(|i| {
        let (column, row) = (f64::from(i % 20), f64::from(i / 20));
        [side(0) + (column + 0.5) / 20.0 * side(2), side(1) + (row + 0.5) / 20.0 * side(3)]
    });
    let mut found = None;
    for place in places {
        browser.point(place, false);
        let shown = browser.evaluate(tooltip);
        if text(&shown).starts_with("seed ") {
            browser.point(place, true);
            found = Some(text(&shown).to_owned());
            break;
        }
    }
    let found = found.expect("a run under one of 400 places");
    assert!(found.contains("initial.tilt_deg") && found.contains("deg"), "{found}");
    let (seed, rest) = found["seed ".len()..].split_once(", ").expect("seed, variant");
    let campaign = fixture::campaign(40);
    let variant = campaign.variants().iter().find(|it| rest.starts_with(&it.name));
    let index = campaign.index(seed.parse().expect("a seed")).expect("a run");
    let command = campaign.replay_command(index, variant.expect("a variant"));
    browser.wait_for("!document.getElementById('copied').hidden");
    let copied = browser.evaluate("document.getElementById('copied').textContent");
    assert!(text(&copied).ends_with(&command), "{copied}, not {command}");
}

#[test]
fn cells_of_the_envelope_and_copy_buttons_give_commands() {
    let mut browser = browser("envelope");
    browser.open(fixture::report(), 1280, "dark");
    browser.evaluate("document.querySelectorAll('#envelope canvas')[1].focus()");
    for key in ["ArrowRight", "ArrowUp", "ArrowRight"] {
        browser.press(key);
    }
    let readout = browser.evaluate("document.querySelectorAll('#envelope .card p')[1].textContent");
    let counts = text(&readout);
    assert!(counts.contains("initial.rate_body[0]") && counts.contains(" held ("), "{counts}");
    browser.press("Enter");
    browser.wait_for("document.getElementById('copied').textContent.includes('tilt-recovery')");
    browser.evaluate("document.querySelector('#worst td.command button').click()");
    browser.wait_for(
        "document.getElementById('copied').textContent
            .endsWith(document.querySelector('#worst td.command code').textContent)",
    );
}

#[test]
fn the_page_of_a_single_flight_replays_it() {
    let out = fixture::directory("run");
    let flown = std::process::Command::new(env!("CARGO_BIN_EXE_sil-host"))
        .args(["run", "tilt-recovery", "--quiet", "--set", "duration=4", "--out"])
        .arg(&out)
        .output()
        .expect("sil-host starts");
    assert_eq!(flown.status.code(), Some(1), "four seconds are too few to settle");
    let page = out.join("tilt-recovery/index.html");
    let mut browser = browser("run-profile");
    for (theme, width) in [("light", 1280), ("dark", 390)] {
        browser.open(&page, width, theme);
        for number in [0, 1] {
            let drawn = browser.evaluate(&format!("{DRAWN}('#replay', {number})"));
            assert!(drawn.as_f64() > Some(0.003), "{theme}: canvas {number}: {drawn}");
        }
        browser.evaluate("document.querySelector('#replay .card button').click()");
        browser.wait_for("Number(document.querySelector('#replay input').value) > 20");
        let beyond = browser.evaluate(BEYOND);
        assert_eq!(beyond, json!(0), "{width} px: the page is wider than the window");
        let complaints = browser.complaints();
        assert!(complaints.is_empty(), "{theme}: {complaints:#?}");
        assert_eq!(browser.requests(), [format!("file://{}", page.display())]);
    }
}

#[test]
fn it_tells_the_counts_of_the_table() {
    let campaign = fixture::campaign(40);
    let rows = fixture::rows(&campaign);
    let page = std::fs::read_to_string(fixture::report()).expect("the report");
    let violated = rows.iter().filter(|row| row.outcome == RunOutcome::Violated).count();
    assert!(violated > 0 && violated < rows.len(), "{violated} of {} violated", rows.len());
    assert!(page.contains(&format!("{violated} of {} flights violated", rows.len())));
    let worst = campaign.guarantees().iter().position(|it| it.name.starts_with("position error"));
    let margin = |row: &&sil_host::campaign::Row| {
        row.guarantees[worst.expect("a guarantee")].margin.expect("observed")
    };
    let second = rows.iter().filter(|row| row.variant == 1);
    let least = second.min_by(|a, b| margin(a).total_cmp(&margin(b))).expect("rows");
    let command = campaign
        .replay_command(campaign.index(least.seed).expect("a run"), &campaign.variants()[1]);
    assert!(page.contains(&escaped(&command)), "{command}");
    assert!(page.contains("Tilts &amp; rates with &quot;quotes&quot;, &lt;tags&gt;"));
}

#[test]
fn ten_thousand_runs_stay_small() {
    let flown = fixture::rows(&fixture::campaign(40));
    let campaign = fixture::campaign(10_000);
    let rows: Vec<_> = (0..campaign.runs())
        .flat_map(|index| {
            let at = 2 * (index as usize % 40);
            flown[at..at + 2].iter().map(move |row| (index, row.clone()))
        })
        .map(|(index, row)| sil_host::campaign::Row {
            seed: campaign.seed(index),
            parameters: campaign.values(index),
            ..row
        })
        .collect();
    let report = fixture::reported("large", &campaign, &rows);
    let size = std::fs::metadata(report).expect("a report").len();
    assert!(size < 1_500_000, "{size} bytes");
}
