//! A campaign that has been read and checked: its runs, their values, and the columns of its results.

use std::collections::BTreeMap;

use super::definition::{Definition, Sampling};
use super::distribution::Distribution;
use super::sampling::Point;
use sim::scenario::{LoadedScenario, ScenarioError};

/// A campaign that has been read and checked.
#[derive(Clone, Debug)]
pub struct Campaign {
    pub(super) definition: Definition,
    pub(super) runs: u32,
    pub(super) axes: Vec<Distribution>,
    pub(super) parameters: Vec<Parameter>,
    pub(super) variants: Vec<Variant>,
    pub(super) guarantees: Vec<Guarantee>,
}

/// A varied value: a column of the results.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// The field of the scenario that it goes to, as in `vehicle.inertia[0]`.
    pub path: String,
    /// Its unit, where the definition tells.
    pub unit: String,
    /// More fields that get the value where a variant's scenario has them.
    pub(super) also: Vec<String>,
}

impl Parameter {
    /// Name of its column: the path with the elements of arrays as parts of their own, `vehicle.inertia.0`.
    #[must_use]
    pub fn column(&self) -> String {
        self.path.replace('[', ".").replace(']', "")
    }
}

/// A variant of every run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variant {
    /// Its name; the scenario's if the campaign defines no variants.
    pub name: String,
    /// Name of its scenario.
    pub scenario: String,
    /// The scenario's text.
    pub(super) text: String,
    /// Changes to the scenario, before the varied values.
    pub(super) changes: Vec<String>,
    /// Fields of the scenario, each with the number of the parameter that it gets.
    pub(super) targets: Vec<(String, usize)>,
}

/// A guarantee that some variant is held to: two columns of the results.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Guarantee {
    /// Stem of its columns' names.
    pub key: String,
    /// Its name in the table of a run.
    pub name: &'static str,
    /// Its equation; where variants differ, all of them.
    pub equation: String,
    /// Its unit.
    pub unit: &'static str,
}

impl Guarantee {
    /// The stem of the columns of the guarantee called `name`: words in lower case.
    pub(super) fn key(name: &str) -> String {
        let words =
            name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
        words.map(str::to_ascii_lowercase).collect::<Vec<_>>().join("_")
    }
}

impl Campaign {
    /// Everything that it depends on, as TOML that is complete in itself: what its results keep.
    ///
    /// # Panics
    /// Never: every definition can be written as TOML.
    #[must_use]
    pub fn text(&self) -> String {
        let scenario = |variant: &Variant| (variant.scenario.clone(), variant.text.clone());
        let scenarios: BTreeMap<_, _> = self.variants.iter().map(scenario).collect();
        let definition = Definition { runs: Some(self.runs), scenarios, ..self.definition.clone() };
        toml_edit::ser::to_string_pretty(&definition).expect("a definition is plain TOML")
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.definition.name
    }

    /// The definition, as it was written and then changed on the command line.
    #[must_use]
    pub fn definition(&self) -> &Definition {
        &self.definition
    }

    /// Number of runs; each is flown in every variant.
    #[must_use]
    pub fn runs(&self) -> u32 {
        self.runs
    }

    /// Seed of the run with that number.
    #[must_use]
    pub fn seed(&self, index: u32) -> u32 {
        self.definition.first_seed + index
    }

    /// Number of the run with that seed.
    #[must_use]
    pub fn index(&self, seed: u32) -> Option<u32> {
        seed.checked_sub(self.definition.first_seed).filter(|&index| index < self.runs)
    }

    /// The varied values, in the order of their columns.
    #[must_use]
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// The variants, in the order of their rows.
    #[must_use]
    pub fn variants(&self) -> &[Variant] {
        &self.variants
    }

    /// The guarantees of all variants, in the order of their columns.
    #[must_use]
    pub fn guarantees(&self) -> &[Guarantee] {
        &self.guarantees
    }

    /// Numbers of the two parameters that the envelope is drawn over.
    #[must_use]
    pub fn envelope(&self) -> Option<[usize; 2]> {
        let number = |path: &String| self.parameters.iter().position(|it| it.path == *path);
        let [across, up] = self.definition.envelope.as_ref()?;
        Some([number(across)?, number(up)?])
    }

    /// The varied values of a run.
    #[must_use]
    pub fn values(&self, index: u32) -> Vec<f64> {
        let Definition { sampling, first_seed, .. } = self.definition;
        let mut point = Point::new(sampling, index, self.runs, first_seed);
        let mut values = Vec::with_capacity(self.parameters.len());
        let mut cell = index;
        for distribution in &self.axes {
            match distribution.levels().filter(|_| sampling == Sampling::Grid) {
                Some(levels) => {
                    values.push(levels[cell as usize % levels.len()]);
                    cell /= levels.len() as u32;
                }
                None => {
                    let unit = (0..distribution.dimensions()).map(|_| point.coordinate());
                    distribution.sample(&unit.collect::<Vec<_>>(), &mut values);
                }
            }
        }
        values
    }

    /// Number of coordinates of a run.
    #[must_use]
    pub(super) fn dimensions(&self) -> usize {
        self.axes.iter().map(Distribution::dimensions).sum()
    }

    /// The varied values at a point of the unit cube, which has as many coordinates as there are
    /// [`dimensions`](Self::dimensions).
    #[must_use]
    pub(super) fn values_at(&self, mut unit: &[f64]) -> Vec<f64> {
        let mut values = Vec::with_capacity(self.parameters.len());
        for distribution in &self.axes {
            let (here, rest) = unit.split_at(distribution.dimensions());
            distribution.sample(here, &mut values);
            unit = rest;
        }
        values
    }

    /// Everything that turns a variant's scenario into the run's: `path=value` each.
    #[must_use]
    pub fn changes(&self, index: u32, variant: &Variant) -> Vec<String> {
        variant.changes(&self.values(index), self.seed(index))
    }

    /// The scenario of a run in a variant.
    ///
    /// # Errors
    /// When scenario or controller refuse its values.
    pub fn scenario(&self, index: u32, variant: &Variant) -> Result<LoadedScenario, ScenarioError> {
        LoadedScenario::parse(&variant.scenario, &variant.text, &self.changes(index, variant))
    }

    /// The scenario of a run with these values in a variant.
    pub(super) fn scenario_with(
        variant: &Variant,
        values: &[f64],
        seed: u32,
    ) -> Result<LoadedScenario, ScenarioError> {
        LoadedScenario::parse(&variant.scenario, &variant.text, &variant.changes(values, seed))
    }
}

impl Variant {
    /// The text of its scenario.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    pub(super) fn changes(&self, values: &[f64], seed: u32) -> Vec<String> {
        let mut changes = self.changes.clone();
        let varied = self.targets.iter();
        changes.extend(varied.map(|(path, number)| format!("{path}={}", literal(values[*number]))));
        changes.push(format!("seed={seed}"));
        changes
    }
}

/// A number as TOML, exactly: whole numbers without a point, for fields that count.
fn literal(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 1e15 {
        format!("{value:.0}")
    } else {
        zmij::Buffer::new().format(value).to_owned()
    }
}
