//! A campaign that has been read and checked: its runs, their values, and the columns of its results.

use std::collections::BTreeMap;
use std::path::Path;

use super::built_in::BuiltInCampaign;
use super::definition::{Definition, Sampling, VariantDefinition};
use super::distribution::Distribution;
use super::error::CampaignError;
use super::sampling::{Point, SOBOL_DIMENSIONS_MAX, SOBOL_RUNS_MAX};
use crate::guarantee::Guarantees;
use crate::scenario::document::TomlText;
use crate::scenario::{BuiltIn, LoadedScenario, Origin, ScenarioError};

/// A campaign that has been read and checked.
#[derive(Clone, Debug)]
pub struct Campaign {
    definition: Definition,
    runs: u32,
    axes: Vec<Axis>,
    parameters: Vec<Parameter>,
    variants: Vec<Variant>,
    guarantees: Vec<Guarantee>,
}

/// A varied value: a column of the results.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// The field of the scenario that it goes to; the column's name.
    pub path: String,
    /// Its unit, where the definition tells.
    pub unit: String,
    /// More fields that get the value where a variant's scenario has them.
    also: Vec<String>,
}

/// A distribution, which takes some dimensions of the sampling.
#[derive(Clone, Debug)]
struct Axis {
    distribution: Distribution,
}

/// A variant of every run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variant {
    /// Its name; the scenario's if the campaign defines no variants.
    pub name: String,
    /// Name of its scenario.
    pub scenario: String,
    /// The scenario's text.
    text: String,
    /// What it changes in the scenario, before the varied values.
    changes: Vec<String>,
    /// Which fields of the scenario get which parameter, by number.
    targets: Vec<(String, usize)>,
}

/// A guarantee that some variant is held to: two columns of the results.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Guarantee {
    /// Stem of its columns' names.
    pub key: String,
    /// Its name in the table of a run.
    pub name: &'static str,
    /// Its equation.
    pub equation: &'static str,
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
    /// Reads the built-in campaign or the file `name`, after the changes `path=value` to the
    /// definition itself and with `changes` to every scenario.
    ///
    /// # Errors
    /// Names file, line and key of what cannot be read, is unknown or is out of its range.
    pub fn open(
        name: &str,
        own_changes: &[String],
        changes: &[String],
    ) -> Result<Self, CampaignError> {
        if let Some(built_in) = BuiltInCampaign::named(name) {
            return Self::parse(name, built_in.text, Path::new(""), own_changes, changes);
        }
        let path = Path::new(name);
        let text = std::fs::read_to_string(path).map_err(|error| {
            let known: Vec<_> = BuiltInCampaign::ALL.iter().map(|it| it.name).collect();
            let message = format!("{error}; built-in campaigns: {}", known.join(", "));
            fault_in(name, message)
        })?;
        let directory = path.parent().unwrap_or(Path::new(""));
        Self::parse(name, &text, directory, own_changes, changes)
    }

    /// Reads a campaign from TOML; `name` is what errors call it, and scenarios that are files are
    /// looked for in `directory`.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn parse(
        name: &str,
        text: &str,
        directory: &Path,
        own_changes: &[String],
        changes: &[String],
    ) -> Result<Self, CampaignError> {
        let mut text = TomlText::parse(name, text)?;
        text.set(own_changes)?;
        let mut definition: Definition = text.deserialize()?;
        definition.set.extend(changes.iter().cloned());
        let campaign = Reader { text: &text, directory }.campaign(definition)?;
        Ok(campaign)
    }

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
        for Axis { distribution } in &self.axes {
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
}

impl Variant {
    /// The text of its scenario.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    fn changes(&self, values: &[f64], seed: u32) -> Vec<String> {
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

/// An error of the file `name` that belongs to no key.
fn fault_in(name: &str, message: String) -> CampaignError {
    let origin = Origin::File { name: name.to_owned(), line: None };
    ScenarioError { origin, key: String::new(), message }.into()
}

/// Turns a definition into a campaign.
struct Reader<'a> {
    text: &'a TomlText,
    directory: &'a Path,
}

