//! Consistency of the estimator by campaign: NEES and NIS over many flights with each set of sensors.

use std::fmt::Write;

use ctrl_core::estimator::SOURCES;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde_json::{Value, json};
use sim::scenario::LoadedScenario;
use sim::sensor::consistency::{Consistency, ConsistencyError, Mean};
use sim::sensor::{PRESETS, SensorPreset};
use statrs::distribution::{ContinuousCDF, Normal};

/// Number, seeds and length of the flights of each set.
#[derive(Clone, Copy, Debug)]
pub struct ConsistencyOptions {
    /// Flights of each set.
    pub flights: u32,
    /// Seed of the first flight; sets follow each other, so that no two flights have the same.
    pub first_seed: u32,
    /// Length of a flight (s).
    pub seconds: f64,
}

/// Result of one set.
#[derive(Clone, Debug)]
pub struct ConsistencyResult {
    /// Name of the set or scenario.
    pub name: String,
    /// Sums over its flights.
    pub sums: Consistency,
}

/// Sets by name, or scenarios by name or file; every set if none is named.
///
/// # Errors
/// The first that cannot be read.
pub fn open(names: &[String], changes: &[String]) -> Result<Vec<LoadedScenario>, ConsistencyError> {
    let all: Vec<_> = PRESETS.iter().map(|preset| preset.name.to_owned()).collect();
    let names = if names.is_empty() { &all } else { names };
    let open = |name: &String| match SensorPreset::named(name) {
        Some(preset) => preset.open_with(changes),
        None => LoadedScenario::open(name, changes),
    };
    names.iter().map(|name| open(name).map_err(ConsistencyError::from)).collect()
}

/// Flies each of `scenarios` on all cores; `flown` is told of every flight.
///
/// # Errors
/// The first flight that gives no result.
pub fn fly(
    scenarios: &[LoadedScenario],
    options: &ConsistencyOptions,
    flown: &(dyn Fn() + Sync),
) -> Result<Vec<ConsistencyResult>, ConsistencyError> {
    let of_scenario = |(index, scenario): (usize, &LoadedScenario)| {
        let first = u64::from(options.first_seed) + index as u64 * u64::from(options.flights);
        let one = |flight: u32| {
            let seed = first + u64::from(flight);
            let sums = Consistency::of_flight(scenario, seed, options.seconds);
            flown();
            sums
        };
        // Collected first: sums in the order of the seeds have the same bits on any number of cores.
        let flights: Vec<_> =
            (0..options.flights).into_par_iter().map(one).collect::<Result<_, _>>()?;
        let sums = flights.iter().fold(Consistency::default(), |sum, it| sum.plus(it));
        Ok(ConsistencyResult { name: scenario.scenario().name.clone(), sums })
    };
    scenarios.iter().enumerate().map(of_scenario).collect()
}

/// NEES and NIS of every set.
fn means(results: &[ConsistencyResult]) -> impl Iterator<Item = Mean> {
    results.iter().flat_map(|result| [result.sums.nees(), result.sums.nis()])
}

/// Standard deviations within which all of `count` independent means lie with a probability of 95 % (Šidák).
#[must_use]
pub fn joint_deviations(count: usize) -> f64 {
    let each = 0.95f64.powf(1.0 / count.max(1) as f64);
    Normal::standard().inverse_cdf(0.5 + 0.5 * each)
}

/// `true` if NEES and NIS of all sets together are those of a consistent filter, at 95 %: of 12 means with intervals
/// of 95 % each, one or more of a perfect filter lie outside every second time.
#[must_use]
pub fn passed(results: &[ConsistencyResult]) -> bool {
    let limit = joint_deviations(2 * results.len());
    means(results).all(|mean| mean.deviations().abs() <= limit)
}

fn shown(mean: &Mean) -> String {
    let (lower, upper) = mean.bounds;
    let verdict = if mean.holds() { "inside" } else { "OUTSIDE" };
    let deviations = mean.deviations();
    format!(
        "{:.4}, 95 % in [{lower:.4}, {upper:.4}]: {verdict}, {deviations:+.1} deviations",
        mean.value
    )
}

fn verdict(results: &[ConsistencyResult]) -> String {
    let (all, limit) = (2 * results.len(), joint_deviations(2 * results.len()));
    let inside = means(results).filter(Mean::holds).count();
    let largest = means(results).map(|mean| mean.deviations().abs()).fold(0.0, f64::max);
    let verdict = if passed(results) { "pass" } else { "FAIL" };
    format!(
        "\n{inside} of {all} means inside their own 95 % intervals; all of them together at 95 %: \
         {largest:.2} of {limit:.2} deviations, {verdict}\n"
    )
}

