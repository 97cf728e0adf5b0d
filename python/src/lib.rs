//! Native part of the Python package `gyrfalcon`: the flight core, simulator and campaigns of this project.
//!
//! `gyrfalcon/_core.pyi` declares every name for type checkers.

mod arrays;
mod batch;
mod callable;
mod campaign;
mod controller;
mod errors;
mod quantities;
mod record;
mod run;
mod scenario;

use pyo3::prelude::*;

/// Flight core, simulator and campaigns; use them by the package `gyrfalcon`.
#[pymodule]
mod _core {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::batch::{BatchController, BatchFlight, BatchVehicle};
    #[pymodule_export]
    use crate::callable::Tick;
    #[pymodule_export]
    use crate::campaign::{
        Campaign, built_in_campaigns, failure_probability, merge_shards, tune_gains,
    };
    #[pymodule_export]
    use crate::controller::{Controller, StepOutput, facing};
    #[pymodule_export]
    use crate::processor_extensions;
    #[pymodule_export]
    use crate::quantities::{quantities, status_bits};
    #[pymodule_export]
    use crate::run::{FlightRecord, run};
    #[pymodule_export]
    use crate::scenario::{Scenario, built_in_scenarios, toml_value};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}

/// Extensions of x86-64 beyond x86-64-v2 that this build uses; a wheel uses none.
#[pyfunction]
fn processor_extensions() -> Vec<&'static str> {
    [
        ("AVX", cfg!(target_feature = "avx")),
        ("AVX2", cfg!(target_feature = "avx2")),
        ("FMA", cfg!(target_feature = "fma")),
        ("BMI2", cfg!(target_feature = "bmi2")),
        ("AVX-512", cfg!(target_feature = "avx512f")),
    ]
    .into_iter()
    .filter_map(|(name, used)| used.then_some(name))
    .collect()
}