impl Reader<'_> {
    fn campaign(&self, definition: Definition) -> Result<Campaign, CampaignError> {
        self.check_name("name", &definition.name)?;
        let (axes, parameters) = self.axes(&definition)?;
        let runs = self.runs(&definition, &axes)?;
        let variants = self.variants(&definition, &parameters)?;
        let guarantees = guarantees(&variants)?;
        let campaign = Campaign { definition, runs, axes, parameters, variants, guarantees };
        self.check_envelope(&campaign)?;
        self.check_fields(&campaign)?;
        Ok(campaign)
    }

    fn fault(&self, path: &str, message: String) -> CampaignError {
        let path: Vec<_> = path.split('.').map(str::to_owned).collect();
        self.text.error(&path, message).into()
    }

    /// Names become parts of file names and cells of tables.
    fn check_name(&self, path: &str, name: &str) -> Result<(), CampaignError> {
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.is_empty() || !name.chars().all(plain) {
            let message = format!("`{name}` must be made of letters, digits, `-` and `_`");
            return Err(self.fault(path, message));
        }
        Ok(())
    }

    fn axes(&self, definition: &Definition) -> Result<(Vec<Axis>, Vec<Parameter>), CampaignError> {
        let (mut axes, mut parameters) = (Vec::new(), Vec::<Parameter>::new());
        for (number, vary) in definition.vary.iter().enumerate() {
            let here = format!("vary[{number}]");
            let distribution = vary.distribution().map_err(|(key, message)| {
                let path = if key.is_empty() { here.clone() } else { format!("{here}.{key}") };
                self.fault(&path, message)
            })?;
            for path in columns(&vary.path, &distribution) {
                let all: Vec<_> = vary.also.iter().cloned().chain([path.clone()]).collect();
                let taken = |it: &Parameter| all.contains(&it.path) || it.path.starts_with("seed");
                if parameters.iter().any(taken) || path == "seed" {
                    let message = format!("`{path}` is varied already; `seed` always is");
                    return Err(self.fault(&format!("{here}.path"), message));
                }
                let also = vary.also.clone();
                parameters.push(Parameter { path, unit: vary.unit.clone(), also });
            }
            axes.push(Axis { distribution });
        }
        Ok((axes, parameters))
    }

    /// The number of runs, which must suit the sampling and leave room for the seeds.
    fn runs(&self, definition: &Definition, axes: &[Axis]) -> Result<u32, CampaignError> {
        let dimensions: usize = axes.iter().map(|axis| axis.distribution.dimensions()).sum();
        let cells = cells(definition.sampling, axes)
            .ok_or_else(|| self.fault("vary", "a grid with more than 4294967295 cells".into()))?;
        let runs = match (definition.runs, definition.sampling) {
            (Some(runs), _) => runs,
            (None, Sampling::Grid) => cells,
            (None, _) => return Err(self.fault("runs", "missing: only a grid may omit it".into())),
        };
        if runs == 0 || !runs.is_multiple_of(cells) {
            let message = format!("{runs} must be positive and a multiple of the {cells} cells");
            return Err(self.fault("runs", message));
        }
        if definition.first_seed.checked_add(runs - 1).is_none() {
            return Err(self.fault("first_seed", format!("seeds of {runs} runs exceed 4294967295")));
        }
        let too_many = runs > SOBOL_RUNS_MAX || dimensions as u32 > SOBOL_DIMENSIONS_MAX;
        if definition.sampling == Sampling::Sobol && too_many {
            let message = format!(
                "sobol has at most {SOBOL_RUNS_MAX} runs of {SOBOL_DIMENSIONS_MAX} dimensions, \
                 not {runs} of {dimensions}"
            );
            return Err(self.fault("sampling", message));
        }
        Ok(runs)
    }

    fn variants(
        &self,
        definition: &Definition,
        parameters: &[Parameter],
    ) -> Result<Vec<Variant>, CampaignError> {
        let mut variants = Vec::<Variant>::new();
        if definition.variant.is_empty() {
            let (scenario, text) = self.scenario(definition.scenario.as_ref(), definition)?;
            let changes = definition.set.clone();
            variants.push(Variant::new(scenario.clone(), scenario, text, changes, parameters)?);
        }
        for (number, variant) in definition.variant.iter().enumerate() {
            let path = format!("variant[{number}].name");
            self.check_name(&path, &variant.name)?;
            if variants.iter().any(|other| other.name == variant.name) {
                return Err(self.fault(&path, format!("`{}` is taken already", variant.name)));
            }
            variants.push(self.variant(variant, definition, parameters)?);
        }
        for path in parameters.iter().flat_map(|parameter| &parameter.also) {
            if !variants.iter().any(|it| it.targets.iter().any(|(target, _)| target == path)) {
                return Err(self.fault("vary", format!("no variant's scenario has `{path}`")));
            }
        }
        Ok(variants)
    }

    fn variant(
        &self,
        variant: &VariantDefinition,
        definition: &Definition,
        parameters: &[Parameter],
    ) -> Result<Variant, CampaignError> {
        let scenario = variant.scenario.as_ref().or(definition.scenario.as_ref());
        let (scenario, text) = self.scenario(scenario, definition)?;
        let changes = definition.set.iter().chain(&variant.set).cloned().collect();
        Ok(Variant::new(variant.name.clone(), scenario, text, changes, parameters)?)
    }

    /// Name and text of a scenario.
    fn scenario(
        &self,
        name: Option<&String>,
        definition: &Definition,
    ) -> Result<(String, String), CampaignError> {
        let Some(name) = name else {
            return Err(self.fault("scenario", "missing: no scenario is named".to_owned()));
        };
        let text = match (definition.scenarios.get(name), BuiltIn::named(name)) {
            (Some(text), _) => text.clone(),
            (None, Some(built_in)) => built_in.text.to_owned(),
            (None, None) => {
                let path = self.directory.join(name);
                std::fs::read_to_string(&path).map_err(|error| {
                    self.fault("scenario", format!("{}: {error}", path.display()))
                })?
            }
        };
        Ok((name.clone(), text))
    }

    fn check_envelope(&self, campaign: &Campaign) -> Result<(), CampaignError> {
        if campaign.definition.envelope.is_some() && campaign.envelope().is_none() {
            return Err(self.fault("envelope", "names a path that is not varied".to_owned()));
        }
        Ok(())
    }

    /// Every varied field exists and takes a number; whether it takes each value, the runs show.
    fn check_fields(&self, campaign: &Campaign) -> Result<(), CampaignError> {
        for variant in &campaign.variants {
            let changes = campaign.changes(0, variant);
            LoadedScenario::check_fields(&variant.scenario, &variant.text, &changes)?;
        }
        Ok(())
    }
}

