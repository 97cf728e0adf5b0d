//! From a definition to a campaign: every check that can be made before the first flight.

use std::path::Path;

use super::built_in::BuiltInCampaign;
use super::definition::{Definition, Sampling, VariantDefinition};
use super::distribution::Distribution;
use super::error::CampaignError;
use super::plan::{Campaign, Guarantee, Parameter, Variant};
use super::sampling::{SOBOL_DIMENSIONS_MAX, SOBOL_RUNS_MAX};
use sim::scenario::document::TomlText;
use sim::scenario::{BuiltIn, LoadedScenario, Origin, ScenarioError, check_name, not_found};

/// Values of a definition to be replaced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CampaignOverrides {
    /// Number of runs.
    pub runs: Option<u32>,
    /// Seed of the first run.
    pub first_seed: Option<u32>,
}

impl CampaignOverrides {
    /// Applies them to a definition's text, under the names of the program's options.
    fn apply(&self, text: &mut TomlText) -> Result<(), ScenarioError> {
        let options =
            [("runs", "--runs", self.runs), ("first_seed", "--first-seed", self.first_seed)];
        for (key, option, value) in options {
            if let Some(value) = value {
                text.set_option(&format!("{key}={value}"), &format!("{option} {value}"))?;
            }
        }
        Ok(())
    }
}

impl Campaign {
    /// Reads the built-in campaign or the file `name`, with `overrides` in its definition and
    /// `changes`, each `path=value`, in every scenario.
    ///
    /// # Errors
    /// Names file, line and key of a value that cannot be read, is unknown or is out of its range.
    pub fn open(
        name: &str,
        overrides: &CampaignOverrides,
        changes: &[String],
    ) -> Result<Self, CampaignError> {
        if let Some(built_in) = BuiltInCampaign::named(name) {
            return Self::parse(name, built_in.text, Path::new(""), overrides, changes);
        }
        let path = Path::new(name);
        let text = std::fs::read_to_string(path).map_err(|error| {
            let known = BuiltInCampaign::ALL.iter().map(|it| it.name);
            let message = not_found(name, &error, "campaigns", known);
            let origin = Origin::File { name: name.to_owned(), line: None };
            ScenarioError { origin, key: String::new(), message }
        })?;
        let directory = path.parent().unwrap_or(Path::new(""));
        Self::parse(name, &text, directory, overrides, changes)
    }

    /// Reads a campaign from TOML. Errors call it `name`; scenarios that are files are looked for in
    /// `directory`.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn parse(
        name: &str,
        text: &str,
        directory: &Path,
        overrides: &CampaignOverrides,
        changes: &[String],
    ) -> Result<Self, CampaignError> {
        let mut text = TomlText::parse(name, text)?;
        overrides.apply(&mut text)?;
        let mut definition: Definition = text.deserialize()?;
        definition.set.extend(changes.iter().cloned());
        Reader { text: &text, directory }.campaign(definition)
    }
}

/// Turns a definition into a campaign.
struct Reader<'a> {
    /// Text of the definition.
    text: &'a TomlText,
    /// Directory of scenarios that are files.
    directory: &'a Path,
}

