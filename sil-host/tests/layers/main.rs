//! Layers of the workspace's source: the library of `sil-host` never names the program on top of it, and
//! no library has a circle of files that import each other.

mod import;
mod source;

use std::path::{Path, PathBuf};

use import::Graph;
use source::{Source, without_strings};

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a crate of the workspace").to_owned()
}

/// Sources of the library of the crate in the directory `name`.
fn library(name: &str) -> Vec<Source> {
    let sources = Source::all_under(&workspace().join(name).join("src"));
    assert!(sources.len() > 3, "{name} has a library of some files");
    sources.into_iter().filter(|source| !source.is_program()).collect()
}

/// Words that belong to the program: the argument parser, the progress display, and printing.
const PROGRAM_WORDS: [&str; 8] =
    ["cli", "clap", "indicatif", "print", "println", "eprint", "eprintln", "exit"];

/// The program's words in `code`, each with its line.
fn program_words(code: &str) -> Vec<(usize, &str)> {
    code.lines()
        .enumerate()
        .flat_map(|(index, line)| {
            let words = line.split(|c: char| !(c.is_alphanumeric() || c == '_'));
            words.filter(|word| PROGRAM_WORDS.contains(word)).map(move |word| (index + 1, word))
        })
        .collect()
}

#[test]
fn the_library_names_nothing_of_the_program() {
    let mut found = Vec::new();
    for source in library("sil-host") {
        let code = without_strings(source.code());
        for (line, word) in program_words(&code) {
            found.push(format!("{}:{line}: {word}", source.path().display()));
        }
    }
    assert!(found.is_empty(), "the library names the program's:\n{}", found.join("\n"));
}

#[test]
fn files_import_each_other_without_a_circle() {
    let mut circles = Vec::new();
    for name in ["ctrl-core", "link", "sim", "sil-host"] {
        let graph = Graph::new(&library(name));
        assert!(graph.edges() > 0, "{name}: imports are found");
        circles.extend(graph.circles().iter().map(|circle| format!("{name}: {circle}")));
    }
    assert!(circles.is_empty(), "files import each other in a circle:\n{}", circles.join("\n"));
}

#[test]
fn a_word_of_the_program_is_found_outside_strings_and_comments_only() {
    let source = Source::new("a.rs", "// println\nfn f() {\n    println!(\"clap\");\n}\n");
    let code = without_strings(source.code());
    assert_eq!(program_words(&code), [(3, "println")]);
}

#[test]
fn a_circle_is_found_through_braces_super_and_re_exports() {
    let files = [
        ("lib.rs", "pub mod a;\npub mod b;\n"),
        ("a/mod.rs", "mod inner;\npub use inner::Thing;\n"),
        ("a/inner.rs", "use crate::b::{Other, deep::{Deep}};\n"),
        ("b.rs", "pub struct Other;\nfn f(_: &super::a::Thing) {}\n"),
    ];
    let sources: Vec<_> = files.map(|(path, text)| Source::new(path, text)).into();
    let circles = Graph::new(&sources).circles();
    assert_eq!(circles, ["a/inner.rs -> b.rs -> a/inner.rs"]);
    let through_parent = [
        ("lib.rs", "pub mod a;\npub mod b;\n"),
        ("a/mod.rs", "mod inner;\npub struct Outer;\nfn f() { inner::g() }\n"),
        ("a/inner.rs", "use super::Outer;\nuse crate::b::B;\n"),
        ("b.rs", "use crate::a::Outer;\npub struct B;\n"),
    ];
    let sources: Vec<_> = through_parent.map(|(path, text)| Source::new(path, text)).into();
    let circles = Graph::new(&sources).circles();
    assert_eq!(circles, ["a/mod.rs -> a/inner.rs -> b.rs -> a/mod.rs"]);
    let tests_may = [
        ("lib.rs", "pub mod a;\npub mod b;\n"),
        ("a.rs", "use crate::b::B;\npub struct A;\n"),
        ("b.rs", "pub struct B;\n#[cfg(test)]\nmod tests {\n    use crate::a::A;\n}\n"),
    ];
    let sources: Vec<_> = tests_may.map(|(path, text)| Source::new(path, text)).into();
    assert!(Graph::new(&sources).circles().is_empty());
}
