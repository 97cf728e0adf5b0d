//! Names in `cargo` commands: packages, targets, features and commands of xtask.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Commands of cargo whose names are checked instead of running them.
const KNOWN: [&str; 9] =
    ["bench", "build", "check", "clippy", "doc", "fmt", "publish", "run", "test"];

/// A package of the workspace.
#[derive(Default)]
struct Package {
    features: BTreeSet<String>,
    /// Kind (`bin`, `test`, `bench`, `example`) and name of each target.
    targets: BTreeSet<(String, String)>,
}

/// Names that a command may use.
pub struct Names {
    packages: BTreeMap<String, Package>,
    /// Usage text of xtask, a line per command.
    xtask: String,
}

impl Names {
    /// The names of the workspace at `root`, from cargo itself and from the usage text of xtask.
    pub fn of_the_workspace(root: &Path) -> Self {
        let mut metadata = Command::new(env!("CARGO"));
        metadata.args(["metadata", "--no-deps", "--offline", "--format-version", "1"]);
        let output = metadata.current_dir(root).output().expect("cargo");
        let metadata: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let packages = metadata["packages"].as_array().expect("packages");
        let packages =
            packages.iter().map(|package| (text(&package["name"]), Package::read(package)));
        let main = fs::read_to_string(root.join("xtask/src/main.rs")).expect("xtask");
        let usage = main.split_once("usage: cargo xtask").expect("usage").1;
        let xtask = usage.split_once("\";").expect("its end").0.to_owned();
        Self { packages: packages.collect(), xtask }
    }

    /// Checks a command that is not run here.
    pub fn check(&self, words: &[String]) -> Result<(), String> {
        let words: Vec<_> = words.iter().map(String::as_str).collect();
        match words[..] {
            ["cargo", "xtask", command, ..] => self.check_xtask(command),
            ["cargo", command, ref rest @ ..] if KNOWN.contains(&command) => {
                self.check_options(rest)
            }
            ["cargo"] | ["cargo", "install", "--path", "sil-host"] => Ok(()),
            _ => Err("no such check; mark the block `<!-- not run: REASON -->`".into()),
        }
    }

    fn check_xtask(&self, command: &str) -> Result<(), String> {
        let listed =
            self.xtask.lines().filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
        let mut listed = listed.filter(|name| !name.is_empty());
        listed
            .any(|name| name == command)
            .then_some(())
            .ok_or(format!("xtask has no command `{command}`"))
    }

    fn check_options(&self, words: &[&str]) -> Result<(), String> {
        let words = words.split(|word| *word == "--").next().unwrap_or_default();
        let value =
            |option: &str| words.windows(2).find(|pair| pair[0] == option).map(|pair| pair[1]);
        let package = match value("-p") {
            None => None,
            Some(name) => Some(self.packages.get(name).ok_or(format!("no package `{name}`"))?),
        };
        let packages: Vec<_> =
            package.map_or_else(|| self.packages.values().collect(), |one| vec![one]);
        for kind in ["bin", "test", "bench", "example"] {
            if let Some(name) = value(&format!("--{kind}")) {
                let target = (kind.to_owned(), name.to_owned());
                let known = packages.iter().any(|package| package.targets.contains(&target));
                known.then_some(()).ok_or(format!("no {kind} `{name}`"))?;
            }
        }
        let mut features = value("--features").into_iter().flat_map(|features| features.split(','));
        features.try_for_each(|feature| self.check_feature(feature, &packages))
    }

    fn check_feature(&self, feature: &str, packages: &[&Package]) -> Result<(), String> {
        let known = match feature.split_once('/') {
            Some((package, feature)) => {
                self.packages.get(package).is_some_and(|package| package.features.contains(feature))
            }
            None => packages.iter().any(|package| package.features.contains(feature)),
        };
        known.then_some(()).ok_or(format!("no feature `{feature}`"))
    }
}

impl Package {
    fn read(package: &Value) -> Self {
        let targets = package["targets"].as_array().expect("targets").iter();
        let target = |target: &Value| (text(&target["kind"][0]), text(&target["name"]));
        let features = package["features"].as_object().expect("features").keys().cloned();
        Self { features: features.collect(), targets: targets.map(target).collect() }
    }
}

fn text(value: &Value) -> String {
    value.as_str().expect("text").to_owned()
}
