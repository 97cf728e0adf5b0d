//! The page of one flight, in a browser.

use std::num::NonZeroU32;
use std::path::PathBuf;

use serde_json::json;
use sil_host::log::LogOptions;
use sil_host::run::{FlightOptions, fly};
use sim::scenario::LoadedScenario;

use crate::{BEYOND, DRAWN, browser, fixture};

/// Flies a short flight of controller 2, whose figures are the most; the path of its page.
fn page() -> PathBuf {
    let changes = ["duration=6", "guarantees.settle_time=4"].map(str::to_owned);
    let loaded = LoadedScenario::open("paper-saturated", &changes).expect("a scenario");
    let out = fixture::directory("flight");
    let trace_every = NonZeroU32::new(100).expect("positive");
    let options = FlightOptions { out: out.clone(), trace_every, log: LogOptions::default() };
    fly(&loaded, &options, &|_| ()).expect("a flight");
    out.join("paper-saturated").join("index.html")
}

#[test]
fn every_panel_is_drawn_in_both_themes_alone_and_without_complaint() {
    let page = page();
    let mut browser = browser("flight-browser");
    for (theme, width) in [("light", 1280), ("dark", 390)] {
        browser.open(&page, width, theme);
        let figures = browser.evaluate("document.querySelectorAll('#figures figure').length");
        assert_eq!(figures, json!(9));
        let panels = browser.evaluate("document.querySelectorAll('#figures canvas').length");
        let panels = panels.as_u64().expect("a number");
        assert!(panels > 20, "{panels}");
        for panel in 0..panels {
            let drawn = browser.evaluate(&format!("{DRAWN}('#figures', {panel})"));
            assert!(drawn.as_f64() > Some(0.003), "{theme}, panel {panel}: {drawn}");
        }
        assert_eq!(browser.evaluate(BEYOND), json!(0), "{width} px: wider than the window");
        let complaints = browser.complaints();
        assert!(complaints.is_empty(), "{theme}, {width}: {complaints:#?}");
        assert_eq!(browser.requests(), [format!("file://{}", page.display())]);
    }
}
