//! A flight with the image in the loop leaves the files of the same flight in SIL, byte for byte.

use std::fs;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

use sil_host::cli::{LogArguments, PilArguments, RunArguments};
use sil_host::log::format::Format;
use sil_host::pil::emulator::Emulator;
use sil_host::pil::fault::FaultDirection;
use sil_host::pil::pil;
use sil_host::run::run;

use crate::PAPER;
use crate::emulator::emulator;

/// Every format that `sil-host` was built with.
fn formats() -> Vec<Format> {
    ["ulog", "mcap"].iter().filter_map(|name| name.parse().ok()).collect()
}

/// How to fly both of the paper's scenarios for a second into a directory of this name.
fn arguments(name: &str) -> RunArguments {
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("logs").join(name);
    let _ = fs::remove_dir_all(&out);
    RunArguments {
        scenarios: PAPER.map(str::to_owned).to_vec(),
        changes: vec!["duration=1".to_owned(), "guarantees.settle_time=0".to_owned()],
        out,
        trace_every: NonZeroU32::MIN,
        log: LogArguments { formats: formats(), rate: 200.0 },
        seed: Some(5),
        quiet: true,
        json: false,
    }
}

fn on_the_image(run: RunArguments) -> PilArguments {
    let Emulator { program: qemu, image, shift } = emulator("firmware");
    PilArguments {
        run,
        qemu,
        image,
        shift,
        port: None,
        baud: 0, // of a port, which there is none
        lock_step: false,
        compare: true,
        record: None,
        replay: None,
        fault: Vec::new(),
        fault_direction: FaultDirection::default(),
        fault_rate: 0.0,
    }
}

#[test]
fn logs_are_those_of_sil_to_the_byte() {
    let (sil, vehicle) = (arguments("sil"), arguments("vehicle"));
    let outs: [PathBuf; 2] = [sil.out.clone(), vehicle.out.clone()];
    let passed = run(&sil).unwrap();
    assert_eq!(pil(&on_the_image(vehicle)).unwrap(), passed);
    let files = formats().into_iter().map(Format::file_name).chain(["trace.csv"]);
    for file in files {
        for scenario in PAPER {
            let [sil, vehicle] =
                outs.each_ref().map(|out| fs::read(out.join(scenario).join(file)).unwrap());
            assert!(sil.len() > 50_000, "{scenario}/{file}: {}", sil.len());
            assert!(sil == vehicle, "{scenario}/{file}");
        }
    }
}
