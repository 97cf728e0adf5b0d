//! Every command, code block and link of the README and of `docs/`, held against the project.
//!
//! | block | check |
//! |---|---|
//! | `sh` | commands of `sil-host` are run, shortened as [`program`] lists; names in `cargo` commands must exist |
//! | `toml` | read by the program as the scenario, campaign, vehicle file or part of a scenario that it is |
//! | `rust` | compiled and run as a doc test (`tests/src/documentation.rs`) |
//! | `python` | run by `python3`, with the feature `tool-tests`; pages that use `gyrfalcon`: `python/tests/test_documentation.py` |
//! | `text` | output, formulas and diagrams: nothing to run |
//! | bytes in hex | compared with the code by `link/src/tests/documented.rs` |
//!
//! A block that cannot run stands below a comment `<!-- not run: REASON -->`. Anything else is an error.
//! The commands of `pil` fly in the emulator with the feature `emulator-tests`; without, the
//! program reads their options and ends at the missing image.

mod cargo;
mod links;
mod markdown;
mod program;
mod shell;
mod toml;

use std::fs;
use std::path::{Path, PathBuf};

use markdown::{Block, Language};
use program::Program;

/// The root of the repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().expect("a repository")
}

/// A page of the documentation.
struct Page {
    /// Path from the root of the repository.
    name: String,
    text: String,
}

/// README, contributor's guide and everything in `docs/`, in order of their names.
fn pages() -> Vec<Page> {
    let mut files = vec![root().join("README.md"), root().join("CONTRIBUTING.md")];
    let mut folders = vec![root().join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                files.push(path);
            }
        }
    }
    files.sort();
    let page = |path: PathBuf| Page {
        name: path.strip_prefix(root()).expect("inside").display().to_string(),
        text: fs::read_to_string(&path).expect("UTF-8"),
    };
    files.into_iter().map(page).collect()
}

/// Runs `check` for every block of a language that is not marked as not run; panics with all errors.
fn check_blocks(language: Language, mut check: impl FnMut(&Page, &Block) -> Result<(), String>) {
    let mut errors = Vec::new();
    for page in pages() {
        for block in markdown::blocks(&page.text) {
            if block.language == language && block.not_run.is_none() {
                let located = |error| format!("{}:{}: {error}", page.name, block.line);
                errors.extend(check(&page, &block).err().map(located));
            }
        }
    }
    assert!(errors.is_empty(), "{}", errors.join("\n"));
}

#[test]
fn every_block_is_of_a_kind_that_is_checked_or_marked_as_not_run() {
    check_blocks(Language::Unknown, |_, block| {
        let first = block.text.lines().next().unwrap_or_default();
        Err(format!(
            "no check for this block: mark it `text` or `<!-- not run: REASON -->`: {first}"
        ))
    });
    let all: Vec<_> = pages().iter().flat_map(|page| markdown::blocks(&page.text)).collect();
    for language in [Language::Shell, Language::Toml, Language::Rust, Language::Python] {
        assert!(all.iter().any(|block| block.language == language), "no block of {language:?}");
    }
}

#[test]
fn blocks_that_are_not_run_say_why() {
    for page in pages() {
        for block in markdown::blocks(&page.text) {
            if let Some(reason) = block.not_run {
                println!("{}:{}: not run: {reason}", page.name, block.line);
                assert!(reason.len() > 10, "{}:{}: give a reason", page.name, block.line);
            }
        }
    }
}

#[test]
fn commands_run() {
    let names = cargo::Names::of_the_workspace(&root());
    let mut program = None::<(String, Program)>;
    check_blocks(Language::Shell, |page, block| {
        if program.as_ref().is_none_or(|(name, _)| *name != page.name) {
            program = Some((page.name.clone(), Program::for_page(&page.name)));
        }
        let (_, program) = program.as_ref().expect("set above");
        shell::commands(&block.text)?.iter().try_for_each(|command| {
            let run = match command.sil_host() {
                Some(arguments) => program.run(&arguments, command),
                None => names.check(&command.words),
            };
            run.map_err(|error| format!("`{}`: {error}", command.words.join(" ")))
        })
    });
}

#[test]
fn commands_within_sentences_name_what_exists() {
    let names = cargo::Names::of_the_workspace(&root());
    let mut errors = Vec::new();
    for page in pages() {
        for span in markdown::code_spans(&page.text).filter(|span| span.starts_with("cargo ")) {
            let words: Vec<_> = span.split_whitespace().map(str::to_owned).collect();
            let located = |error| format!("{}: `{span}`: {error}", page.name);
            errors.extend(names.check(&words).err().map(located));
        }
    }
    assert!(errors.is_empty(), "{}", errors.join("\n"));
}

#[test]
fn toml_is_read_by_the_program() {
    let program = Program::for_page("toml");
    check_blocks(Language::Toml, |_, block| toml::check(&program, &block.text));
}

#[test]
fn rust_is_in_the_documentation_tests() {
    let list = fs::read_to_string(root().join("tests/src/documentation.rs")).expect("the list");
    check_blocks(Language::Rust, |page, _| {
        let entry = format!("\"../../{}\"", page.name);
        list.contains(&entry)
            .then_some(())
            .ok_or(format!("tests/src/documentation.rs lacks {entry}"))
    });
}

#[cfg(feature = "tool-tests")]
#[test]
fn python_runs() {
    check_blocks(Language::Python, |page, block| {
        // The wheel is in an environment of its own, in which `cargo xtask python` runs these pages.
        if page.text.contains("import gyrfalcon") {
            return Ok(());
        }
        let python = std::process::Command::new("python3").args(["-c", &block.text]).output();
        let output = python.map_err(|error| format!("python3: {error}; apt install python3"))?;
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        output.status.success().then_some(()).ok_or(error)
    });
}

#[test]
fn links_lead_somewhere() {
    let errors: Vec<_> = pages().iter().flat_map(|page| links::broken(&root(), page)).collect();
    assert!(errors.is_empty(), "{}", errors.join("\n"));
}