impl Variant {
    fn new(
        name: String,
        scenario: String,
        text: String,
        changes: Vec<String>,
        parameters: &[Parameter],
    ) -> Result<Self, ScenarioError> {
        let mut document = TomlText::parse(&scenario, &text)?;
        document.set(&changes)?;
        let mut targets = Vec::new();
        for (number, parameter) in parameters.iter().enumerate() {
            targets.push((parameter.path.clone(), number));
            let present = parameter.also.iter().filter(|path| document.has(path));
            targets.extend(present.map(|path| (path.clone(), number)));
        }
        Ok(Self { name, scenario, text, changes, targets })
    }
}

/// The columns of a varied path: one, or one an element.
fn columns(path: &str, distribution: &Distribution) -> Vec<String> {
    match distribution.dimensions() {
        1 => vec![path.to_owned()],
        elements => (0..elements).map(|i| format!("{path}[{i}]")).collect(),
    }
}

/// Cells of a grid, one in any other sampling; none if they are too many.
fn cells(sampling: Sampling, axes: &[Axis]) -> Option<u32> {
    let mut cells: u32 = 1;
    for levels in axes.iter().filter_map(|axis| axis.distribution.levels()) {
        if sampling == Sampling::Grid {
            cells = cells.checked_mul(u32::try_from(levels.len()).ok()?)?;
        }
    }
    Some(cells)
}

/// The guarantees of all variants, each once, in the order of the first that has it.
fn guarantees(variants: &[Variant]) -> Result<Vec<Guarantee>, ScenarioError> {
    let mut all = Vec::<Guarantee>::new();
    for variant in variants {
        let loaded = LoadedScenario::parse(&variant.scenario, &variant.text, &variant.changes)?;
        let scenario = loaded.scenario();
        let parameters = scenario.vehicle.into();
        let monitors = Guarantees::new(&scenario.guarantees, &scenario.controller, &parameters);
        for verdict in monitors.verdicts() {
            let key = Guarantee::key(verdict.name);
            if all.iter().all(|known| known.key != key) {
                let (name, equation, unit) = (verdict.name, verdict.equation, verdict.unit);
                all.push(Guarantee { key, name, equation, unit });
            }
        }
    }
    Ok(all)
}
