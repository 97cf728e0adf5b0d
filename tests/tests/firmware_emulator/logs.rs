//! A flight with the image in the loop leaves the files of the same flight in SIL, byte for byte.

use std::fs;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

use sil_host::log::LogOptions;
use sil_host::log::format::Format;
use sil_host::pil::flight::{FaultOptions, PilOptions, fly_recorded};
use sil_host::run::{FlightOptions, fly};
use sim::scenario::LoadedScenario;

use crate::PAPER;
use crate::emulator::emulator;

/// Every format that `sil-host` was built with.
fn formats() -> Vec<Format> {
    ["ulog", "mcap"].iter().filter_map(|name| name.parse().ok()).collect()
}

/// Every tick and every format into a directory of this name.
fn options(name: &str) -> FlightOptions {
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("logs").join(name);
    let _ = fs::remove_dir_all(&out);
    let log = LogOptions { formats: formats(), rate: 200.0 };
    FlightOptions { out, trace_every: NonZeroU32::MIN, log }
}

#[test]
fn logs_are_those_of_sil_to_the_byte() {
    let (sil, vehicle) = (options("sil"), options("vehicle"));
    let outs: [PathBuf; 2] = [sil.out.clone(), vehicle.out.clone()];
    let pil = PilOptions {
        flight: vehicle,
        emulator: emulator("firmware"),
        port: None,
        lock_step: false,
        ahead: 32,
        record: None,
        faults: FaultOptions::default(),
    };
    for scenario in PAPER {
        let changes = ["duration=1", "guarantees.settle_time=0", "seed=5"].map(str::to_owned);
        let loaded = LoadedScenario::open(scenario, &changes).unwrap();
        let report = fly(&loaded, &sil, &|_| ()).unwrap();
        let (on_board, comparison) = fly_recorded(&loaded, &pil, &|_| ()).unwrap();
        assert_eq!((on_board.passed(), comparison.difference), (report.passed(), None));
        for file in formats().into_iter().map(Format::file_name).chain(["trace.csv"]) {
            let [sil, vehicle] =
                outs.each_ref().map(|out| fs::read(out.join(scenario).join(file)).unwrap());
            assert!(sil.len() > 50_000, "{scenario}/{file}: {}", sil.len());
            assert!(sil == vehicle, "{scenario}/{file}");
        }
    }
}