/// Table of the results.
#[must_use]
pub fn table(results: &[ConsistencyResult]) -> String {
    let mut text = String::new();
    for ConsistencyResult { name, sums } in results {
        let refused = sums.innovations().refused;
        let _ =
            writeln!(text, "\n{name}: {} flights, {refused} measurements refused", sums.flights);
        let _ = writeln!(text, "  NEES per state   {}", shown(&sums.nees()));
        let _ = writeln!(text, "  NIS per number   {}", shown(&sums.nis()));
        for (source, mean) in SOURCES.iter().filter_map(|it| Some((it, sums.nis_of(*it)?))) {
            let (lower, upper) = mean.bounds;
            let name = source.name();
            let _ = writeln!(text, "    {name:<18} {:.4} in [{lower:.4}, {upper:.4}]", mean.value);
        }
        let names = ["position", "velocity", "attitude", "gyro bias", "accelerometer bias"];
        let each = sums.each_state();
        let _ = writeln!(text, "  squared errors in units of their variances");
        let (barometer, rest) = each.split_first().unwrap_or((&0.0, &[]));
        if *barometer > 0.0 {
            let _ = writeln!(text, "    {:<18} {barometer:.3}", "barometer bias");
        }
        for (name, [x, y, z]) in names.iter().zip(rest.as_chunks().0) {
            let _ = writeln!(text, "    {name:<18} {x:.3} {y:.3} {z:.3}");
        }
    }
    text += &verdict(results);
    text
}

/// The same as JSON.
#[must_use]
pub fn json(results: &[ConsistencyResult]) -> String {
    let mean = |mean: &Mean| {
        let (lower, upper) = mean.bounds;
        json!({ "mean": mean.value, "lower": lower, "upper": upper, "inside": mean.holds(), "deviations": mean.deviations() })
    };
    let one = |ConsistencyResult { name, sums }: &ConsistencyResult| {
        let by_source = |it| sums.nis_of(it).map(|seen| (it.name().to_owned(), mean(&seen)));
        json!({
            "name": name,
            "flights": sums.flights,
            "refused": sums.innovations().refused,
            "nees": mean(&sums.nees()),
            "nis": mean(&sums.nis()),
            "nis_by_source": SOURCES.into_iter().filter_map(by_source).collect::<serde_json::Map<_, _>>(),
            "squared_errors_per_variance": sums.each_state(),
        })
    };
    let sets: Vec<Value> = results.iter().map(one).collect();
    serde_json::to_string_pretty(&json!({
        "passed": passed(results),
        "joint_deviations": joint_deviations(2 * results.len()),
        "sets": sets,
    }))
    .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_joint_interval_of_one_mean_is_its_own_and_that_of_many_is_wider() {
        assert!((joint_deviations(1) - 1.959_964).abs() < 1e-5);
        // Sidak: quantile of (1 + 0.95^(1/12))/2.
        assert!((joint_deviations(12) - 2.857).abs() < 1e-3);
    }

    #[test]
    fn a_table_and_json_hold_what_was_flown() {
        let scenarios = open(&["bmi088-capture".to_owned()], &[]).expect("built in");
        let options = ConsistencyOptions { flights: 2, first_seed: 7, seconds: 1.0 };
        let results = fly(&scenarios, &options, &|| ()).expect("flown");
        let again = fly(&scenarios, &options, &|| ()).expect("flown");
        assert_eq!(table(&results), table(&again));
        assert!(table(&results).contains("bmi088-capture: 2 flights"));
        let json: Value = serde_json::from_str(&json(&results)).expect("JSON");
        assert_eq!(json["sets"][0]["flights"], 2);
        let seen = json["sets"][0]["nees"]["mean"].as_f64().expect("a number");
        assert!(seen > 0.1 && seen < 10.0, "{seen}");
    }

    #[test]
    fn an_overconfident_filter_fails() {
        // Poses that step aside by three deviations, inside the gate, of which the filter is not told.
        let jumping = "sensors.capture={ custom = { rate = 100.0, delay = 0.01, position_deviation = 1.0, \
                       attitude_deviation = 0.3, dropout = 0.0, jump_interval = 0.5, jump_size = 0.003, \
                       jump_duration = 0.3 } }";
        let scenarios = open(&["bmi088-capture".to_owned()], &[jumping.to_owned()]).expect("valid");
        let options = ConsistencyOptions { flights: 4, first_seed: 1, seconds: 5.0 };
        let results = fly(&scenarios, &options, &|| ()).expect("flown");
        assert!(!passed(&results) && table(&results).contains("FAIL"), "{}", table(&results));
    }

    #[test]
    fn a_scenario_without_sensors_is_refused() {
        let exact = open(&["hover-gusts".to_owned()], &[]).expect("built in");
        let options = ConsistencyOptions { flights: 1, first_seed: 1, seconds: 0.5 };
        assert!(matches!(fly(&exact, &options, &|| ()), Err(ConsistencyError::NoSensors)));
    }
}
