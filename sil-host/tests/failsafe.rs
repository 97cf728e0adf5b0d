//! Every fault at random times of a flight: each ends on the ground with stopped rotors, by the truth.

use rayon::prelude::*;
use sil_host::fly::failsafe::{FlightFault, fly_with_fault};
use sim::scenario::LoadedScenario;

/// Flights of each fault.
const FLIGHTS: u64 = 5;

#[test]
fn every_fault_ends_on_the_ground_with_stopped_rotors() {
    let loaded = LoadedScenario::open("paper-saturated", &[]).expect("a scenario");
    let flights: Vec<_> = FlightFault::ALL
        .iter()
        .flat_map(|fault| (0..FLIGHTS).map(move |seed| (*fault, seed)))
        .collect();
    let violations: Vec<_> = flights
        .into_par_iter()
        .filter_map(|(fault, seed)| {
            let outcome = fly_with_fault(loaded.scenario(), fault, seed).expect("it flies");
            let violation = outcome.violation(fault)?;
            Some(format!("{}, seed {seed}: {violation}: {outcome:?}", fault.name()))
        })
        .collect();
    assert!(violations.is_empty(), "{violations:#?}");
}