impl Reader<'_> {
    /// The campaign that `definition` defines.
    fn campaign(&self, definition: Definition) -> Result<Campaign, CampaignError> {
        self.check_name("name", &definition.name)?;
        let (axes, parameters) = self.axes(&definition)?;
        let runs = self.runs(&definition, &axes)?;
        let variants = self.variants(&definition, &parameters)?;
        let guarantees = guarantees(&variants)?;
        let campaign = Campaign { definition, runs, axes, parameters, variants, guarantees };
        self.check_stop(&campaign)?;
        self.check_splitting(&campaign)?;
        self.check_fields(&campaign)?;
        self.check_envelope(&campaign)?;
        Ok(campaign)
    }

    fn fault(&self, path: &str, message: String) -> CampaignError {
        let path: Vec<_> = path.split('.').map(str::to_owned).collect();
        self.text.error(&path, message).into()
    }

    /// Names become parts of file names and cells of tables.
    fn check_name(&self, path: &str, name: &str) -> Result<(), CampaignError> {
        check_name(name).map_err(|message| self.fault(path, message))
    }

    fn axes(
        &self,
        definition: &Definition,
    ) -> Result<(Vec<Distribution>, Vec<Parameter>), CampaignError> {
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
            axes.push(distribution);
        }
        Ok((axes, parameters))
    }

    /// The number of runs, which must suit the sampling and leave room for the seeds.
    fn runs(&self, definition: &Definition, axes: &[Distribution]) -> Result<u32, CampaignError> {
        let dimensions: usize = axes.iter().map(Distribution::dimensions).sum();
        let cells = cells(definition.sampling, axes)
            .ok_or_else(|| self.fault("vary", "a grid with more than 4294967295 cells".into()))?;
        let runs = match (definition.runs, definition.sampling) {
            (Some(runs), _) => runs,
            (None, Sampling::Grid) => cells,
            (None, _) => return Err(self.fault("runs", "missing: only a grid may omit it".into())),
        };
        if runs == 0 || !runs.is_multiple_of(cells) {
            let multiple = match cells {
                1 => String::new(),
                cells => format!(" and a multiple of the {cells} cells"),
            };
            let message = format!("{runs} must be positive{multiple}");
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
            let (scenario, text) = self.scenario("scenario", None, definition)?;
            let changes = definition.set.clone();
            variants.push(Variant::new(scenario.clone(), scenario, text, changes));
        }
        for (number, variant) in definition.variant.iter().enumerate() {
            let path = format!("variant[{number}]");
            self.check_name(&format!("{path}.name"), &variant.name)?;
            if variants.iter().any(|other| other.name == variant.name) {
                let message = format!("`{}` is taken already", variant.name);
                return Err(self.fault(&format!("{path}.name"), message));
            }
            variants.push(self.variant(&path, variant, definition)?);
        }
        self.aim(&mut variants, parameters)?;
        Ok(variants)
    }

    /// Assigns every parameter to its fields, in those variants whose scenario has them. A varied path
    /// that none has is assigned to all: it adds a field there, or is refused there.
    fn aim(&self, variants: &mut [Variant], parameters: &[Parameter]) -> Result<(), CampaignError> {
        for (number, parameter) in parameters.iter().enumerate() {
            for path in parameter.also.iter().chain([&parameter.path]) {
                let mut nowhere = true;
                for variant in &mut *variants {
                    if variant.document()?.has(path) {
                        variant.targets.push((path.clone(), number));
                        nowhere = false;
                    }
                }
                if nowhere && path != &parameter.path {
                    let message = format!("no variant's scenario has `{path}`");
                    return Err(self.fault("vary", message));
                }
                let missed = variants.iter_mut().filter(|_| nowhere);
                missed.for_each(|variant| variant.targets.push((path.clone(), number)));
            }
        }
        Ok(())
    }

    fn variant(
        &self,
        path: &str,
        variant: &VariantDefinition,
        definition: &Definition,
    ) -> Result<Variant, CampaignError> {
        let path = format!("{path}.scenario");
        let (scenario, text) = self.scenario(&path, variant.scenario.as_ref(), definition)?;
        let changes = definition.set.iter().chain(&variant.set).cloned().collect();
        Ok(Variant::new(variant.name.clone(), scenario, text, changes))
    }

    /// Name and text of the scenario `name`, given at `path`, or else of the campaign's.
    fn scenario(
        &self,
        path: &str,
        name: Option<&String>,
        definition: &Definition,
    ) -> Result<(String, String), CampaignError> {
        let Some(name) = name.or(definition.scenario.as_ref()) else {
            return Err(self.fault(path, "missing, and the campaign names none either".to_owned()));
        };
        let text = match (definition.scenarios.get(name), BuiltIn::named(name)) {
            (Some(text), _) => text.clone(),
            (None, Some(built_in)) => built_in.text.to_owned(),
            (None, None) => {
                let file = self.directory.join(name);
                let text = std::fs::read_to_string(&file);
                text.map_err(|error| self.fault(path, format!("{}: {error}", file.display())))?
            }
        };
        Ok((name.clone(), text))
    }

    /// A rule for stopping is sound, names a guarantee, and has independent runs.
    fn check_stop(&self, campaign: &Campaign) -> Result<(), CampaignError> {
        let Some(stop) = &campaign.definition.stop else { return Ok(()) };
        if let Some((key, message)) = stop.fault() {
            return Err(self.fault(&format!("stop.{key}"), message));
        }
        if campaign.definition.sampling != Sampling::MonteCarlo {
            let message = "must be monte_carlo with `[stop]`: its bounds need independent runs";
            return Err(self.fault("sampling", message.to_owned()));
        }
        stop.guarantee.as_ref().map_or(Ok(()), |key| self.check_guarantee("stop", campaign, key))
    }

    /// Splitting is sound, names a guarantee, and has one variant and continuous draws.
    fn check_splitting(&self, campaign: &Campaign) -> Result<(), CampaignError> {
        let Definition { splitting, stop, sampling, .. } = &campaign.definition;
        let Some(splitting) = splitting else { return Ok(()) };
        if let Some((key, message)) = splitting.fault() {
            return Err(self.fault(&format!("splitting.{key}"), message));
        }
        if *sampling != Sampling::MonteCarlo {
            let message =
                "must be monte_carlo with `[splitting]`: runs are drawn from it".to_owned();
            return Err(self.fault("sampling", message));
        }
        if stop.is_some() || campaign.variants.len() > 1 || campaign.axes.is_empty() {
            let message =
                "needs a campaign that varies something, in one variant, without `[stop]`";
            return Err(self.fault("splitting", message.to_owned()));
        }
        self.check_guarantee("splitting", campaign, &splitting.guarantee)
    }

    /// `key` of `table` names a guarantee of the campaign that has a bound.
    fn check_guarantee(
        &self,
        table: &str,
        campaign: &Campaign,
        key: &str,
    ) -> Result<(), CampaignError> {
        if campaign.guarantees.iter().any(|it| it.key == key) {
            return Ok(());
        }
        let known: Vec<_> = campaign.guarantees.iter().map(|it| it.key.as_str()).collect();
        let message = format!("no guarantee `{key}`: choose from {}", known.join(", "));
        Err(self.fault(&format!("{table}.guarantee"), message))
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
    fn new(name: String, scenario: String, text: String, changes: Vec<String>) -> Self {
        Self { name, scenario, text, changes, targets: Vec::new() }
    }

    /// Its scenario before the varied values.
    fn document(&self) -> Result<TomlText, ScenarioError> {
        let mut document = TomlText::parse(&self.scenario, &self.text)?;
        document.set(&self.changes)?;
        Ok(document)
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
fn cells(sampling: Sampling, axes: &[Distribution]) -> Option<u32> {
    let mut cells: u32 = 1;
    for levels in axes.iter().filter_map(Distribution::levels) {
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
        let monitors = loaded.scenario().monitors();
        for verdict in monitors.verdicts() {
            let key = Guarantee::key(verdict.name);
            let (name, equation, unit) = (verdict.name, verdict.equation, verdict.unit);
            match all.iter_mut().find(|known| known.key == key) {
                None => all.push(Guarantee { key, name, equation: equation.to_owned(), unit }),
                Some(known) if !known.equation.split(", ").any(|one| equation.contains(one)) => {
                    known.equation += &format!(", {equation}");
                }
                Some(_) => {}
            }
        }
    }
    Ok(all)
}
